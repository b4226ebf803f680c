//! How the state moves with the distance the odometer reads.
//!
//! **With a map** (curvilinear coordinates). The vehicle follows its lane as [`LaneKeeping`] says.
//!
//! **Without a map** (Cartesian). The curvature of the path is a first-order Gauss–Markov process
//! over the distance travelled; heading and position are its integrals.
//!
//! Noise in the odometer is a random walk over distance in both.

use super::state::{
    ACROSS, ALONG, Belief, CURVATURE, HEADING, MOUNTING, PHASE, SCALE, STATES, YAW_RATE_BIAS,
};
use crate::localize::gaussian::{Matrix, identity};
use crate::world::LaneKeeping;

/// How the path bends where no map tells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathBend {
    /// Stationary deviation of the curvature (1/m).
    pub curvature_per_m: f64,
    /// Distance over which the curvature is forgotten (m).
    pub correlation_m: f64,
    /// Random walk of the heading by steering (rad per √m), quicker than any bend of the road.
    pub steering_rad_per_sqrt_m: f64,
}

/// Noise of the motion that the odometer does not see or gets wrong.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MotionNoise {
    /// Random walk of the odometer (m per √m).
    pub odometer_m_per_sqrt_m: f64,
    /// Random walk of the odometer's scale (1 per √m).
    pub scale_per_sqrt_m: f64,
    /// Random walk of the mounting angle (rad per √m).
    pub mounting_rad_per_sqrt_m: f64,
    /// Random walk of the phase offset (rad per √m).
    pub phase_rad_per_sqrt_m: f64,
}

/// One step of the motion, linearised at the mean it starts from.
#[derive(Clone, Copy, Debug)]
pub struct Step {
    /// Mean after the step.
    pub mean: [f64; STATES],
    /// Jacobian of the step.
    pub jacobian: Matrix<STATES>,
    /// Covariance of what the step adds.
    pub noise: Matrix<STATES>,
    /// By how much the vehicle turns (rad) ...
    pub turn_rad: f64,
    /// ... and how that depends on the state before the step.
    pub turn_row: [f64; STATES],
}

/// What a gyroscope read during a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Yaw {
    /// Yaw rate times duration (rad).
    pub turn_rad: f64,
    /// Duration (s).
    pub duration_s: f64,
    /// Variance of the reading (rad²).
    pub variance: f64,
}

impl Step {
    /// The step along a lane of the given curvature, for what the odometer read.
    pub fn along_lane(
        start: &[f64; STATES],
        reading_m: f64,
        curvature_per_m: f64,
        keeping: &LaneKeeping,
        walk: &MotionNoise,
    ) -> Self {
        let scale = 1.0 + start[SCALE];
        let length = reading_m / scale;
        let (sin, cos) = start[HEADING].sin_cos();
        let stretch = 1.0 / (1.0 - curvature_per_m * start[ACROSS]);
        let phi = keeping.transition(length);

        let mut f = identity();
        f[ALONG][ACROSS] = length * cos * curvature_per_m * stretch * stretch;
        f[ALONG][HEADING] = -length * sin * stretch;
        f[ALONG][SCALE] = -length * cos * stretch / scale;
        f[ACROSS][ACROSS] = phi[0][0];
        f[ACROSS][HEADING] = phi[0][1];
        f[HEADING][ACROSS] = phi[1][0];
        f[HEADING][HEADING] = phi[1][1];

        let distance = length.abs();
        let mut q = [[0.0; STATES]; STATES];
        q[ALONG][ALONG] = walk.odometer_m_per_sqrt_m.powi(2) * distance;
        let wander = keeping.noise(&phi);
        for i in 0..2 {
            for j in 0..2 {
                q[ACROSS + i][ACROSS + j] = wander[i][j];
            }
        }
        slow_states(&mut q, walk, distance);

        let mut mean = *start;
        mean[ALONG] += length * cos * stretch;
        mean[ACROSS] = phi[0][0] * start[ACROSS] + phi[0][1] * start[HEADING];
        mean[HEADING] = phi[1][0] * start[ACROSS] + phi[1][1] * start[HEADING];
        let mut turn_row = [0.0; STATES];
        for i in 0..STATES {
            turn_row[i] = f[HEADING][i] + curvature_per_m * f[ALONG][i];
        }
        turn_row[HEADING] -= 1.0;
        turn_row[ALONG] = 0.0;
        Self {
            turn_rad: curvature_per_m * (mean[ALONG] - start[ALONG]) + mean[HEADING]
                - start[HEADING],
            mean,
            jacobian: f,
            noise: q,
            turn_row,
        }
    }

