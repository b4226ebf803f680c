//! Yaw rates of odometry from other sources in its bag.
//!
//! A yaw rate is valid for the step before its sample, as in the localizer. It is the mean over
//! this step, from a gyroscope with a higher rate or from a heading.

use onboard::geometry::wrap_angle;

use crate::value_spikes::{Limits, replace_spikes};

/// Minimum fraction of a step that readings must cover.
const MIN_COVERED_FRACTION: f64 = 0.5;
/// Minimum interval of two readings, in median intervals, that is a gap without information.
const GAP_STEPS: f64 = 5.0;
/// Minimum total change of a heading that is not a constant with rounding (rad).
const MIN_TURN_RAD: f64 = 1e-6;
/// Maximum deviation of a unit quaternion's squared norm from 1.
const NORM_TOLERANCE: f64 = 1e-3;

/// Readings of a gyroscope in order of time.
#[derive(Debug, Clone, Default)]
pub struct Gyroscope {
    /// Time (s) and yaw rate (rad/s), with strictly increasing times.
    readings: Vec<(f64, f64)>,
    /// Number of unusable messages.
    pub left_out: usize,
}

impl Gyroscope {
    /// Adds a reading; omits one that is not finite or not later than the previous one.
    pub fn add(&mut self, reading: Option<(f64, f64)>) {
        let last_s = self.readings.last().map_or(f64::NEG_INFINITY, |it| it.0);
        let usable = |(time_s, rate): &(f64, f64)| {
            time_s.is_finite() && rate.is_finite() && *time_s > last_s
        };
        match reading.filter(usable) {
            Some(reading) => self.readings.push(reading),
            None => self.left_out += 1,
        }
    }

    /// Replaces impossible single yaw rates by the median of their neighbours; they count as left
    /// out.
    pub fn replace_spikes(&mut self) {
        let (times_s, mut rates): (Vec<f64>, Vec<f64>) = self.readings.iter().copied().unzip();
        self.left_out += replace_spikes(&times_s, &mut rates, Limits::YAW_RATE).len();
        for (reading, rate) in self.readings.iter_mut().zip(rates) {
            reading.1 = rate;
        }
    }

    /// Returns the number of usable readings.
    pub fn len(&self) -> usize {
        self.readings.len()
    }

    /// Whether every reading is zero, which indicates an unfilled field.
    pub fn is_silent(&self) -> bool {
        self.readings.iter().all(|(_, rate)| *rate == 0.0)
    }

    /// Returns the times of the first and the last reading (s).
    pub fn interval_s(&self) -> Option<[f64; 2]> {
        Some([self.readings.first()?.0, self.readings.last()?.0])
    }

    /// Returns the mean yaw rate over the step before each time; `None` if too little of the step
    /// is covered.
    pub fn rates(&self, times_s: &[f64]) -> Vec<Option<f64>> {
        let longest_s = GAP_STEPS * self.usual_step_s();
        over_steps(times_s, |from_s, to_s| {
            let first = self.readings.partition_point(|it| it.0 <= from_s);
            let pairs = self.readings.windows(2).skip(first.saturating_sub(1));
            let (mut turned_rad, mut covered_s) = (0.0, 0.0);
            for pair in pairs {
                let &[(a_s, a), (b_s, b)] = pair else {
                    continue;
                };
                if a_s >= to_s {
                    break;
                }
                let (start_s, end_s) = (a_s.max(from_s), b_s.min(to_s));
                if b_s - a_s > longest_s || end_s <= start_s {
                    continue;
                }
                let middle = (0.5 * (start_s + end_s) - a_s) / (b_s - a_s);
                turned_rad += (a + middle * (b - a)) * (end_s - start_s);
                covered_s += end_s - start_s;
            }
            (covered_s >= MIN_COVERED_FRACTION * (to_s - from_s)).then_some(turned_rad / covered_s)
        })
    }

    fn usual_step_s(&self) -> f64 {
        let pairs = self.readings.windows(2).filter_map(|pair| match pair {
            [a, b] => Some(b.0 - a.0),
            _ => None,
        });
        let mut steps_s: Vec<f64> = pairs.collect();
        steps_s.sort_by(f64::total_cmp);
        steps_s.get(steps_s.len() / 2).copied().unwrap_or(0.0)
    }
}

/// Returns the mean yaw rate over the step before each time from the headings; `None` without
/// headings, and for all steps if the heading is constant.
pub fn rates_of_headings(times_s: &[f64], headings_rad: &[Option<f64>]) -> Vec<Option<f64>> {
    let mut known = headings_rad.iter().flatten();
    let first = known.next().copied().unwrap_or(0.0);
    let turns = known.any(|heading| wrap_angle(heading - first).abs() > MIN_TURN_RAD);
    let mut pairs = headings_rad.windows(2);
    over_steps(times_s, |from_s, to_s| match pairs.next()? {
        [Some(before), Some(after)] if turns => Some(wrap_angle(after - before) / (to_s - from_s)),
        _ => None,
    })
}

