//! What happened in one simulated drive.

use onboard::geometry::Pose;
use onboard::localize::ekf::EstimatedConstants;
use onboard::localize::{Integrity, IntegrityState};
use onboard::monitor::ActiveFaults;
use onboard::{Execution, Heard, Onboard};

use crate::error::SimulationError;

/// Truth and estimate at one SSB.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// Time in seconds.
    pub time_s: f64,
    /// Where the vehicle is.
    pub truth: Pose,
    /// Where it believes to be.
    pub estimate: Pose,
    /// Covariance of (x, y, heading), where the localizer has one.
    pub covariance: Option<[[f64; 3]; 3]>,
    /// Protection level and state, where the localizer is guarded.
    pub integrity: Option<Integrity>,
    /// Whether it is still in search of its first pose.
    pub searching: bool,
    /// SNR of the strongest radio head by link budget and shadowing, in dB.
    pub snr_db: f64,
    /// Active faults of odometry and receive channels.
    pub faults: ActiveFaults,
}

impl Step {
    /// Estimate minus truth in x and in y, in metres; NaN as long as the first pose is not known.
    pub fn error_xy_m(&self) -> [f32; 2] {
        if self.searching {
            return [f32::NAN; 2];
        }
        let (estimate, truth) = (self.estimate, self.truth);
        [estimate.x_m - truth.x_m, estimate.y_m - truth.y_m].map(|error_m| error_m as f32)
    }

    /// Protection level in metres; `None` where the pose may not be relied on.
    pub fn level_while_ok_m(&self) -> Option<f32> {
        let relied_on = |it: &Integrity| it.state == IntegrityState::Ok && !self.searching;
        let level_m = self.integrity.filter(relied_on);
        level_m.map(|it| it.protection_level_m as f32)
    }

    /// Horizontal error in metres.
    pub fn error_m(&self) -> f64 {
        self.truth.point().distance_m(self.estimate.point())
    }

    /// Sum of the variances of the horizontal error in m²; `None` where the localizer has none.
    pub fn predicted_m2(&self) -> Option<f64> {
        let [[xx, ..], [_, yy, _], _] = self.covariance?;
        Some(xx + yy)
    }

    /// Squared horizontal error normalised by its covariance (NEES); `None` where the localizer
    /// has none, or one without area.
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

/// All that happened in one run.
#[derive(Debug, Clone, PartialEq)]
pub struct RunRecord {
    /// Its number.
    pub run: u64,
    /// One step per SSB.
    pub steps: Vec<Step>,
    /// The estimated angles.
    pub executions: Vec<Execution>,
    /// SSB bursts that the receiver listened to.
    pub listened: usize,
    /// Constants of the vehicle as estimated by the end of the drive, where the localizer does.
    pub constants: Option<EstimatedConstants>,
    /// SSBs at which no choice of angles could keep the bound of an uncertainty-driven wake-up.
    pub out_of_reach: usize,
}

/// How the first pose came about.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Found {
    /// The first step at which the pose was known.
    pub step: Step,
    /// Distance driven by then, in metres.
    pub driven_m: f64,
}

impl RunRecord {
    /// A run of which nothing has happened yet.
    pub(crate) fn new(run: u64, steps: usize) -> Self {
        Self {
            run,
            steps: Vec::with_capacity(steps),
            executions: Vec::with_capacity(steps),
            listened: 0,
            constants: None,
            out_of_reach: 0,
        }
    }

    /// Adds what became of a burst.
    pub(crate) fn add(&mut self, heard: &Heard<'_>) {
        self.listened += usize::from(heard.listened);
        self.executions.extend_from_slice(heard.executions);
        self.out_of_reach += usize::from(heard.keeps_bound == Some(false));
    }

    /// Adds where the vehicle is at an SSB, and where it believes to be.
    pub(crate) fn add_step(
        &mut self,
        onboard: &Onboard,
        time_s: f64,
        truth: Pose,
        snr_db: f64,
    ) -> Result<(), SimulationError> {
        let believed = onboard.pose(time_s).map_err(SimulationError::Custom)?;
        self.steps.push(Step {
            time_s,
            truth,
            estimate: believed.pose,
            covariance: believed.covariance,
            integrity: believed.integrity,
            searching: onboard.searching().is_some(),
            snr_db,
            faults: *onboard.faults(),
        });
        Ok(())
    }

    /// How the first pose came about: at once, unless it had to be searched for; `None` if it was
    /// not found.
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
