//! Motion model: propagation of the state with the odometer distance.
//!
//! **With a map** (curvilinear coordinates). The vehicle follows its lane with the model
//! [`LaneKeeping`].
//!
//! **Without a map** (Cartesian). The curvature of the path is a first-order Gauss–Markov process
//! over the distance travelled; heading and position are its integrals.
//!
//! **Differential drive** (Cartesian). The heading follows the yaw rate, on the spot too, without a
//! prior of the path.
//!
//! The odometer noise is a random walk over distance in all of them.

use super::state::{
    ACROSS, ALONG, Belief, CURVATURE, HEADING, MOUNTING, PHASE, SCALE, STATES, YAW_RATE_BIAS,
    YAW_RATE_SCALE,
};
use crate::gaussian::{Matrix, identity};
use crate::geometry::Pose;
use crate::road::{Bending, LaneKeeping};

/// Curvature model of the path without a map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathBend {
    /// Stationary standard deviation of the curvature (1/m).
    pub curvature_per_m: f64,
    /// Correlation distance of the curvature (m).
    pub correlation_m: f64,
    /// Random walk of the heading due to steering (rad per √m), faster than any bend of the road.
    pub steering_rad_per_sqrt_m: f64,
}

/// Process noise of the motion.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MotionNoise {
    /// Random walk of the odometer over distance (m per √m).
    pub odometer_m_per_sqrt_m: f64,
    /// Random walk of the odometer over time, except at standstill (m per √s).
    pub odometer_m_per_sqrt_s: f64,
    /// Random walk of the odometer scale (1 per √m).
    pub scale_per_sqrt_m: f64,
    /// Random walk of the yaw rate bias (rad/s per √s).
    pub yaw_bias_radps_per_sqrt_s: f64,
    /// Random walk of the mounting angle (rad per √m).
    pub mounting_rad_per_sqrt_m: f64,
    /// Random walk of the phase offset (rad per √m).
    pub phase_rad_per_sqrt_m: f64,
}

/// Odometer measurement of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// Measured distance (m).
    pub read_m: f64,
    /// Distance by the speeds, which determines the noise (m).
    pub driven_m: f64,
}

impl Reading {
    /// Creates a measurement whose noise is that of its distance.
    pub const fn exact(read_m: f64) -> Self {
        Self {
            read_m,
            driven_m: read_m,
        }
    }

    /// Returns the measurement of a fraction of the step.
    #[must_use]
    pub fn share(&self, by: f64) -> Self {
        Self {
            read_m: self.read_m * by,
            driven_m: self.driven_m * by,
        }
    }
}

/// One step of the motion, linearised at its initial mean.
#[derive(Clone, Copy, Debug)]
pub struct Step {
    /// Mean after the step.
    pub mean: [f64; STATES],
    /// Jacobian of the step.
    pub jacobian: Matrix<STATES>,
    /// Covariance of the step's noise.
    pub noise: Matrix<STATES>,
    /// Heading change of the step (rad).
    pub turn_rad: f64,
    /// Derivative of the heading change with respect to the state before the step.
    pub turn_row: [f64; STATES],
    /// Covariance of the heading change with the noise of the step.
    pub turn_shared: [f64; STATES],
    /// Variance of the heading change due to the noise of the step (rad²).
    pub turn_variance: f64,
}

/// Gyroscope measurement of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Yaw {
    /// Yaw rate times duration (rad).
    pub turn_rad: f64,
    /// Duration (s).
    pub duration_s: f64,
    /// Variance of the measurement (rad²).
    pub variance: f64,
    /// Whether a sample measured the turn; otherwise it is a guess.
    pub is_measured: bool,
}

