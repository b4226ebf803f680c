//! Record of one simulated run.

use onboard::geometry::Pose;
use onboard::localize::ekf::EstimatedConstants;
use onboard::localize::{Integrity, IntegrityState, RangeUpdate};
use onboard::monitor::ActiveFaults;
use onboard::{AngleResult, BurstResult, Pipeline};

use crate::error::SimulationError;

/// Truth and estimate at one SSB.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// Time in seconds.
    pub time_s: f64,
    /// True pose.
    pub truth: Pose,
    /// Estimated pose.
    pub estimate: Pose,
    /// Covariance of (x, y, heading); `None` if the localizer has none.
    pub covariance: Option<[[f64; 3]; 3]>,
    /// Protection level and state; `None` without integrity monitoring.
    pub integrity: Option<Integrity>,
    /// Whether the localizer is still searching for the first pose.
    pub searching: bool,
    /// SNR of the strongest radio head from link budget and shadowing, in dB.
    pub snr_db: f64,
    /// Active faults of odometry and receive channels.
    pub faults: ActiveFaults,
}

impl Step {
    /// Returns estimate minus truth in x and y in metres; NaN until the first pose is found.
    pub fn error_xy_m(&self) -> [f32; 2] {
        if self.searching {
            return [f32::NAN; 2];
        }
        let (estimate, truth) = (self.estimate, self.truth);
        [estimate.x_m - truth.x_m, estimate.y_m - truth.y_m].map(|error_m| error_m as f32)
    }

    /// Returns the protection level in metres; `None` unless the state is `ok` and the first pose
    /// is found.
    pub fn level_while_ok_m(&self) -> Option<f32> {
        let is_valid = |it: &Integrity| it.state == IntegrityState::Ok && !self.searching;
        let level_m = self.integrity.filter(is_valid);
        level_m.map(|it| it.protection_level_m as f32)
    }

    /// Returns the horizontal error in metres.
    pub fn error_m(&self) -> f64 {
        self.truth.point().distance_m(self.estimate.point())
    }

    /// Returns the sum of the variances of x and y in m²; `None` without a covariance.
    pub fn predicted_m2(&self) -> Option<f64> {
        let [[xx, ..], [_, yy, _], _] = self.covariance?;
        Some(xx + yy)
    }

    /// Returns the squared position error normalised by its covariance (NEES); `None` without a
    /// covariance or with a singular one.
    pub fn nees(&self) -> Option<f64> {
        let [[xx, xy, _], [_, yy, _], _] = self.covariance?;
        let (dx, dy) = (
            self.estimate.x_m - self.truth.x_m,
            self.estimate.y_m - self.truth.y_m,
        );
        let determinant = xx * yy - xy * xy;
        let nees = (yy * dx * dx - 2.0 * xy * dx * dy + xx * dy * dy) / determinant;
        (determinant > 0.0).then_some(nees)
    }
}

/// Record of one run.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RunRecord {
    /// Number of the run.
    pub run: u64,
    /// One step per SSB.
    pub steps: Vec<Step>,
    /// Angle estimates.
    pub aoa_estimates: Vec<AngleResult>,
    /// Number of SSB bursts received.
    pub bursts_received: usize,
    /// Number of measured delays, range rates and carrier phases of received SSBs.
    pub ranges: usize,
    /// Number of delays, range rates and carrier phases that the localizer accepted.
    pub accepted_ranges: usize,
    /// Estimated constants of the vehicle at the end of the run; `None` if the localizer estimates
    /// none.
    pub constants: Option<EstimatedConstants>,
    /// Number of SSBs at which no selection of angles could meet the target error of an
    /// uncertainty-driven wake-up policy.
    pub out_of_reach: usize,
}

/// First initialised pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Found {
    /// First step with a known pose.
    pub step: Step,
    /// Distance driven until this step, in metres.
    pub driven_m: f64,
}

impl RunRecord {
    /// Returns an empty record of run `run` in the memory of this record.
    pub(crate) fn restarted(mut self, run: u64, steps: usize) -> Self {
        self.steps.clear();
        self.steps.reserve(steps);
        self.aoa_estimates.clear();
        self.aoa_estimates.reserve(steps);
        Self {
            run,
            steps: self.steps,
            aoa_estimates: self.aoa_estimates,
            ..Self::default()
        }
    }

    /// Adds the results of a burst.
    pub(crate) fn add(&mut self, result: &BurstResult<'_>) {
        self.bursts_received += usize::from(result.receiver_on);
        self.aoa_estimates.extend_from_slice(result.aoa_estimates);
        self.out_of_reach += usize::from(result.keeps_bound == Some(false));
    }

    /// Adds the delays, range rates and carrier phases of a burst.
    pub(crate) fn add_ranges(&mut self, ranges: &[RangeUpdate]) {
        self.ranges += ranges.len();
        self.accepted_ranges += ranges.iter().filter(|it| it.verdict.accepted).count();
    }

    /// Adds the true and estimated poses at an SSB.
    pub(crate) fn add_step(
        &mut self,
        onboard: &Pipeline,
        time_s: f64,
        truth: Pose,
        snr_db: f64,
    ) -> Result<(), SimulationError> {
        let nominal = onboard.pose(time_s).map_err(SimulationError::Custom)?;
        self.steps.push(Step {
            time_s,
            truth,
            estimate: nominal.pose,
            covariance: nominal.covariance,
            integrity: nominal.integrity,
            searching: onboard.searching().is_some(),
            snr_db,
            faults: *onboard.faults(),
        });
        Ok(())
    }

    /// Returns the first initialised pose: the first step, unless the localizer had to search for
    /// it. Returns `None` if it was not found.
    pub fn found(&self) -> Option<Found> {
        let first = self.steps.iter().position(|step| !step.searching)?;
        let until = self.steps.get(..=first)?;
        let driven_m = |pair: &[Step]| match pair {
            [from, to] => from.truth.point().distance_m(to.truth.point()),
            _ => 0.0,
        };
        Some(Found {
            step: *until.last()?,
            driven_m: until.windows(2).map(driven_m).sum(),
        })
    }
}
