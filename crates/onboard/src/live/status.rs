//! Status of the vehicle: pose, integrity, reason, and recommended action.

use std::fmt;

use nr_ssb::Tone;

use crate::geometry::Pose;
use crate::localize::SelectedHypothesis;
use crate::monitor::{ActiveFaults, Fault};

/// State of the pose.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum State {
    /// No odometry has arrived.
    Waiting,
    /// Search for the initial pose; the pose is the mean of the hypotheses.
    Searching,
    /// The angles contradict the prediction; a search for the pose is active.
    Lost,
    /// Several sources contradict each other, the odometry is absent, or no angles have confirmed a
    /// given pose: the pose must not be used.
    Unavailable,
    /// The protection level exceeds the alert limit, or a fault is suspected.
    Degraded,
    /// The protection level is valid and within the alert limit.
    Ok,
    /// There is a pose without integrity monitoring (`integrity.enabled = false`).
    Unmonitored,
}

impl State {
    /// All states.
    pub const ALL: [Self; 7] = [
        Self::Waiting,
        Self::Searching,
        Self::Lost,
        Self::Unavailable,
        Self::Degraded,
        Self::Ok,
        Self::Unmonitored,
    ];

    /// Returns the name for files and messages.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Waiting => "waiting",
            Self::Searching => "searching",
            Self::Lost => "lost",
            Self::Unavailable => "unavailable",
            Self::Degraded => "degraded",
            Self::Ok => "ok",
            Self::Unmonitored => "unmonitored",
        }
    }

    /// Whether the pose is a single position that is not refuted.
    pub const fn is_localized(self) -> bool {
        matches!(self, Self::Degraded | Self::Ok | Self::Unmonitored)
    }
}

/// Reason of the state; [`Display`](fmt::Display) yields a sentence.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Reason {
    /// No odometry has arrived.
    NoOdometry,
    /// The odometry is too old.
    OdometrySilent {
        /// Age of the newest odometry, in seconds.
        age_s: f64,
    },
    /// No angle has been accepted yet.
    NoAngle,
    /// No angle has been accepted for some time.
    AnglesSilent {
        /// Time since the last accepted angle, in seconds.
        age_s: f64,
    },
    /// Several positions are consistent with the angles.
    SeveralPlaces {
        /// Number of positions.
        places: usize,
    },
    /// The angles contradict the prediction.
    AnglesElsewhere,
    /// At least half of the radio heads contradict the others.
    SourcesDisagree,
    /// Radio heads are faulty and excluded.
    FaultyHeads {
        /// Number of radio heads.
        heads: usize,
    },
    /// The protection level exceeds the alert limit.
    LevelAboveLimit {
        /// Protection level in metres.
        level_m: f64,
        /// Alert limit in metres.
        limit_m: f64,
    },
    /// A fault of odometer, array or site is more probable than none, or was recently.
    FaultSuspected,
    /// A fault of the odometry or of a receive channel is active.
    SensorFault(Fault),
    /// The pose was given or resumed, and angles have not confirmed it yet.
    Unconfirmed,
    /// The clocks of angles or samples and of odometry differ.
    ClocksDisagree {
        /// Time of the angles minus that of the odometry, in seconds.
        offset_s: f64,
    },
    /// No fault detected.
    Nominal,
    /// No fault detected, because there is no integrity monitor.
    NotMonitored,
}