impl Step {
    /// Returns the step along a lane with the curvature of the road, for an odometer measurement. A
    /// heading with variance P reduces the distance along the lane: `E cos ψ = e^{−P/2} cos E ψ`.
    pub fn along_lane(
        start: &[f64; STATES],
        heading_variance: f64,
        reading: &Reading,
        road: &Bending,
        keeping: &LaneKeeping,
        walk: &MotionNoise,
    ) -> Self {
        let scale = 1.0 + start[SCALE];
        let (length, driven) = (reading.read_m / scale, reading.driven_m / scale);
        let kept = (-0.5 * heading_variance).exp();
        let (sin, cos) = start[HEADING].sin_cos();
        let (sin, cos) = (kept * sin, kept * cos);
        let curvature_per_m = road.mean_per_m;
        let stretch = 1.0 / (1.0 - curvature_per_m * start[ACROSS]);
        let phi = keeping.transition(driven);

        let mut f = identity();
        // The Jacobian uses the distance by the speeds: the noise of the odometer distance is part
        // of the residual with respect to the yaw rate, and must not change its weight.
        f[ALONG][ACROSS] = driven * cos * curvature_per_m * stretch * stretch;
        f[ALONG][HEADING] = -driven * sin * stretch;
        f[ALONG][SCALE] = -driven * cos * stretch / scale;
        f[ACROSS][ACROSS] = phi[0][0];
        f[ACROSS][HEADING] = phi[0][1];
        f[HEADING][ACROSS] = phi[1][0];
        f[HEADING][HEADING] = phi[1][1];

        let distance = driven.abs();
        let mut q = [[0.0; STATES]; STATES];
        q[ALONG][ALONG] = distance
            * (walk.odometer_m_per_sqrt_m.powi(2) + keeping.shortening_m2_per_m(heading_variance));
        let wander = keeping.noise(driven);
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
        turn_row[ALONG] = road.slope_per_m2 * driven * cos * stretch;
        // The heading of the road also changes over the distance that the odometer did not measure.
        let turn_shared = std::array::from_fn(|i| q[HEADING][i] + curvature_per_m * q[ALONG][i]);
        Self {
            turn_rad: curvature_per_m * (mean[ALONG] - start[ALONG]) + mean[HEADING]
                - start[HEADING],
            turn_variance: turn_shared[HEADING]
                + curvature_per_m * turn_shared[ALONG]
                + road.variance_rad2_per_m * distance,
            mean,
            jacobian: f,
            noise: q,
            turn_row,
            turn_shared,
        }
    }

