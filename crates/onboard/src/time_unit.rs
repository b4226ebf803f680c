//! Detection of the unit of the time stamps of odometry and angles: seconds, or by mistake
//! milliseconds, microseconds or nanoseconds.
//!
//! Absolute times show their unit by their size: seconds since 1970 stay below 10¹¹ until the year
//! 5138, milliseconds exceed it since 1973. Relative times show it by the interval between samples,
//! and by the ratio of the distances to the products of speed and time: a wrong unit makes this
//! ratio a power of 1000.

use crate::observation::OdometrySample;

/// Maximum time of a drive (s), whether it counts from 1970 or from the start.
pub const MAX_TIME_S: f64 = 1e11;

/// Median interval between odometry samples (s) above which the times cannot be seconds.
const MAX_STEP_S: f64 = 10.0;

/// Median interval between odometry samples (s) above which the distances are compared with the
/// products of speed and time to determine the unit. An odometry at 2 kHz in milliseconds has this
/// interval.
const SUSPECT_STEP_S: f64 = 0.5;

/// Maximum median interval between odometry samples (s) after the correction of the unit: 0.5 Hz.
const USUAL_STEP_S: f64 = 2.0;

/// Speed (m/s) below which the average motion of a moving vehicle is implausibly slow.
const CRAWL_MPS: f64 = 0.02;

/// Range of the ratio of two distances that agree.
const AGREE: core::ops::Range<f64> = 0.7..1.5;

/// Minimum path length (m) for a comparison of the distances with the speeds.
const MIN_COMPARED_M: f64 = 1.0;

/// Number of intervals of an odometry stream from which its time unit is determined.
const STREAM_STEPS: usize = 9;

/// Unit of a time that is not in seconds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TimeUnit {
    /// 10⁻³ s.
    Milliseconds,
    /// 10⁻⁶ s.
    Microseconds,
    /// 10⁻⁹ s.
    Nanoseconds,
}

impl TimeUnit {
    /// All units, the longest first.
    pub const ALL: [Self; 3] = [Self::Milliseconds, Self::Microseconds, Self::Nanoseconds];

    /// Returns the number of units per second.
    pub const fn per_second(self) -> f64 {
        match self {
            Self::Milliseconds => 1e3,
            Self::Microseconds => 1e6,
            Self::Nanoseconds => 1e9,
        }
    }

    /// Returns the name in the plural.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Milliseconds => "milliseconds",
            Self::Microseconds => "microseconds",
            Self::Nanoseconds => "nanoseconds",
        }
    }

    /// Returns the likely unit of a time that is too large to be in seconds since 1970; `None` if
    /// the time may be in seconds.
    pub fn of_epoch(time: f64) -> Option<Self> {
        let mut units = Self::ALL.into_iter();
        let is_time = |unit: &Self| time.abs() / unit.per_second() <= MAX_TIME_S;
        (time.abs() > MAX_TIME_S).then(|| units.find(is_time).unwrap_or(Self::Nanoseconds))
    }
}

impl core::fmt::Display for TimeUnit {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(self.name())
    }
}

/// Quantities of an odometry that depend on the unit of its times.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct OdometryTimes {
    /// Time stamp of any sample (s, if the unit is correct).
    pub time_s: f64,
    /// Median interval between samples.
    pub step_s: f64,
    /// Duration for which the vehicle moved.
    pub moving_s: f64,
    /// Path length (m) according to the distances.
    pub by_distance_m: f64,
    /// Path length (m) as the integral of the speeds over time; `None` if speeds or distances were
    /// derived from the others.
    pub by_speed_m: Option<f64>,
}

impl OdometryTimes {
    /// Returns the unit of the times; `None` if they may be seconds.
    pub fn unit(&self) -> Option<TimeUnit> {
        if self.step_s <= SUSPECT_STEP_S {
            return TimeUnit::of_epoch(self.time_s);
        }
        let by_speed_m = self.by_speed_m.filter(|it| *it > MIN_COMPARED_M);
        let contradicts = |unit: &TimeUnit| {
            by_speed_m
                .is_some_and(|it| AGREE.contains(&(self.by_distance_m / it * unit.per_second())))
        };
        if let Some(unit) = TimeUnit::ALL.into_iter().find(contradicts) {
            return Some(unit);
        }
        let agrees = by_speed_m.is_some_and(|it| AGREE.contains(&(self.by_distance_m / it)));
        let crawls =
            self.by_distance_m > MIN_COMPARED_M && self.by_distance_m < CRAWL_MPS * self.moving_s;
        if self.step_s <= MAX_STEP_S && (agrees || !crawls) {
            return TimeUnit::of_epoch(self.time_s);
        }
        let is_usual = |unit: &TimeUnit| self.step_s / unit.per_second() <= USUAL_STEP_S;
        Some(
            TimeUnit::ALL
                .into_iter()
                .find(is_usual)
                .unwrap_or(TimeUnit::Nanoseconds),
        )
    }
}

