//! From odometry and angles to a pose.

pub mod bound;
mod dead_reckoning;
pub mod gaussian;
pub mod ideal;
pub mod initialise;
pub mod integrity;
pub mod smoother;
pub mod thermal;
pub mod tracker;

pub use dead_reckoning::DeadReckoning;
pub use initialise::Initialiser;
pub use integrity::{Guard, Integrity, IntegrityState};
pub use tracker::Tracker;

use crate::geometry::Pose;
use crate::observation::OdometrySample;
use crate::world::RadioHead;
use integrity::{IntegrityConfig, RadialQuantile};
use tracker::OdometryVerdict;

/// The localizer a scenario chooses.
#[derive(Debug, Clone)]
pub enum Localizer {
    /// The paper's.
    DeadReckoning(DeadReckoning),
    /// The filter.
    Tracker(Box<Tracker>),
    /// The filter, mistrusting its sources.
    Guarded(Box<Guard>),
    /// The search for the first pose.
    Searching(Box<Search>),
}

/// The search for the first pose, and how the filter that comes out of it is to be guarded.
#[derive(Debug, Clone)]
pub struct Search {
    initialiser: Initialiser,
    integrity: Option<(IntegrityConfig, RadialQuantile)>,
}

impl Localizer {
    /// A tracker, guarded or not.
    pub fn tracking(
        tracker: Tracker,
        heads: &[RadioHead],
        integrity: Option<IntegrityConfig>,
    ) -> Self {
        match integrity {
            Some(config) => Self::Guarded(Box::new(Guard::new(tracker, heads, config))),
            None => Self::Tracker(Box::new(tracker)),
        }
    }

    /// A search for the first pose, from which a tracker comes, guarded or not.
    pub fn searching(initialiser: Initialiser, integrity: Option<IntegrityConfig>) -> Self {
        Self::Searching(Box::new(Search {
            initialiser,
            integrity: integrity.map(|config| (config, RadialQuantile::new(config.risk))),
        }))
    }

    /// Number of hypotheses left of a search for the first pose; `None` once it is known.
    pub fn hypotheses(&self) -> Option<usize> {
        match self {
            Self::Searching(search) => Some(search.initialiser.left()),
            _ => None,
        }
    }

    /// Takes in a valid odometry sample.
    pub fn odometry(&mut self, sample: &OdometrySample) -> OdometryVerdict {
        match self {
            // Dead reckoning knows steps only.
            Self::DeadReckoning(_) => OdometryVerdict::Accepted,
            Self::Tracker(tracker) => tracker.odometry(sample),
            Self::Guarded(guard) => guard.odometry(sample),
            Self::Searching(search) => search.initialiser.odometry(sample),
        }
    }

    /// Moves on by what odometry says.
    pub fn predict(&mut self, step: &OdometryStep) {
        match self {
            Self::DeadReckoning(localizer) => localizer.predict(step),
            // The tracker stays at the newest sample and looks ahead from there.
            Self::Tracker(_) | Self::Guarded(_) | Self::Searching(..) => {}
        }
    }

    /// Takes in an angle to a radio head.
    pub fn update(&mut self, head: &RadioHead, measured: &AngleMeasurement) -> UpdateVerdict {
        match self {
            Self::DeadReckoning(localizer) => localizer.update(head, measured),
            Self::Tracker(tracker) => tracker.update(head, measured),
            Self::Guarded(guard) => guard.update(head, measured),
            Self::Searching(search) => {
                let verdict = search.initialiser.update(head, measured);
                if let Some(tracker) = search.initialiser.found() {
                    let integrity = search.integrity.as_ref().map(|(config, _)| *config);
                    *self = Self::tracking(tracker, search.initialiser.heads(), integrity);
                }
                verdict
            }
        }
    }

    /// Where it believes the vehicle to be at `time_s`, to which it has been moved.
    pub fn pose(&self, time_s: f64) -> PoseEstimate {
        match self {
            Self::DeadReckoning(localizer) => localizer.pose(),
            Self::Tracker(tracker) => tracker.pose(time_s),
            Self::Guarded(guard) => guard.pose(time_s),
            Self::Searching(search) => {
                let mut estimate = search.initialiser.pose(time_s);
                let variances = estimate.principal_variances();
                estimate.integrity = search.integrity.as_ref().map(|(_, quantile)| Integrity {
                    protection_level_m: quantile.radius(variances),
                    state: IntegrityState::Unavailable,
                    faulty: 0,
                });
                estimate
            }
        }
    }