    /// Returns the step in the plane, for an odometer measurement, in Cartesian coordinates or in
    /// those of a road with curvature κ that the vehicle does not follow. There
    /// `ds = dl cos ψ / (1 − κ d)`, `dd = dl sin ψ` and `dψ = c dl − κ ds`, for the curvature c of
    /// the path; κ = 0 is the Cartesian case.
    pub fn in_plane(
        start: &[f64; STATES],
        reading_m: f64,
        road_curvature_per_m: f64,
        bend: &PathBend,
        walk: &MotionNoise,
    ) -> Self {
        let scale = 1.0 + start[SCALE];
        let length = reading_m / scale;
        let kappa = road_curvature_per_m;
        let (sin_at_start, cos_at_start) = start[HEADING].sin_cos();
        // Midpoint rule: lateral offset, stretch of the road and heading at half the step, with
        // their derivatives by the state.
        let half_m = 0.5 * length;
        let mut offset_row = [0.0; STATES];
        offset_row[ACROSS] = 1.0;
        offset_row[HEADING] = half_m * cos_at_start;
        offset_row[SCALE] = -half_m * sin_at_start / scale;
        let stretch = 1.0 / (1.0 - kappa * (start[ACROSS] + half_m * sin_at_start));
        let stretch_row = offset_row.map(|by| kappa * stretch * stretch * by);
        let bending = start[CURVATURE] - kappa * stretch * cos_at_start;
        let (sin, cos) = (start[HEADING] + half_m * bending).sin_cos();
        let mut heading_row = stretch_row.map(|by| -half_m * kappa * cos_at_start * by);
        heading_row[HEADING] += 1.0 + half_m * kappa * stretch * sin_at_start;
        heading_row[CURVATURE] += half_m;
        heading_row[SCALE] -= half_m * bending / scale;
        let distance = length.abs();
        let kept = (-distance / bend.correlation_m).exp();

        let mut turn_row = [0.0; STATES];
        turn_row[CURVATURE] = length;
        turn_row[SCALE] = -start[CURVATURE] * length / scale;
        let mut f = identity();
        for i in 0..STATES {
            f[ALONG][i] += length * (cos * stretch_row[i] - stretch * sin * heading_row[i]);
            f[ACROSS][i] += length * cos * heading_row[i];
        }
        f[ALONG][SCALE] -= length * stretch * cos / scale;
        f[ACROSS][SCALE] -= length * sin / scale;
        for i in 0..STATES {
            f[HEADING][i] += turn_row[i] - kappa * f[ALONG][i];
        }
        f[HEADING][ALONG] = 0.0;
        f[CURVATURE][CURVATURE] = kept;

        let mut q = [[0.0; STATES]; STATES];
        // Noise of the curvature, and of the heading as its integral. A step is short relative to
        // the correlation distance and to the radius.
        let fresh = bend.curvature_per_m.powi(2) * (1.0 - kept * kept);
        q[CURVATURE][CURVATURE] = fresh;
        q[HEADING][CURVATURE] = fresh * length / 2.0;
        q[CURVATURE][HEADING] = fresh * length / 2.0;
        q[HEADING][HEADING] =
            fresh * length * length / 3.0 + bend.steering_rad_per_sqrt_m.powi(2) * distance;
        let mut turn_shared = q[HEADING];
        let mut turn_variance = q[HEADING][HEADING];
        // The distance error of the odometer has the direction and the curvature of the path.
        let spread = walk.odometer_m_per_sqrt_m.powi(2) * distance;
        let by_metre = [
            (ALONG, cos * stretch),
            (ACROSS, sin),
            (HEADING, start[CURVATURE] - kappa * cos * stretch),
        ];
        for (i, by) in by_metre {
            for (j, other) in by_metre {
                q[i][j] += spread * by * other;
            }
            turn_shared[i] += spread * by * start[CURVATURE];
        }
        turn_variance += spread * start[CURVATURE] * start[CURVATURE];
        slow_states(&mut q, walk, distance);

        let mut mean = *start;
        let ahead_m = length * cos * stretch;
        mean[ALONG] += ahead_m;
        mean[ACROSS] += length * sin;
        mean[HEADING] += start[CURVATURE] * length - kappa * ahead_m;
        mean[CURVATURE] *= kept;
        Self {
            turn_rad: start[CURVATURE] * length,
            mean,
            jacobian: f,
            noise: q,
            turn_row,
            turn_shared,
            turn_variance,
        }
    }

