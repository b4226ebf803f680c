//! How the vehicle stands: pose, what it can be relied on for, why, and what to do.

use std::fmt;

use nr_ssb::Tone;

use crate::geometry::Pose;
use crate::monitor::{ActiveFaults, Fault};

/// What the pose can be relied on for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum State {
    /// No odometry has come: nothing is known yet.
    Waiting,
    /// The first pose is searched for; until it is found the pose is the mean of where it may be.
    Searching,
    /// Angles come from elsewhere than predicted: it is searched for again.
    Lost,
    /// Several sources disagree, there is no odometry any more, or no angles have confirmed a given pose: not to be
    /// relied on.
    Unavailable,
    /// The protection level is above the alert limit, or a fault is suspected.
    Degraded,
    /// The protection level holds and is within the alert limit.
    Ok,
    /// There is a pose and nothing that monitors it (`integrity.enabled = false`).
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

    /// Name for files and messages.
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

    /// Whether the pose is one place that was found, and not refuted.
    pub const fn is_localized(self) -> bool {
        matches!(self, Self::Degraded | Self::Ok | Self::Unmonitored)
    }
}

/// Why the state is what it is; a sentence by its [`Display`](fmt::Display).
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Reason {
    /// No odometry has come.
    NoOdometry,
    /// No odometry for so long.
    OdometrySilent {
        /// For how long, in seconds.
        age_s: f64,
    },
    /// No angle has been accepted yet.
    NoAngle,
    /// No angle has been accepted for so long.
    AnglesSilent {
        /// For how long, in seconds.
        age_s: f64,
    },
    /// Several places fit what was heard.
    SeveralPlaces {
        /// How many.
        places: usize,
    },
    /// Angles come from elsewhere than predicted.
    AnglesElsewhere,
    /// Half of the radio heads or more disagree with the others.
    SourcesDisagree,
    /// Radio heads are at fault and left out.
    FaultyHeads {
        /// How many.
        heads: usize,
    },
    /// The protection level is above the alert limit.
    LevelAboveLimit {
        /// Protection level in metres.
        level_m: f64,
        /// Alert limit in metres.
        limit_m: f64,
    },
    /// A fault of odometer, array or site is likelier than none, or was a moment ago.
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
    /// Nothing is wrong.
    Nominal,
    /// Nothing is wrong as far as anybody looks: there is no integrity monitor.
    NotMonitored,
}

impl Reason {
    /// What to do about it.
    pub const fn what_to_do(&self) -> &'static str {
        match self {
            Self::NoOdometry | Self::OdometrySilent { .. } => {
                "check the source of the odometry and its clock"
            }
            Self::NoAngle => {
                "check that samples or angles come, the SSB's frequency and period in the site, and \
                 the PCIs of the radio heads"
            }
            Self::AnglesSilent { .. } => {
                "drive on with care to where radio heads are in sight; if they are, check antennas \
                 and source of the samples"
            }
            Self::SeveralPlaces { .. } => {
                "drive on, straight ahead and around a bend, or give the pose"
            }
            Self::AnglesElsewhere => "stop and give the pose, or drive on slowly until it is found",
            Self::SourcesDisagree => {
                "stop; check the array's mounting and calibration, and the places of the radio heads"
            }
            Self::FaultyHeads { .. } => {
                "drive on; check place, PCI and line of sight of the radio heads that are left out"
            }
            Self::LevelAboveLimit { .. } => {
                "drive on with care: the level falls as more radio heads are heard"
            }
            Self::FaultSuspected => {
                "drive on with care; if it stays, check odometer, array and site against their files"
            }
            Self::SensorFault(fault) => fault.what_to_do(),
            Self::Unconfirmed => {
                "drive on with care to where two radio heads or more are in sight; the pose is confirmed \
                 by five angles"
            }
            Self::ClocksDisagree { .. } => {
                "stop; synchronize the clocks of the odometry and of the samples or angles"
            }
            Self::Nominal => "nothing",
            Self::NotMonitored => {
                "set integrity.enabled = true to know whether the pose can be relied on"
            }
        }
    }
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoOdometry => write!(f, "no odometry has come"),
            Self::OdometrySilent { age_s } => write!(f, "no odometry for {age_s:.1} s"),
            Self::NoAngle => write!(f, "no angle has been accepted yet"),
            Self::AnglesSilent { age_s } => {
                write!(f, "no angle has been accepted for {age_s:.1} s")
            }
            Self::SeveralPlaces { places: 1 } => {
                write!(f, "the place that fits is not yet certain")
            }
            Self::SeveralPlaces { places } => write!(f, "{places} places fit what was heard"),
            Self::AnglesElsewhere => write!(f, "angles come from elsewhere than predicted"),
            Self::SourcesDisagree => write!(f, "half of the radio heads or more disagree"),
            Self::FaultyHeads { heads: 1 } => write!(f, "a radio head is at fault and left out"),
            Self::FaultyHeads { heads } => {
                write!(f, "{heads} radio heads are at fault and left out")
            }
            Self::LevelAboveLimit { level_m, limit_m } => write!(
                f,
                "the protection level, {level_m:.2} m, is above the alert limit, {limit_m:.2} m"
            ),
            Self::FaultSuspected => write!(f, "a fault is suspected or was a moment ago"),
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
            Self::Nominal => write!(f, "nothing is wrong"),
            Self::NotMonitored => write!(f, "nothing monitors the pose"),
        }
    }
}

/// Number of tones in a status.
pub const TONES: usize = 4;

/// How the vehicle stands at a time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Status {
    /// Time of the pose in seconds: the time asked for, or the last one that odometry vouches for.
    pub time_s: f64,
    /// Position and heading in (−π, π]; while the first pose is searched for, the mean of the possible poses.
    /// `None` before any odometry.
    pub pose: Option<Pose>,
    /// Covariance of (x, y, heading), row-major, in m², m·rad and rad².
    pub covariance: Option<[[f64; 3]; 3]>,
    /// Speed by the odometer, in m/s ...
    pub speed_mps: f64,
    /// ... and yaw rate, counter-clockwise in rad/s, where something tells it.
    pub yaw_rate_radps: Option<f64>,
    /// What the pose can be relied on for.
    pub state: State,
    /// Why.
    pub reason: Reason,
    /// Horizontal protection level in metres, where the vehicle is monitored and has a pose.
    pub protection_level_m: Option<f64>,
    /// Radio heads found faulty; which they are, [`Live::heads`](super::Live::heads) says.
    pub faulty: usize,
    /// Time of the last angle accepted, in seconds.
    pub last_angle_s: Option<f64>,
    /// Age of the newest odometry in seconds.
    pub odometry_age_s: Option<f64>,
    /// Age of the newest sample in seconds.
    pub samples_age_s: Option<f64>,
    /// SSBs that the receiver keeps to.
    pub tracked: usize,
    /// Strongest tones that are subtracted from the samples, at absolute frequencies: DC offset of the receiver,
    /// spurious tones, other carriers.
    pub tones: [Option<Tone>; TONES],
    /// Active faults of odometry and receive channels.
    pub faults: ActiveFaults,
}
