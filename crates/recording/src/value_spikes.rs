//! Impossible single values of a speed or a yaw rate.
//!
//! A wrong value moves or turns the vehicle for one step. It is replaced by the median of its
//! neighbours, as an impossible step of a distance counter is.

/// Number of values on each side that determine the usual value.
const NEIGHBOURS: usize = 3;
/// Minimum ratio of a spike to the 95th percentile of the other nonzero values, so that a quantity
/// of coarse resolution has no spikes.
const TIMES_USUAL: f64 = 3.0;

/// Physical limits of a quantity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Maximum change per second.
    change_per_s: f64,
    /// Maximum deviation that is attributed to noise and resolution.
    resolution: f64,
}

impl Limits {
    /// Speed: acceleration of 10 m/s², resolution of 0.5 m/s.
    pub const SPEED: Self = Self {
        change_per_s: 10.0,
        resolution: 0.5,
    };
    /// Yaw rate: angular acceleration of 30 rad/s², resolution of 1 rad/s.
    pub const YAW_RATE: Self = Self {
        change_per_s: 30.0,
        resolution: 1.0,
    };
}

/// Replaced value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spike {
    /// Index of the value.
    pub index: usize,
    /// Value in the file.
    pub value: f64,
    /// Median of the neighbouring values, used instead.
    pub used: f64,
}

/// Replaces the spikes of values at strictly increasing times in place. Values that are not finite
/// are ignored.
pub fn replace_spikes(times_s: &[f64], values: &mut [f64], limits: Limits) -> Vec<Spike> {
    let known: Vec<(usize, f64, f64)> = (times_s.iter().zip(values.iter()).enumerate())
        .map(|(index, (time_s, value))| (index, *time_s, *value))
        .filter(|it| it.2.is_finite())
        .collect();
    let usual = usual(&known);
    let mut spikes = Vec::new();
    for (k, &(index, time_s, value)) in known.iter().enumerate() {
        if value.abs() <= TIMES_USUAL * usual {
            continue;
        }
        let first = k.saturating_sub(NEIGHBOURS);
        let near = known.iter().enumerate().skip(first);
        let near = near.take_while(|(other, _)| *other <= k + NEIGHBOURS);
        let mut others: Vec<f64> = near
            .filter(|(other, _)| *other != k)
            .map(|(_, it)| it.2)
            .collect();
        if others.len() < NEIGHBOURS {
            continue;
        }
        others.sort_by(f64::total_cmp);
        let Some(&used) = others.get(others.len() / 2) else {
            continue;
        };
        let time_of = |other: Option<usize>| other.and_then(|it| known.get(it)).map(|it| it.1);
        let before_s = time_of(k.checked_sub(1)).map_or(0.0, |it| time_s - it);
        let after_s = time_of(Some(k + 1)).map_or(0.0, |it| it - time_s);
        let change = limits.change_per_s * NEIGHBOURS as f64 * before_s.max(after_s);
        if (value - used).abs() > limits.resolution + change {
            spikes.push(Spike { index, value, used });
        }
    }
    for spike in &spikes {
        if let Some(value) = values.get_mut(spike.index) {
            *value = spike.used;
        }
    }
    spikes
}

/// Returns the 95th percentile of the nonzero magnitudes without the largest [`NEIGHBOURS`]; 0 if
/// there are no others.
fn usual(known: &[(usize, f64, f64)]) -> f64 {
    let magnitudes = known.iter().map(|it| it.2.abs());
    let mut sorted: Vec<f64> = magnitudes.filter(|it| *it > 0.0).collect();
    sorted.sort_by(f64::total_cmp);
    sorted.truncate(sorted.len().saturating_sub(NEIGHBOURS));
    sorted
        .get(sorted.len().saturating_sub(1) * 95 / 100)
        .copied()
        .unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns times and speeds of a vehicle that starts, drives at 1 m/s, stops and reverses.
    fn driven(rate_hz: f64) -> (Vec<f64>, Vec<f64>) {
        let speed = |k: u32| match k {
            0..50 | 200..230 => 0.0,
            50..200 => 1.0,
            _ => -1.0,
        };
        let times_s = (0..400).map(|k| f64::from(k) / rate_hz).collect();
        (times_s, (0..400).map(speed).collect())
    }

    #[test]
    fn speeds_without_spikes_are_not_changed() {
        for rate_hz in [1.0, 20.0, 100.0] {
            let (times_s, given) = driven(rate_hz);
            let mut values = given.clone();
            assert_eq!(replace_spikes(&times_s, &mut values, Limits::SPEED), []);
            assert_eq!(values, given);
            // A counter of 1 cm per tick, differentiated: one nonzero speed in ten.
            let mut ticks: Vec<f64> = (0..400)
                .map(|k| if k % 10 == 0 { 0.01 * rate_hz } else { 0.0 })
                .collect();
            assert_eq!(replace_spikes(&times_s, &mut ticks, Limits::SPEED), []);
        }
    }

    #[test]
    fn spikes_of_any_size_and_sign_are_replaced() {
        for rate_hz in [5.0, 20.0, 100.0] {
            for at in [[10, 10], [120, 120], [120, 121], [215, 215], [398, 399]] {
                for value in [20.0, -300.0, 1e30, 1e256] {
                    let (times_s, given) = driven(rate_hz);
                    let mut values = given.clone();
                    values[at[0]] = value;
                    values[at[1]] = value;
                    values[60] = f64::NAN;
                    let spikes = replace_spikes(&times_s, &mut values, Limits::SPEED);
                    let count = if at[0] == at[1] { 1 } else { 2 };
                    assert_eq!(spikes.len(), count, "{rate_hz} Hz, {at:?}, {value}");
                    values[60] = given[60];
                    assert_eq!(values, given, "{rate_hz} Hz, {at:?}, {value}");
                }
            }
        }
    }
}