    /// Returns the step of a vehicle that turns with its measured yaw rate: `ψ⁺ = ψ + τ`,
    /// `p⁺ = p + l sinc(τ/2) (cos, sin)(ψ + τ/2)`, for the length l and the heading change
    /// `τ = (∫ yaw rate dt − b Δt) / (1 + κ)`, with the yaw rate bias b and the scale error κ.
    pub fn turning(start: &[f64; STATES], reading_m: f64, yaw: &Yaw, walk: &MotionNoise) -> Self {
        let scale = 1.0 + start[SCALE];
        let length = reading_m / scale;
        let yaw_scale = 1.0 + start[YAW_RATE_SCALE];
        let turn_rad = (yaw.turn_rad - start[YAW_RATE_BIAS] * yaw.duration_s) / yaw_scale;
        let before = Pose {
            x_m: start[ALONG],
            y_m: start[ACROSS],
            heading_rad: start[HEADING],
        };
        let after = before.along_chord(length, turn_rad);
        let step = [after.x_m - before.x_m, after.y_m - before.y_m];
        // A heading change rotates the chord by half that change; its effect on the chord's length
        // is of second order.
        let by_turn = [-0.5 * step[1], 0.5 * step[0]];

        let mut f = identity();
        f[ALONG][HEADING] = -step[1];
        f[ACROSS][HEADING] = step[0];
        f[ALONG][SCALE] = -step[0] / scale;
        f[ACROSS][SCALE] = -step[1] / scale;
        let turned = [by_turn[0], by_turn[1], 1.0];
        for (row, by_turn) in [ALONG, ACROSS, HEADING].into_iter().zip(turned) {
            f[row][YAW_RATE_BIAS] = -yaw.duration_s / yaw_scale * by_turn;
            f[row][YAW_RATE_SCALE] = -turn_rad / yaw_scale * by_turn;
        }

        let distance = length.abs();
        let mut q = [[0.0; STATES]; STATES];
        let spread = walk.odometer_m_per_sqrt_m.powi(2) * distance
            + walk.odometer_m_per_sqrt_s.powi(2) * yaw.duration_s;
        let (sin, cos) = (start[HEADING] + 0.5 * turn_rad).sin_cos();
        let along = [cos, sin, 0.0];
        for (i, row) in [ALONG, ACROSS, HEADING].into_iter().enumerate() {
            for (j, column) in [ALONG, ACROSS, HEADING].into_iter().enumerate() {
                q[row][column] =
                    spread * along[i] * along[j] + yaw.variance * turned[i] * turned[j];
            }
        }
        slow_states(&mut q, walk, distance);
        q[YAW_RATE_BIAS][YAW_RATE_BIAS] = walk.yaw_bias_radps_per_sqrt_s.powi(2) * yaw.duration_s;

        let mut mean = *start;
        mean[ALONG] = after.x_m;
        mean[ACROSS] = after.y_m;
        mean[HEADING] = after.heading_rad;
        mean[CURVATURE] = 0.0;
        Self {
            mean,
            jacobian: f,
            noise: q,
            turn_rad,
            ..Self::standing(start)
        }
    }

    /// Returns the step of a vehicle at standstill, without noise.
    pub fn standing(start: &[f64; STATES]) -> Self {
        Self {
            mean: *start,
            jacobian: identity(),
            noise: [[0.0; STATES]; STATES],
            turn_rad: 0.0,
            turn_row: [0.0; STATES],
            turn_shared: [0.0; STATES],
            turn_variance: 0.0,
        }
    }

    /// Applies the step to a state and its covariance.
    pub fn apply(&self, belief: &mut Belief) {
        belief.mean = self.mean;
        belief.spread(&self.jacobian, &self.noise);
    }

    /// Converts a measurement row after this step to the state before the step. Returns the row,
    /// and the additional variance due to the noise of the step.
    pub fn seen_before(&self, row: &[f64; STATES]) -> ([f64; STATES], f64) {
        let (mut before, mut variance) = ([0.0; STATES], 0.0);
        for i in 0..STATES {
            for j in 0..STATES {
                before[j] += row[i] * self.jacobian[i][j];
                variance += row[i] * self.noise[i][j] * row[j];
            }
        }
        (before, variance)
    }

    /// Returns the gyroscope measurement of the state `start` before this step: residual, row and
    /// variance.
    pub fn turn_seen(&self, start: &[f64; STATES], yaw: &Yaw) -> (f64, [f64; STATES], f64) {
        let mut row = self.turn_row;
        row[YAW_RATE_BIAS] = yaw.duration_s;
        let bias = start[YAW_RATE_BIAS] * yaw.duration_s;
        let variance = self.turn_variance + yaw.variance;
        (yaw.turn_rad - self.turn_rad - bias, row, variance)
    }