    /// Lets the tracker, if it is one by now and without guard, keep the journal that smoothing
    /// takes.
    pub fn keep_journal(&mut self) {
        if let Self::Tracker(tracker) = self {
            tracker.keep_journal();
        }
    }

    /// The tracker in it, if it is one.
    pub fn tracker(&self) -> Option<&Tracker> {
        match self {
            Self::DeadReckoning(_) | Self::Searching(..) => None,
            Self::Tracker(tracker) => Some(tracker),
            Self::Guarded(guard) => Some(guard.tracker()),
        }
    }
}

/// What odometry says happened since the step before.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OdometryStep {
    /// End of the step in seconds.
    pub time_s: f64,
    /// Its duration in seconds.
    pub duration_s: f64,
    /// Distance driven in it, in metres.
    pub distance_m: f64,
    /// Turn in it by the gyroscope, in radians counter-clockwise, where there is one.
    pub turn_rad: Option<f64>,
}

/// An angle of arrival as a localizer takes it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AngleMeasurement {
    /// Time in seconds.
    pub time_s: f64,
    /// Electrical angle ω = 2π(d/λ)·cos θ between neighbouring antennas, in radians.
    pub phase_rad: f64,
    /// Its standard deviation from noise, in radians.
    pub phase_sigma_rad: f64,
    /// Angle of arrival θ from the array's axis, in radians, 0..=π.
    pub angle_rad: f64,
    /// SNR per antenna and snapshot, in dB.
    pub snr_db: f64,
    /// Whether the estimator vouches for it: that it is Gaussian with this standard deviation.
    pub resolved: bool,
}

/// Where a localizer believes the vehicle to be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoseEstimate {
    /// Time in seconds.
    pub time_s: f64,
    /// Place and heading.
    pub pose: Pose,
    /// Covariance of (x, y, heading), row-major, in m² , m·rad and rad²; `None` where the
    /// localizer does not know its own error.
    pub covariance: Option<[[f64; 3]; 3]>,
    /// Protection level and state, where the localizer is guarded.
    pub integrity: Option<Integrity>,
}

impl PoseEstimate {
    /// Variances of the horizontal error along its principal axes, larger first, in m²; infinite
    /// where the localizer does not know them.
    pub fn principal_variances(&self) -> [f64; 2] {
        let Some([[xx, xy, _], [_, yy, _], _]) = self.covariance else {
            return [f64::INFINITY; 2];
        };
        gaussian::principal_variances(xx, xy, yy)
    }
}

/// What a localizer did with an angle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UpdateVerdict {
    /// Whether the angle changed the pose.
    pub accepted: bool,
    /// Why, or why not.
    pub reason: UpdateReason,
    /// Squared Mahalanobis distance of the innovation, where the localizer has a covariance.
    pub mahalanobis_squared: Option<f64>,
    /// The largest it may be.
    pub threshold: Option<f64>,
}

impl UpdateVerdict {
    /// An angle that never met the localizer's covariance.
    pub(crate) const fn unused(reason: UpdateReason) -> Self {
        Self {
            accepted: false,
            reason,
            mahalanobis_squared: None,
            threshold: None,
        }
    }
}

/// Why an angle was taken or left.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum UpdateReason {
    /// It agrees with the prediction, or there is none to compare it with.
    Consistent,
    /// It lies too far from the prediction.
    Outlier,
    /// It carries no angle: no number, no valid standard deviation, no resolved source, or a radio
    /// head within a metre.
    Unusable,
    /// No radio head with this PCI and SSB index is on the map.
    UnknownRadioHead,
    /// Its time is before the last one's.
    TimeReversed,
    /// Its radio head is excluded, by the user or as faulty.
    Excluded,
}

impl UpdateReason {
    /// Short name for logs and tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Consistent => "consistent",
            Self::Outlier => "outlier",
            Self::Unusable => "unusable",
            Self::UnknownRadioHead => "unknown radio head",
            Self::TimeReversed => "time reversed",
            Self::Excluded => "excluded",
        }
    }
}