impl Reason {
    /// Returns the recommended action.
    pub const fn what_to_do(&self) -> &'static str {
        match self {
            Self::NoOdometry | Self::OdometrySilent { .. } => {
                "check the source of the odometry and its clock"
            }
            Self::NoAngle => {
                "check that samples or angles arrive; check the frequency and period of the SSBs \
                 and the PCIs in the site file"
            }
            Self::AnglesSilent { .. } => {
                "drive on with care until radio heads are in sight; if they are in sight, check \
                 the antennas and the source of the samples"
            }
            Self::SeveralPlaces { .. } => "drive straight ahead and around a bend, or set the pose",
            Self::AnglesElsewhere => {
                "stop and set the pose, or drive on slowly until the \
                 position is found"
            }
            Self::SourcesDisagree => {
                "stop; check the array's mounting and calibration, and the positions of the radio \
                 heads"
            }
            Self::FaultyHeads { .. } => {
                "drive on; check position, PCI and line of sight of the excluded radio heads"
            }
            Self::LevelAboveLimit { .. } => {
                "drive on with care: the level falls as more radio heads are received"
            }
            Self::FaultSuspected => {
                "drive on with care; if the suspicion persists, compare odometer, array and site \
                 with their files"
            }
            Self::SensorFault(fault) => fault.what_to_do(),
            Self::Unconfirmed => {
                "drive on with care until at least two radio heads are in sight; five angles \
                 confirm the pose"
            }
            Self::ClocksDisagree { .. } => {
                "stop; synchronize the clocks of the odometry and of the samples or angles"
            }
            Self::Nominal => "nothing",
            Self::NotMonitored => "set integrity.enabled = true to monitor the pose",
        }
    }
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoOdometry => write!(f, "no odometry has arrived"),
            Self::OdometrySilent { age_s } => write!(f, "no odometry for {age_s:.1} s"),
            Self::NoAngle => write!(f, "no angle has been accepted yet"),
            Self::AnglesSilent { age_s } => {
                write!(f, "no angle has been accepted for {age_s:.1} s")
            }
            Self::SeveralPlaces { places: 1 } => {
                write!(
                    f,
                    "one position fits the received angles, but it is not yet certain"
                )
            }
            Self::SeveralPlaces { places } => write!(
                f,
                "{places} positions fit the received \
                 angles"
            ),
            Self::AnglesElsewhere => write!(f, "the angles contradict the predicted position"),
            Self::SourcesDisagree => write!(
                f,
                "at least half of the radio heads contradict the \
                 others"
            ),
            Self::FaultyHeads { heads: 1 } => write!(f, "a radio head is faulty and excluded"),
            Self::FaultyHeads { heads } => {
                write!(f, "{heads} radio heads are faulty and excluded")
            }
            Self::LevelAboveLimit { level_m, limit_m } => write!(
                f,
                "the protection level, {level_m:.2} m, is above the alert limit, {limit_m:.2} m"
            ),
            Self::FaultSuspected => write!(f, "a fault is suspected, or was suspected recently"),
            Self::SensorFault(fault) => fault.fmt(f),
            Self::Unconfirmed => {
                write!(f, "angles have not confirmed the given or resumed pose yet")
            }
            Self::ClocksDisagree { offset_s } => write!(
                f,
                "angles are {:.1} s {} the odometry: their clocks differ",
                offset_s.abs(),
                if *offset_s < 0.0 {
                    "behind"
                } else {
                    "ahead of"
                },
            ),
            Self::Nominal => write!(f, "no fault detected"),
            Self::NotMonitored => write!(f, "the pose is not monitored"),
        }
    }
}

/// Number of tones in a status.
pub const TONES: usize = 4;

/// Status of the vehicle at one time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Status {
    /// Time of the pose in seconds: the requested time, or the last one with valid odometry.
    pub time_s: f64,
    /// Position and heading in (−π, π]; during the search for the initial pose, the mean of the
    /// hypotheses. `None` before any odometry.
    pub pose: Option<Pose>,
    /// Covariance of (x, y, heading), row-major, in m², m·rad and rad².
    pub covariance: Option<[[f64; 3]; 3]>,
    /// Speed measured by the odometer, in m/s.
    pub speed_mps: f64,
    /// Yaw rate, counter-clockwise in rad/s, if the vehicle measures it.
    pub yaw_rate_radps: Option<f64>,
    /// State of the pose.
    pub state: State,
    /// Reason of the state.
    pub reason: Reason,
    /// Horizontal protection level in metres, if the vehicle is monitored and has a pose.
    pub protection_level_m: Option<f64>,
    /// Selected hypothesis, if the vehicle is monitored and has a pose.
    pub selected_hypothesis: Option<SelectedHypothesis>,
    /// Number of radio heads identified as faulty; [`Live::heads`](super::Live::heads) lists them.
    pub faulty: usize,
    /// Time of the last accepted angle, in seconds.
    pub last_angle_s: Option<f64>,
    /// Age of the newest odometry in seconds.
    pub odometry_age_s: Option<f64>,
    /// Age of the newest sample in seconds.
    pub samples_age_s: Option<f64>,
    /// Number of tracked SSBs.
    pub tracked: usize,
    /// Strongest tones that are subtracted from the samples, at absolute frequencies: DC offset of the receiver,
    /// spurious tones, other carriers.
    pub tones: [Option<Tone>; TONES],
    /// Active faults of odometry and receive channels.
    pub faults: ActiveFaults,
}
