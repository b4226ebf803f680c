//! Outputs of the filter: pose in the map frame at any time, predicted covariances with future
//! angles, and smoothed poses.

use super::angle_model::{AngleModel, locate};
use super::filter::Ekf;
use super::motion::{Reading, Step};
use super::predict::MAX_STEPS;
use super::state::{Belief, SCALE, STATES};
use crate::gaussian::smoother::Journal;
use crate::gaussian::{
    Innovation, Matrix, dot, identity, principal_variances, product, transformed,
};
use crate::localize::output::PoseEstimate;
use crate::observation::AngleMeasurement;
use crate::radio_head::RadioHead;

/// Maximum step of a forecast (m), for which millimetres are irrelevant.
const FORECAST_STEP_M: f64 = 5.0;

/// Innovation of an angle that is not used.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::localize) struct ExcludedInnovation {
    /// Innovation; the angle's variance contains its noise only, because biases are part of the
    /// state.
    pub innovation: Innovation,
    /// Variance of the noise for a first angle of the radio head (rad²).
    pub first_variance: f64,
    /// Distance driven, in wavelengths.
    pub place_wavelengths: f64,
}

/// Propagation of a covariance without measurements, `Φ P Φᵀ + Q`.
#[derive(Clone, Debug)]
pub struct Transition {
    jacobian: Matrix<STATES>,
    noise: Matrix<STATES>,
}

impl Transition {
    /// Returns the variances of the predicted horizontal error along its principal axes, larger
    /// first (m²).
    pub fn principal_variances(&self, belief: &Belief) -> [f64; 2] {
        let [first, second] = [self.jacobian[0], self.jacobian[1]];
        let with_second = belief.cross(&second);
        principal_variances(
            belief.variance_along(&first) + self.noise[0][0],
            dot(&first, &with_second) + self.noise[0][1],
            dot(&second, &with_second) + self.noise[1][1],
        )
    }
}

/// Returns the number of steps of a forecast over an odometer distance, and the reading of each.
fn forecast_steps(reading_m: f64) -> (usize, Reading) {
    let steps = (reading_m.abs() / FORECAST_STEP_M).ceil().min(MAX_STEPS);
    (steps as usize, Reading::exact(reading_m / steps))
}

impl Ekf {
    /// Returns the innovation of an angle to an excluded radio head, for a filter without estimated biases; it counts as
    /// an update.
    pub(in crate::localize) fn innovation_of_excluded(
        &mut self,
        head: &RadioHead,
        measured: &AngleMeasurement,
    ) -> Option<ExcludedInnovation> {
        let predicted = self.predict_measurement(head, measured).ok()?;
        self.heads.get_mut(predicted.head)?.last_update_m = predicted.place_m;
        let Innovation {
            residual,
            variance,
            measurement_variance,
        } = predicted.innovation;
        let (sigma, (travelled_m, _)) = (predicted.own_variance.sqrt(), predicted.moved);
        let (aperture, direction_cosine) = (predicted.aperture, predicted.direction_cosine);
        let noise = self
            .correlated_noise()
            .variance(sigma, predicted.elapsed_s, predicted.moved)
            + (self.config).scatter_variance(travelled_m, aperture, direction_cosine);
        // An error that is common to many angles counts once.
        let lasting = predicted.systematic_variance();
        Some(ExcludedInnovation {
            innovation: Innovation {
                residual,
                variance: variance - measurement_variance + lasting + noise,
                measurement_variance: noise,
            },
            first_variance: self.first_variance(&predicted),
            place_wavelengths: predicted.place_m / self.config.array.wavelength_m,
        })
    }

    /// Returns the predicted state at `time_s`, with constant speed and without measurements.
    pub fn forecast(&self, time_s: f64) -> Belief {
        self.carry(self.belief, self.reading_until_m(time_s))
    }

    /// Returns the odometer distance from the newest odometry until `time_s`, with constant speed.
    fn reading_until_m(&self, time_s: f64) -> f64 {
        let lag_s = (time_s - self.time_s()).max(0.0);
        let speed_mps = self.odometry.map_or(0.0, |sample| sample.speed_mps);
        if speed_mps == 0.0 {
            return 0.0;
        }
        speed_mps * lag_s
    }

    /// Returns the variances of the horizontal error of [`forecast`](Self::forecast) along its principal axes, larger first
    /// (m²).
    pub fn forecast_variances(&self, time_s: f64) -> [f64; 2] {
        let (steps, reading) = forecast_steps(self.reading_until_m(time_s));
        if steps == 0 {
            return Self::principal_variances(&self.belief);
        }
        let mut belief = self.belief;
        for _ in 1..steps {
            self.step(&belief, &reading).apply(&mut belief);
        }
        let step = self.step(&belief, &reading);
        let [[xx, xy], [_, yy]] = belief.spread_first(&step.jacobian, &step.noise);
        principal_variances(xx, xy, yy)
    }

    /// Returns a state predicted over an odometer distance without measurements.
    pub fn carry(&self, mut belief: Belief, reading_m: f64) -> Belief {
        let (steps, reading) = forecast_steps(reading_m);
        for _ in 0..steps {
            self.step(&belief, &reading).apply(&mut belief);
        }
        belief
    }

    /// Returns the propagation of covariances over an odometer distance, linearised at a state.
    pub fn transition(&self, belief: &Belief, reading_m: f64) -> Transition {
        let (steps, reading) = forecast_steps(reading_m);
        if steps == 0 {
            return Transition {
                jacobian: identity(),
                noise: [[0.0; STATES]; STATES],
            };
        }
        let mut step = self.step(belief, &reading);
        let (mut belief, mut jacobian) = (*belief, step.jacobian);
        let mut noise = Belief {
            mean: belief.mean,
            covariance: step.noise,
        };
        for _ in 1..steps {
            step.apply(&mut belief);
            step = self.step(&belief, &reading);
            step.apply(&mut noise);
            jacobian = product(&step.jacobian, &jacobian);
        }
        Transition {
            jacobian,
            noise: noise.covariance,
        }
    }