/// Detector of the time unit of an odometry stream, from its first intervals. It allocates no
/// memory.
#[derive(Debug, Clone, Default)]
pub struct StreamTimes {
    last: Option<OdometrySample>,
    steps_s: [f64; STREAM_STEPS],
    count: usize,
    times: OdometryTimes,
    unit: Option<TimeUnit>,
}

impl StreamTimes {
    /// Adds a sample. Returns the unit of the stream's times if they are not seconds; the result of
    /// the first intervals also applies to all later samples. A distance of NaN means that the
    /// odometry provides no distance.
    pub fn add(&mut self, sample: &OdometrySample) -> Option<TimeUnit> {
        let Some(last) = self.last.replace(*sample) else {
            return TimeUnit::of_epoch(sample.time_s);
        };
        let Some(slot) = self.steps_s.get_mut(self.count) else {
            return self.unit.or_else(|| TimeUnit::of_epoch(sample.time_s));
        };
        let step_s = sample.time_s - last.time_s;
        if step_s.is_nan() || step_s <= 0.0 {
            return None;
        }
        *slot = step_s;
        self.count += 1;
        let moved_m = (sample.distance_m - last.distance_m).abs();
        let by_speed_m = 0.5 * (sample.speed_mps + last.speed_mps).abs() * step_s;
        self.times.time_s = sample.time_s;
        if moved_m.is_finite() && by_speed_m.is_finite() {
            self.times.by_distance_m += moved_m;
            *self.times.by_speed_m.get_or_insert(0.0) += by_speed_m;
            self.times.moving_s += if moved_m > 0.0 { step_s } else { 0.0 };
        }
        if self.count < STREAM_STEPS {
            return None;
        }
        let mut sorted_s = self.steps_s;
        sorted_s.sort_unstable_by(f64::total_cmp);
        self.times.step_s = sorted_s.get(STREAM_STEPS / 2).copied().unwrap_or(0.0);
        self.unit = self.times.unit();
        self.unit
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the detected unit for a vehicle at 1 m/s, sampled at a rate, with times in a unit
    /// (per second).
    fn first_unit(
        rate_hz: f64,
        per_second: f64,
        start_s: f64,
        has_distance: bool,
    ) -> Option<TimeUnit> {
        let mut times = StreamTimes::default();
        let samples = (0..20).map(|k| f64::from(k) / rate_hz);
        let units = samples.map(|time_s| {
            times.add(&OdometrySample {
                time_s: (start_s + time_s) * per_second,
                distance_m: if has_distance { time_s } else { f64::NAN },
                speed_mps: 1.0,
                yaw_rate_radps: None,
            })
        });
        let units: Vec<_> = units.collect();
        // The result of the first intervals holds for all later samples.
        let judged = &units[STREAM_STEPS..];
        assert!(judged.iter().all(|it| *it == judged[0]), "{units:?}");
        units.into_iter().find_map(|unit| unit)
    }

    #[test]
    fn times_in_seconds_are_accepted() {
        for rate_hz in [0.5, 1.0, 5.0, 20.0, 100.0, 1000.0] {
            for start_s in [0.0, 12.0, 1.7e9] {
                for has_distance in [true, false] {
                    assert_eq!(
                        first_unit(rate_hz, 1.0, start_s, has_distance),
                        None,
                        "{rate_hz} Hz"
                    );
                }
            }
        }
    }

    #[test]
    fn other_units_are_found_within_ten_samples() {
        for unit in TimeUnit::ALL {
            for start_s in [0.0, 12.0, 1.7e9] {
                for rate_hz in [5.0, 20.0, 50.0] {
                    let found = first_unit(rate_hz, unit.per_second(), start_s, true);
                    assert_eq!(found, Some(unit), "{unit} at {rate_hz} Hz from {start_s} s");
                    let by_speed = first_unit(rate_hz, unit.per_second(), start_s, false);
                    assert!(
                        by_speed.is_some(),
                        "{unit} at {rate_hz} Hz without distances"
                    );
                }
            }
        }
    }

    #[test]
    fn a_wrong_unit_of_distances_is_not_reported_as_a_unit_of_times() {
        let times = OdometryTimes {
            step_s: 0.05,
            moving_s: 60.0,
            by_distance_m: 60.0,
            by_speed_m: Some(60e3),
            ..OdometryTimes::default()
        };
        assert_eq!(times.unit(), None);
    }

    #[test]
    fn slow_and_standing_vehicles_are_accepted() {
        let slow = OdometryTimes {
            step_s: 1.0,
            moving_s: 3600.0,
            by_distance_m: 36.0,
            by_speed_m: Some(36.5),
            ..OdometryTimes::default()
        };
        assert_eq!(slow.unit(), None);
        let standing = OdometryTimes {
            by_distance_m: 0.0,
            by_speed_m: Some(0.0),
            moving_s: 0.0,
            ..slow
        };
        assert_eq!(standing.unit(), None);
    }
}
