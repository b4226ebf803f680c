//! Position along the road as a function of time: acceleration, cruise and braking between stops.

use onboard::settings::Vehicle;

use crate::scenario::MotionSettings;

/// Drive from one end of the road to the other, with stops.
#[derive(Debug, Clone, PartialEq)]
pub struct MotionProfile {
    legs: Vec<Leg>,
    duration_s: f64,
    length_m: f64,
}

/// Position along the road and speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// Distance along the road in metres.
    pub along_m: f64,
    /// Speed along the road in m/s.
    pub speed_mps: f64,
}

/// Motion from standstill to standstill.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Leg {
    start_s: f64,
    start_m: f64,
    length_m: f64,
    acceleration_mps2: f64,
    peak_mps: f64,
    ramp_s: f64,
    cruise_s: f64,
}

impl Leg {
    fn new(
        start_s: f64,
        start_m: f64,
        length_m: f64,
        acceleration_mps2: f64,
        top_mps: f64,
    ) -> Self {
        // A short leg does not reach the top speed: accelerate for one half, brake for the other
        // half.
        let peak_mps = top_mps.min((acceleration_mps2 * length_m).sqrt());
        let ramp_s = peak_mps / acceleration_mps2;
        let cruise_s = (length_m - peak_mps * ramp_s).max(0.0) / peak_mps;
        Self {
            start_s,
            start_m,
            length_m,
            acceleration_mps2,
            peak_mps,
            ramp_s,
            cruise_s,
        }
    }

    fn duration_s(&self) -> f64 {
        2.0 * self.ramp_s + self.cruise_s
    }

    fn motion(&self, time_s: f64) -> Motion {
        let elapsed_s = (time_s - self.start_s).max(0.0);
        let remaining_s = (self.duration_s() - elapsed_s).max(0.0);
        let half_a = 0.5 * self.acceleration_mps2;
        let (local_m, speed_mps) = if elapsed_s < self.ramp_s {
            (
                half_a * elapsed_s * elapsed_s,
                self.acceleration_mps2 * elapsed_s,
            )
        } else if remaining_s < self.ramp_s {
            let remaining_m = half_a * remaining_s * remaining_s;
            (
                self.length_m - remaining_m,
                self.acceleration_mps2 * remaining_s,
            )
        } else {
            (
                self.peak_mps * (elapsed_s - 0.5 * self.ramp_s),
                self.peak_mps,
            )
        };
        Motion {
            along_m: self.start_m + local_m,
            speed_mps,
        }
    }
}

impl MotionProfile {
    /// Creates the drive of a vehicle to the end of a road of `length_m`. The stops must be in
    /// driving order and on the road.
    pub fn new(settings: &MotionSettings, vehicle: &Vehicle, length_m: f64) -> Self {
        let acceleration_mps2 = settings
            .acceleration_mps2
            .unwrap_or(vehicle.acceleration_mps2);
        let top_speed_kmh = settings.top_speed_kmh.unwrap_or(vehicle.top_speed_kmh);
        let (mut time_s, mut along_m) = (0.0, settings.start_at_m);
        let ahead = settings.stops.iter().filter(|stop| stop.at_m > along_m);
        let ends: Vec<_> = ahead.map(|stop| (stop.at_m, stop.dwell_s)).collect();
        let mut legs = Vec::with_capacity(settings.stops.len() + 1);
        for (end_m, dwell_s) in ends.into_iter().chain([(length_m, 0.0)]) {
            let leg = Leg::new(
                time_s,
                along_m,
                end_m - along_m,
                acceleration_mps2,
                top_speed_kmh / 3.6,
            );
            time_s += leg.duration_s() + dwell_s;
            along_m = end_m;
            legs.push(leg);
        }
        Self {
            legs,
            duration_s: time_s,
            length_m,
        }
    }

    /// Returns the duration of the drive in seconds.
    pub const fn duration_s(&self) -> f64 {
        self.duration_s
    }