    /// Returns the step with its noise conditioned on a gyroscope measurement. Measurement and
    /// motion share the noise of the turn, so that it is decorrelated (Anderson & Moore, Optimal
    /// Filtering, 5.5).
    #[must_use]
    pub fn informed(mut self, start: &[f64; STATES], yaw: &Yaw) -> Self {
        let (surprise, row, total) = self.turn_seen(start, yaw);
        if total <= 0.0 {
            return self;
        }
        let shared = self.turn_shared;
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

#[cfg(test)]
mod tests {
    use super::*;

    const BEND: PathBend = PathBend {
        curvature_per_m: 0.01,
        correlation_m: f64::INFINITY,
        steering_rad_per_sqrt_m: 0.0,
    };

    /// Creates a state from along, across, heading relative to the road, curvature of the path, and
    /// odometer scale.
    fn state(values: [f64; 5]) -> [f64; STATES] {
        let mut state = [0.0; STATES];
        for (index, value) in [ALONG, ACROSS, HEADING, CURVATURE, SCALE]
            .into_iter()
            .zip(values)
        {
            state[index] = value;
        }
        state
    }

    fn step(start: &[f64; STATES], reading_m: f64, kappa: f64) -> Step {
        Step::in_plane(start, reading_m, kappa, &BEND, &MotionNoise::default())
    }

    #[test]
    fn a_path_does_not_depend_on_the_curvature_of_the_road() {
        let driven = Pose::default().offset_left(2.0);
        let end = driven.along_arc(30.0, 0.02);
        for kappa in [0.0, 0.05, -0.03] {
            let mut at = state([0.0, 2.0, 0.0, 0.02, 0.0]);
            for _ in 0..300 {
                at = step(&at, 0.1, kappa).mean;
            }
            let road = Pose::default().along_arc(at[ALONG], kappa);
            let found = road.offset_left(at[ACROSS]);
            let off_m = found.point().distance_m(end.point());
            assert!(off_m < 1e-3, "{kappa}: {off_m}");
            let heading_rad = road.heading_rad + at[HEADING];
            assert!((heading_rad - end.heading_rad).abs() < 1e-4, "{kappa}");
        }
    }

    #[test]
    fn the_jacobian_in_the_plane_is_the_derivative() {
        let start = state([5.0, 1.5, 0.2, 0.03, 0.01]);
        for kappa in [0.0, 0.04, -0.1] {
            let made = step(&start, 0.9, kappa);
            for state in [ALONG, ACROSS, HEADING, CURVATURE, SCALE] {
                let perturbed = |by: f64| {
                    let mut start = start;
                    start[state] += by;
                    step(&start, 0.9, kappa)
                };
                let (less, more) = (perturbed(-1e-6), perturbed(1e-6));
                let slope = |less: f64, more: f64| (more - less) / 2e-6;
                for row in 0..STATES {
                    let expected = slope(less.mean[row], more.mean[row]);
                    assert!(
                        (made.jacobian[row][state] - expected).abs() < 1e-8,
                        "{kappa}: {row} by {state}"
                    );
                }
                let expected = slope(less.turn_rad, more.turn_rad);
                assert!((made.turn_row[state] - expected).abs() < 1e-8);
            }
        }
    }

    #[test]
    fn the_jacobian_of_a_turn_is_the_derivative() {
        let mut start = state([5.0, 1.5, 0.2, 0.0, 0.01]);
        start[YAW_RATE_BIAS] = 0.02;
        let yaw = Yaw {
            turn_rad: 0.004,
            duration_s: 0.02,
            variance: 0.0,
            is_measured: true,
        };
        let step = |start: &[f64; STATES]| Step::turning(start, 0.1, &yaw, &MotionNoise::default());
        for state in [ALONG, ACROSS, HEADING, SCALE, YAW_RATE_BIAS] {
            let perturbed = |by: f64| {
                let mut start = start;
                start[state] += by;
                step(&start).mean
            };
            let (less, more) = (perturbed(-1e-5), perturbed(1e-5));
            for row in [ALONG, ACROSS, HEADING] {
                let slope = (more[row] - less[row]) / 2e-5;
                let found = step(&start).jacobian[row][state];
                assert!(
                    (found - slope).abs() < 1e-6,
                    "{row} by {state}: {found} {slope}"
                );
            }
        }
    }
}
