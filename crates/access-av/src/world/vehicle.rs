//! The vehicle's true pose: on the road, but for its lateral wander.

use std::f64::consts::{SQRT_2, TAU};

use rand::RngExt;

use super::{MotionProfile, Track};
use crate::geometry::Pose;
use crate::random::{Purpose, Streams};
use crate::scenario::{MotionSettings, WanderSettings};

/// The vehicle on its road, in one run.
#[derive(Debug, Clone)]
pub struct Vehicle {
    track: Track,
    motion: MotionProfile,
    wander: Wander,
}

/// The truth at one instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VehicleState {
    /// Time in seconds.
    pub time_s: f64,
    /// Distance along the road in metres.
    pub along_m: f64,
    /// Distance from its middle in metres; left is positive.
    pub lateral_m: f64,
    /// Speed of the vehicle along its own path in m/s.
    pub speed_mps: f64,
    /// Its pose.
    pub pose: Pose,
}

impl Vehicle {
    /// The vehicle of the run that `streams` belongs to.
    pub fn new(track: Track, settings: &MotionSettings, streams: Streams) -> Self {
        let motion = MotionProfile::new(settings, track.length_m());
        Self {
            track,
            motion,
            wander: Wander::new(settings.lateral_wander, streams),
        }
    }

    /// Duration of the drive in seconds.
    pub const fn duration_s(&self) -> f64 {
        self.motion.duration_s()
    }

    /// The truth at `time_s`.
    pub fn at(&self, time_s: f64) -> VehicleState {
        let motion = self.motion.at(time_s);
        let middle = self.track.pose(motion.along_m);
        if self.wander.amplitude_m == 0.0 {
            return VehicleState {
                time_s,
                along_m: motion.along_m,
                lateral_m: 0.0,
                speed_mps: motion.speed_mps,
                pose: middle,
            };
        }
        let (lateral_m, slope) = self.wander.at(motion.along_m);
        // Beside the middle of a bend, a metre of road is 1 − κd metres long.
        let stretch = 1.0 - self.track.curvature_per_m(motion.along_m) * lateral_m;
        let mut pose = middle.offset_left(lateral_m);
        pose.heading_rad += slope.atan2(stretch);
        VehicleState {
            time_s,
            along_m: motion.along_m,
            lateral_m,
            speed_mps: motion.speed_mps * stretch.hypot(slope),
            pose,
        }
    }
}

/// A sum of sinusoids around one wavelength.
#[derive(Debug, Clone, Copy)]
struct Wander {
    amplitude_m: f64,
    waves: [Wave; 4],
}

#[derive(Debug, Clone, Copy, Default)]
struct Wave {
    per_m: f64,
    phase_rad: f64,
}

impl Wander {
    fn new(settings: WanderSettings, streams: Streams) -> Self {
        let mut rng = streams.generator(Purpose::Wander, 0);
        let mut waves = [Wave::default(); 4];
        for (wave, relative) in waves.iter_mut().zip([0.8, 0.93, 1.08, 1.25]) {
            wave.per_m = TAU / (relative * settings.wavelength_m);
            wave.phase_rad = rng.random::<f64>() * TAU;
        }
        // Four independent sinusoids of amplitude A have a mean square of 4·A²/2.
        Self {
            amplitude_m: settings.rms_m / SQRT_2,
            waves,
        }
    }

    /// Offset in metres and its slope.
    fn at(&self, along_m: f64) -> (f64, f64) {
        self.waves
            .iter()
            .fold((0.0, 0.0), |(offset_m, slope), wave| {
                let (sin, cos) = (wave.per_m * along_m + wave.phase_rad).sin_cos();
                (
                    offset_m + self.amplitude_m * sin,
                    slope + self.amplitude_m * wave.per_m * cos,
                )
            })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::Segment;

    fn wandering(run: u64) -> Vehicle {
        let bend = [Segment {
            length_m: 300.0,
            turn_rad: 0.25,
        }];
        let track = Track::from_segments(Pose::default(), &bend, 5.0).unwrap();
        let lateral_wander = WanderSettings {
            rms_m: 0.1,
            wavelength_m: 60.0,
        };
        let settings = MotionSettings {
            lateral_wander,
            ..Default::default()
        };
        Vehicle::new(track, &settings, Streams::new(5, run))
    }

    #[test]
    fn wander_has_its_rms() {
        let squares: f64 = (0..400)
            .map(|run| {
                (0..80)
                    .map(|t| wandering(run).at(f64::from(t)).lateral_m.powi(2))
                    .sum::<f64>()
            })
            .sum();
        let rms_m = (squares / (400.0 * 80.0)).sqrt();
        assert!((rms_m - 0.1).abs() < 0.005, "{rms_m}");
    }

    #[test]
    fn heading_and_speed_follow_the_wandering_path() {
        let vehicle = wandering(1);
        for time_s in [5.0, 20.0, 43.0, 77.0] {
            let (before, now, after) = (
                vehicle.at(time_s - 1e-4),
                vehicle.at(time_s),
                vehicle.at(time_s + 1e-4),
            );
            let direction_rad = before.pose.point().bearing_rad(after.pose.point());
            assert!((direction_rad - now.pose.heading_rad).abs() < 1e-6);
            let speed_mps = before.pose.point().distance_m(after.pose.point()) / 2e-4;
            assert!((speed_mps - now.speed_mps).abs() < 1e-5);
        }
    }
}
