//! True pose of the vehicle: on the road with lateral wander.

use onboard::geometry::Pose;
use onboard::road::{LaneKeeping, Road};
use rand::RngExt;
use rand_distr::StandardNormal;

use super::motion_profile::MotionProfile;
use crate::random::{Purpose, Streams};

/// Path of the vehicle along its road in one run.
#[derive(Debug, Clone)]
pub struct Path {
    road: Road,
    motion: MotionProfile,
    wander: Wander,
}

/// True state at one time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VehicleState {
    /// Time in seconds.
    pub time_s: f64,
    /// Distance along the road in metres.
    pub along_m: f64,
    /// Distance from the centre line in metres; left is positive.
    pub lateral_m: f64,
    /// Speed along the vehicle's own path in m/s.
    pub speed_mps: f64,
    /// Pose of the vehicle.
    pub pose: Pose,
}

impl Path {
    /// Draws the path of the run that `streams` belongs to.
    pub fn new(road: Road, motion: MotionProfile, keeping: LaneKeeping, streams: Streams) -> Self {
        let wander = Wander::new(keeping, road.length_m(), streams);
        Self {
            road,
            motion,
            wander,
        }
    }

    /// Returns the duration of the drive in seconds.
    pub const fn duration_s(&self) -> f64 {
        self.motion.duration_s()
    }

    /// Returns the true state at the reception of a signal with the time stamp `time_s`. The
    /// reception was `angle_time_offset_s` before the time stamp.
    pub fn at_reception(&self, time_s: f64, angle_time_offset_s: f64) -> VehicleState {
        VehicleState {
            time_s,
            ..self.at(time_s - angle_time_offset_s)
        }
    }

    /// Returns the true state at `time_s`.
    pub fn at(&self, time_s: f64) -> VehicleState {
        let motion = self.motion.at(time_s);
        let middle = self.road.pose(motion.along_m);
        let Some((lateral_m, slope)) = self.wander.at(motion.along_m) else {
            return VehicleState {
                time_s,
                along_m: motion.along_m,
                lateral_m: 0.0,
                speed_mps: motion.speed_mps,
                pose: middle,
            };
        };
        // At a lateral offset d in a bend of curvature κ, a metre of road corresponds to 1 − κd
        // metres.
        let stretch = 1.0 - self.road.curvature_per_m(motion.along_m) * lateral_m;
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

/// Distance between the knots of the wander in metres.
const KNOT_M: f64 = 0.5;

/// Lateral wander around the centre line: knots of the Gauss–Markov process of [`LaneKeeping`],
/// interpolated by cubics with equal offset and slope at the knots.
#[derive(Debug, Clone)]
struct Wander {
    /// Lateral offset in metres and slope at each knot, every [`KNOT_M`]; empty without wander.
    knots: Vec<[f64; 2]>,
}

impl Wander {
    fn new(keeping: LaneKeeping, length_m: f64, streams: Streams) -> Self {
        if keeping.rms_m == 0.0 {
            return Self { knots: Vec::new() };
        }
        let transition = keeping.transition(KNOT_M);
        let noise = keeping.noise(KNOT_M);
        // Cholesky factor of the process noise of one step.
        let slope_std = noise[1][1].sqrt();
        let shared = noise[0][1] / slope_std;
        let own = (noise[0][0] - shared * shared).max(0.0).sqrt();

        let mut rng = streams.generator(Purpose::Wander, 0);
        let mut normal = || rng.sample::<f64, _>(StandardNormal);
        let [offset_variance, slope_variance] = keeping.stationary();
        let first = [
            offset_variance.sqrt() * normal(),
            slope_variance.sqrt() * normal(),
        ];
        let count = (length_m / KNOT_M).ceil() as usize + 2;
        let knots = std::iter::successors(Some(first), |&[offset_m, slope]| {
            let (common, alone) = (normal(), normal());
            Some([
                transition[0][0] * offset_m
                    + transition[0][1] * slope
                    + shared * common
                    + own * alone,
                transition[1][0] * offset_m + transition[1][1] * slope + slope_std * common,
            ])
        });
        Self {
            knots: knots.take(count).collect(),
        }
    }

    /// Returns the lateral offset in metres and the slope; `None` without wander.
    fn at(&self, along_m: f64) -> Option<(f64, f64)> {
        let place = (along_m / KNOT_M).max(0.0);
        let index = (place as usize).min(self.knots.len().checked_sub(2)?);
        let [[p0, m0], [p1, m1]] = *self.knots.get(index..)?.first_chunk()?;
        let u = place - index as f64;
        // Cubic Hermite polynomial and derivative.
        let (h00, h10) = (
            (1.0 + 2.0 * u) * (1.0 - u) * (1.0 - u),
            u * (1.0 - u) * (1.0 - u),
        );
        let (h01, h11) = (u * u * (3.0 - 2.0 * u), u * u * (u - 1.0));
        let offset_m = h00 * p0 + h01 * p1 + KNOT_M * (h10 * m0 + h11 * m1);
        let slope = 6.0 * u * (1.0 - u) * (p1 - p0) / KNOT_M
            + (1.0 - u) * (1.0 - 3.0 * u) * m0
            + u * (3.0 * u - 2.0) * m1;
        Some((offset_m, slope))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use onboard::road::Segment;
    use onboard::settings::{Shipped, TomlFile, Vehicle};

    use crate::scenario::MotionSettings;

    fn wandering(run: u64) -> Path {
        let bend = [Segment {
            length_m: 300.0,
            turn_rad: 0.25,
            surveyed: true,
        }];
        let road = Road::from_segments(Pose::default(), &bend, 5.0).unwrap();
        let vehicle = Vehicle::from_library("paper-carrier", &Shipped).unwrap();
        let motion = MotionProfile::new(&MotionSettings::default(), &vehicle, road.length_m());
        let keeping = vehicle.lane_keeping.process();
        Path::new(road, motion, keeping, Streams::new(5, run))
    }

    #[test]
    fn wander_has_the_specified_rms() {
        let squares: f64 = (0..400)
            .map(|run| {
                let vehicle = wandering(run);
                (0..80)
                    .map(|t| vehicle.at(f64::from(t)).lateral_m.powi(2))
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