    /// The step in the plane, for what the odometer read.
    pub fn in_plane(
        start: &[f64; STATES],
        reading_m: f64,
        bend: &PathBend,
        walk: &MotionNoise,
    ) -> Self {
        let scale = 1.0 + start[SCALE];
        let length = reading_m / scale;
        let (sin, cos) = (start[HEADING] + 0.5 * start[CURVATURE] * length).sin_cos();
        let distance = length.abs();
        let kept = (-distance / bend.correlation_m).exp();

        let mut f = identity();
        f[ALONG][HEADING] = -length * sin;
        f[ALONG][CURVATURE] = -0.5 * length * length * sin;
        f[ALONG][SCALE] = -length * cos / scale;
        f[ACROSS][HEADING] = length * cos;
        f[ACROSS][CURVATURE] = 0.5 * length * length * cos;
        f[ACROSS][SCALE] = -length * sin / scale;
        f[HEADING][CURVATURE] = length;
        f[HEADING][SCALE] = -start[CURVATURE] * length / scale;
        f[CURVATURE][CURVATURE] = kept;

        let mut q = [[0.0; STATES]; STATES];
        let spread = walk.odometer_m_per_sqrt_m.powi(2) * distance;
        q[ALONG][ALONG] = spread * cos * cos;
        q[ALONG][ACROSS] = spread * cos * sin;
        q[ACROSS][ALONG] = spread * cos * sin;
        q[ACROSS][ACROSS] = spread * sin * sin;
        // Curvature noise and its integral, the heading (a step is short against both).
        let bending = bend.curvature_per_m.powi(2) * (1.0 - kept * kept);
        q[CURVATURE][CURVATURE] = bending;
        q[HEADING][CURVATURE] = bending * length / 2.0;
        q[CURVATURE][HEADING] = bending * length / 2.0;
        q[HEADING][HEADING] =
            bending * length * length / 3.0 + bend.steering_rad_per_sqrt_m.powi(2) * distance;
        slow_states(&mut q, walk, distance);

        let mut mean = *start;
        mean[ALONG] += length * cos;
        mean[ACROSS] += length * sin;
        mean[HEADING] += start[CURVATURE] * length;
        mean[CURVATURE] *= kept;
        let mut turn_row = f[HEADING];
        turn_row[HEADING] -= 1.0;
        Self {
            turn_rad: start[CURVATURE] * length,
            mean,
            jacobian: f,
            noise: q,
            turn_row,
        }
    }

    /// Moves a belief by this step.
    pub fn apply(&self, belief: &mut Belief) {
        belief.mean = self.mean;
        belief.spread(&self.jacobian, &self.noise);
    }

    /// What a gyroscope says of the state `start` before this step: residual, row and variance.
    pub fn turn_seen(&self, start: &[f64; STATES], yaw: &Yaw) -> (f64, [f64; STATES], f64) {
        let mut row = self.turn_row;
        row[YAW_RATE_BIAS] = yaw.duration_s;
        let bias = start[YAW_RATE_BIAS] * yaw.duration_s;
        let variance = self.noise[HEADING][HEADING] + yaw.variance;
        (yaw.turn_rad - self.turn_rad - bias, row, variance)
    }

    /// This step, its noise known in part from a gyroscope: measurement and motion share the
    /// noise of the heading, so it is decorrelated (Anderson & Moore, Optimal Filtering, 5.5).
    pub fn informed(mut self, start: &[f64; STATES], yaw: &Yaw) -> Self {
        let total = self.noise[HEADING][HEADING] + yaw.variance;
        if total <= 0.0 {
            return self;
        }
        let shared = self.noise[HEADING];
        let mut row = self.turn_row;
        row[YAW_RATE_BIAS] = yaw.duration_s;
        let surprise = yaw.turn_rad - self.turn_rad - start[YAW_RATE_BIAS] * yaw.duration_s;
        for i in 0..STATES {
            let gain = shared[i] / total;
            self.mean[i] += gain * surprise;
            for j in 0..STATES {
                self.jacobian[i][j] -= gain * row[j];
                self.noise[i][j] -= gain * shared[j];
            }
        }
        self
    }
}

fn slow_states(q: &mut Matrix<STATES>, noise: &MotionNoise, distance_m: f64) {
    q[SCALE][SCALE] = noise.scale_per_sqrt_m.powi(2) * distance_m;
    q[MOUNTING][MOUNTING] = noise.mounting_rad_per_sqrt_m.powi(2) * distance_m;
    q[PHASE][PHASE] = noise.phase_rad_per_sqrt_m.powi(2) * distance_m;
}