/// Applies a function to each step; the first time has no step and gets the value of the second.
fn over_steps(times_s: &[f64], mut rate: impl FnMut(f64, f64) -> Option<f64>) -> Vec<Option<f64>> {
    let steps = times_s.windows(2).map(|step| match step {
        [from_s, to_s] => rate(*from_s, *to_s),
        _ => None,
    });
    let mut rates: Vec<Option<f64>> = steps.collect();
    let first = rates.first().copied().flatten();
    rates.insert(0, first);
    rates.truncate(times_s.len());
    rates
}

/// Returns the yaw of a quaternion x, y, z, w; `None` if it is not a rotation.
pub fn yaw_rad([x, y, z, w]: [f64; 4]) -> Option<f64> {
    let norm = x * x + y * y + z * z + w * w;
    let yaw = (2.0 * (w * z + x * y)).atan2(1.0 - 2.0 * (y * y + z * z));
    // The comparison is false for NaN.
    ((norm - 1.0).abs() < NORM_TOLERANCE).then_some(yaw)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    fn read(readings: impl IntoIterator<Item = (f64, f64)>) -> Gyroscope {
        let mut gyroscope = Gyroscope::default();
        readings.into_iter().for_each(|it| gyroscope.add(Some(it)));
        gyroscope
    }

    /// The trapezoidal rule is exact for a linear yaw rate and any sampling times.
    #[test]
    fn a_gyroscope_is_averaged_over_the_steps_of_the_odometry() {
        let rate = |time_s: f64| 0.3 - 0.2 * time_s;
        for offset_s in [0.0, 1.7e9] {
            let step_s = 0.007;
            let readings = (0..2000).map(|k| f64::from(k) * step_s);
            let gyroscope = read(readings.map(|time_s| (offset_s + time_s, rate(time_s))));
            let times_s: Vec<f64> = (1..100).map(|k| 0.1 * f64::from(k)).collect();
            let shifted: Vec<f64> = times_s.iter().map(|time_s| offset_s + time_s).collect();
            let found = gyroscope.rates(&shifted);
            assert_eq!(found.len(), times_s.len());
            for (time_s, found) in times_s.iter().zip(&found).skip(1) {
                // Times of 1.7e9 s have a resolution of 2.4e-7 s.
                let error = found.unwrap() - rate(time_s - 0.05);
                assert!(error.abs() < 1e-6, "{time_s}: {error}");
            }
            assert_eq!(found[0], found[1]);
        }
    }

    #[test]
    fn steps_without_readings_have_no_yaw_rate() {
        let early = (0..=100).map(|k| (0.01 * f64::from(k), 0.5));
        let late = (200..=300).map(|k| (0.01 * f64::from(k), -0.5));
        let gyroscope = read(early.chain(late));
        let times_s: Vec<f64> = (0..=8).map(|k| 0.5 * f64::from(k)).collect();
        let rates = gyroscope.rates(&times_s);
        let close = |found: Option<f64>, to: f64| (found.unwrap() - to).abs() < 1e-12;
        assert!(close(rates[1], 0.5) && close(rates[2], 0.5));
        assert_eq!(rates[3..=4], [None, None]);
        assert!(close(rates[5], -0.5) && close(rates[6], -0.5));
        assert_eq!(rates[7..], [None, None]);
        assert_eq!(Gyroscope::default().rates(&times_s), vec![None; 9]);
        assert!(gyroscope.rates(&[]).is_empty());
    }

    #[test]
    fn reversed_and_invalid_readings_are_omitted() {
        let mut gyroscope = read([(0.0, 0.1), (0.1, 0.1), (0.1, 0.2), (0.05, 3.0)]);
        gyroscope.add(Some((0.2, f64::NAN)));
        gyroscope.add(None);
        assert_eq!((gyroscope.len(), gyroscope.left_out), (2, 4));
    }

    #[test]
    fn heading_differences_are_wrapped() {
        let times_s: Vec<f64> = (0..50).map(|k| 0.02 * f64::from(k)).collect();
        let heading = |time_s: &f64| Some(wrap_angle(3.0 + 2.0 * time_s));
        let mut headings: Vec<_> = times_s.iter().map(heading).collect();
        headings[30] = None;
        for (k, rate) in rates_of_headings(&times_s, &headings)
            .into_iter()
            .enumerate()
        {
            match rate {
                Some(rate) => assert!((rate - 2.0).abs() < 1e-9),
                None => assert!(k == 30 || k == 31),
            }
        }
        let standing = vec![Some(0.7); 50];
        assert_eq!(rates_of_headings(&times_s, &standing), vec![None; 50]);
    }

    #[test]
    fn quaternions_that_are_no_rotations_have_no_yaw() {
        let half: f64 = 0.4;
        let yaw = yaw_rad([0.0, 0.0, half.sin(), half.cos()]).unwrap();
        assert!((yaw - 0.8).abs() < 1e-12);
        for q in [
            [0.0; 4],
            [f64::NAN; 4],
            [0.0, 0.0, 0.0, f64::INFINITY],
            [1e200; 4],
        ] {
            assert_eq!(yaw_rad(q), None, "{q:?}");
        }
        // Half a turn in steps that cross the branch cut.
        assert!((wrap_angle(yaw_rad([0.0, 0.0, 1.0, 0.0]).unwrap()).abs() - PI).abs() < 1e-9);
    }
}