    /// Returns the state after an angle with the thermal variance `thermal(distance)` to `head`, at
    /// a state `ahead_m` after the newest odometry; `None` if the radio head is not used, or its
    /// angle would repeat the previous one.
    pub fn predicted_update(
        &self,
        belief: &Belief,
        ahead_m: f64,
        head: &RadioHead,
        thermal: impl Fn(f64) -> f64,
    ) -> Option<Belief> {
        let (number, known) = (self.heads.iter().enumerate()).find(|(_, mine)| mine.is(head))?;
        if known.excluded {
            return None;
        }
        let (pose, frame) = locate(&belief.mean, 0.0, self.map.as_deref());
        let array = &self.config.array;
        let (kind, head) = (known.kind, &known.known);
        let angle_model = AngleModel::of_kind(kind, head, pose, &frame, &belief.mean, array)?;
        let travelled_m = self.driven_m + ahead_m - known.last_update_m;
        let own = (self.config.noise_scale() * thermal(angle_model.range_m)).sqrt();
        let variance = self
            .correlated_noise()
            .variance(own, f64::INFINITY, (travelled_m, 0.0))
            + self.config.shared_variance(travelled_m, &angle_model);
        // The biases are correlated with the state of the filter, not with that after other angles.
        let bias = &self.bias;
        let (row, dependence) = (&angle_model.row, self.dependence(travelled_m));
        let variance = bias.equivalent_variance(&self.belief, number, &dependence, row, variance);
        if !variance.is_finite() {
            return None;
        }
        let mut updated = *belief;
        updated.update(0.0, &angle_model.row, variance);
        Some(updated)
    }

    /// Returns the variances of a state's horizontal error along its principal axes, larger first
    /// (m²).
    pub fn principal_variances(belief: &Belief) -> [f64; 2] {
        let [[aa, ab, ..], [_, bb, ..], ..] = belief.covariance;
        principal_variances(aa, ab, bb)
    }
}

/// Minimum variance of the reported covariance, of a nanometre and a nanoradian, for states with an
/// exact start.
const MIN_VARIANCE: f64 = 1e-18;

impl Ekf {
    /// Returns the pose at `time_s`, extrapolated from the newest odometry with its speed.
    pub fn pose(&self, time_s: f64) -> PoseEstimate {
        let (_, lag_variance) = self.coasting(time_s);
        self.pose_of(&self.forecast(time_s), time_s, lag_variance)
    }

    /// Returns the distance driven since the newest odometry, and its variance.
    pub(super) fn coasting(&self, time_s: f64) -> (f64, f64) {
        let Some(sample) = self.odometry else {
            return (0.0, 0.0);
        };
        let lag_s = (time_s - sample.time_s).max(0.0);
        (
            self.speed_mps() * lag_s,
            self.config.coasting_variance(lag_s),
        )
    }

    /// Returns the distance driven since the newest odometry, its variance, and the step over this
    /// distance unless it is zero.
    #[inline]
    pub(super) fn coast(&self, time_s: f64) -> (f64, f64, Option<Step>) {
        let (ahead_m, variance) = self.coasting(time_s);
        let step = (ahead_m != 0.0)
            .then(|| Reading::exact(ahead_m * (1.0 + self.belief.mean[SCALE])))
            .map(|reading| self.step(&self.belief, &reading));
        (ahead_m, variance, step)
    }

    /// Returns the speed along the heading (m/s).
    pub fn speed_mps(&self) -> f64 {
        let reading = self.odometry.map_or(0.0, |sample| sample.speed_mps);
        reading / (1.0 + self.belief.mean[SCALE])
    }

    /// Returns the pose of a state with an additional variance along its path.
    pub(super) fn pose_of(&self, belief: &Belief, time_s: f64, lag_variance: f64) -> PoseEstimate {
        let map = self.map.as_deref();
        let (pose, frame) = locate(&belief.mean, 0.0, map);
        let (sin, cos) = frame.direction_rad.sin_cos();
        // (x, y, heading) by (along, across, heading).
        let jacobian = [
            [cos * frame.stretch, -sin, 0.0],
            [sin * frame.stretch, cos, 0.0],
            [frame.curvature_per_m, 0.0, 1.0],
        ];
        let mut inner = [[0.0; 3]; 3];
        for i in 0..3 {
            for j in 0..3 {
                inner[i][j] = belief.covariance[i][j];
            }
        }
        inner[0][0] += lag_variance;
        let mut covariance = transformed(&jacobian, &inner);
        for i in 0..3 {
            covariance[i][i] += MIN_VARIANCE;
        }
        PoseEstimate {
            time_s,
            pose,
            covariance: Some(covariance),
            integrity: None,
        }
    }
}

impl Ekf {
    /// Keeps a journal for smoothing from now on, which grows by about 2 kB per odometry sample.
    pub fn keep_journal(&mut self) {
        self.journal.get_or_insert_default();
    }

    /// Returns the smoothed poses at the odometry samples since the start of the journal; empty
    /// without a journal.
    pub fn smoothed(&self) -> Vec<PoseEstimate> {
        let journal = self.journal.iter();
        let beliefs = journal.flat_map(Journal::smoothed);
        beliefs
            .map(|(time_s, belief)| self.pose_of(&belief, time_s, 0.0))
            .collect()
    }

    pub(super) fn record_output(&mut self, time_s: f64) {
        if let Some(journal) = &mut self.journal {
            journal.output(time_s, &self.belief, self.bias.state_covariance());
        }
    }
}