    /// Returns the position and speed at `time_s`. The vehicle stands before and after the drive.
    pub fn at(&self, time_s: f64) -> Motion {
        let index = self
            .legs
            .partition_point(|leg| leg.start_s <= time_s)
            .saturating_sub(1);
        let standing = Motion {
            along_m: self.length_m,
            speed_mps: 0.0,
        };
        self.legs
            .get(index)
            .map_or(standing, |leg| leg.motion(time_s))
    }
}

#[cfg(test)]
mod tests {
    use onboard::settings::{Shipped, TomlFile};

    use super::*;
    use crate::scenario::StopSettings;

    fn profile(settings: &MotionSettings, length_m: f64) -> MotionProfile {
        let vehicle = Vehicle::from_library("paper", &Shipped).unwrap();
        MotionProfile::new(settings, &vehicle, length_m)
    }

    #[test]
    fn trip_of_the_paper_takes_80_33_s() {
        let profile = profile(&MotionSettings::default(), 300.0);
        // 2·(v/a) + (300 − v²/a)/v with v = 25/6 m/s and a = 1/2 m/s².
        assert!((profile.duration_s() - 241.0 / 3.0).abs() < 1e-9);
        let middle = profile.at(0.5 * profile.duration_s());
        assert!((middle.along_m - 150.0).abs() < 1e-9);
        assert!((middle.speed_mps - 15.0 / 3.6).abs() < 1e-12);
        let end = profile.at(90.0);
        assert_eq!((end.along_m, end.speed_mps), (300.0, 0.0));
    }

    #[test]
    fn each_stop_adds_its_dwell_time_and_a_ramp() {
        let stops = vec![StopSettings {
            at_m: 100.0,
            dwell_s: 7.0,
            ..StopSettings::default()
        }];
        let profile = profile(
            &MotionSettings {
                stops,
                ..Default::default()
            },
            300.0,
        );
        let ramp_s = (15.0 / 3.6) / 0.5;
        assert!((profile.duration_s() - (241.0 / 3.0 + ramp_s + 7.0)).abs() < 1e-9);
        let standing = profile.at(100.0 / (15.0 / 3.6) + ramp_s + 3.0);
        assert!((standing.along_m - 100.0).abs() < 1e-9 && standing.speed_mps == 0.0);
    }

    #[test]
    fn stops_before_the_start_position_are_ignored() {
        let stop = |at_m| StopSettings {
            at_m,
            dwell_s: 5.0,
            ..StopSettings::default()
        };
        let begin = |start_at_m, stops| {
            let settings = MotionSettings {
                start_at_m,
                stops,
                ..Default::default()
            };
            profile(&settings, 300.0)
        };
        let profile = begin(120.0, vec![stop(80.0), stop(120.0), stop(200.0)]);
        assert_eq!(profile, begin(120.0, vec![stop(200.0)]));
        assert_eq!(profile.at(0.0).along_m, 120.0);
        assert_eq!(profile.at(profile.duration_s()).along_m, 300.0);
    }

    #[test]
    fn short_legs_do_not_reach_the_top_speed() {
        let profile = profile(&MotionSettings::default(), 2.0);
        assert!((profile.at(0.5 * profile.duration_s()).speed_mps - 1.0).abs() < 1e-12);
        assert!((profile.duration_s() - 4.0).abs() < 1e-12);
    }

    #[test]
    fn speed_is_the_derivative_of_position() {
        let stops = vec![StopSettings {
            at_m: 120.0,
            dwell_s: 2.0,
            ..StopSettings::default()
        }];
        let profile = profile(
            &MotionSettings {
                stops,
                ..Default::default()
            },
            300.0,
        );
        for step in 1..900 {
            let time_s = 0.1 * f64::from(step);
            let moved_m = profile.at(time_s + 1e-4).along_m - profile.at(time_s - 1e-4).along_m;
            assert!(
                (moved_m / 2e-4 - profile.at(time_s).speed_mps).abs() < 1e-3,
                "at {time_s} s"
            );
        }
    }
}
