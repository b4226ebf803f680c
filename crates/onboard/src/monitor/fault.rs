//! Faults that the monitors identify.

use std::fmt;

use serde::Serialize;

/// Maximum number of simultaneous faults.
const MAX_FAULTS: usize = 8;

/// Fault of a sensor, a receive channel or a radio head.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "snake_case", tag = "fault")]
pub enum Fault {
    /// The odometry reports no motion, or constant motion, while the angles show another motion.
    OdometryFrozen,
    /// The odometry reports motion of the wrong sign.
    OdometryReversed,
    /// Distance and speed of the odometry contradict each other.
    OdometryContradictory,
    /// The yaw rate has the wrong sign.
    YawRateReversed,
    /// The angles of all radio heads repeat exactly although the vehicle moves.
    AnglesStuck,
    /// A receive channel has no signal.
    DeadChannel {
        /// Number of the channel, from 0.
        channel: u8,
    },
    /// The signal of a receive channel has the wrong sign: its phase is off by π.
    InvertedChannel {
        /// Number of the channel, from 0.
        channel: u8,
    },
    /// The inputs of two receive channels are exchanged.
    ExchangedChannels {
        /// Numbers of the channels, from 0, in increasing order.
        channels: [u8; 2],
    },
    /// The signal of an SSB comes from two directions: two radio heads have one PCI, or a reflection is as strong as the
    /// direct signal.
    DuplicatePci {
        /// PCI of the SSB.
        pci: u16,
        /// Index of the SSB.
        ssb_index: u8,
    },
}

/// Component to which a fault belongs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum FaultSource {
    /// The odometry.
    Odometry,
    /// The angles of all radio heads.
    Angles,
    /// A receive channel, by its number from 0.
    Channel(u8),
    /// A radio head, by its PCI.
    RadioHead(u16),
}

impl Fault {
    /// Returns the name for files and metrics.
    pub const fn name(self) -> &'static str {
        match self {
            Self::OdometryFrozen => "odometry_frozen",
            Self::OdometryReversed => "odometry_reversed",
            Self::OdometryContradictory => "odometry_contradictory",
            Self::YawRateReversed => "yaw_rate_reversed",
            Self::AnglesStuck => "angles_stuck",
            Self::DeadChannel { .. } => "dead_channel",
            Self::InvertedChannel { .. } => "inverted_channel",
            Self::ExchangedChannels { .. } => "exchanged_channels",
            Self::DuplicatePci { .. } => "duplicate_pci",
        }
    }

    /// Returns the component of the fault; for exchanged channels, the first channel.
    pub const fn source(self) -> FaultSource {
        match self {
            Self::OdometryFrozen
            | Self::OdometryReversed
            | Self::OdometryContradictory
            | Self::YawRateReversed => FaultSource::Odometry,
            Self::AnglesStuck => FaultSource::Angles,
            Self::DeadChannel { channel } | Self::InvertedChannel { channel } => {
                FaultSource::Channel(channel)
            }
            Self::ExchangedChannels {
                channels: [channel, _],
            } => FaultSource::Channel(channel),
            Self::DuplicatePci { pci, .. } => FaultSource::RadioHead(pci),
        }
    }

    /// Returns the channel numbers or the PCI, for metrics; empty for odometry and angles.
    pub fn subject(self) -> String {
        match self {
            Self::ExchangedChannels {
                channels: [first, second],
            } => format!("{first}-{second}"),
            other => match other.source() {
                FaultSource::Odometry | FaultSource::Angles => String::new(),
                FaultSource::Channel(channel) => channel.to_string(),
                FaultSource::RadioHead(pci) => pci.to_string(),
            },
        }
    }

    /// Returns the recommended action.
    pub const fn what_to_do(self) -> &'static str {
        match self.source() {
            FaultSource::Odometry => "stop; check the odometer and the source of the odometry",
            FaultSource::Angles => "stop; check the receiver and the source of the angles",
            FaultSource::Channel(_) => {
                "stop; check the cables from the antennas to the receiver, and samples.stream.antennas"
            }
            FaultSource::RadioHead(_) => {
                "give each radio head a PCI of its own; check for reflections"
            }
        }
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::OdometryFrozen => {
                write!(f, "the odometry is frozen: the angles show another motion")
            }
            Self::OdometryReversed => write!(f, "the odometry has the wrong sign"),
            Self::OdometryContradictory => {
                write!(
                    f,
                    "distance and speed of the odometry contradict each other"
                )
            }
            Self::YawRateReversed => write!(f, "the yaw rate has the wrong sign"),
            Self::AnglesStuck => {
                write!(f, "the angles repeat exactly although the vehicle moves")
            }
            Self::DeadChannel { channel } => write!(f, "receive channel {channel} has no signal"),
            Self::InvertedChannel { channel } => {
                write!(f, "receive channel {channel} is inverted")
            }
            Self::ExchangedChannels {
                channels: [first, second],
            } => write!(f, "receive channels {first} and {second} are exchanged"),
            Self::DuplicatePci { pci, ssb_index } => write!(
                f,
                "the signal of PCI {pci}, SSB index {ssb_index} comes from two directions: two radio heads have this PCI, \
                 or a reflection is as strong"
            ),
        }
    }
}

/// Active fault and time of its detection.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ActiveFault {
    /// The fault.
    #[serde(flatten)]
    pub fault: Fault,
    /// Time of the detection of the fault, in seconds.
    pub since_s: f64,
}

/// Active faults in order of detection.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ActiveFaults([Option<ActiveFault>; MAX_FAULTS]);

impl ActiveFaults {
    /// Returns the active faults.
    pub fn iter(&self) -> impl Iterator<Item = &ActiveFault> {
        self.0.iter().flatten()
    }

    /// Whether no fault is active.
    pub fn is_empty(&self) -> bool {
        self.iter().next().is_none()
    }

    /// Whether this fault is active.
    pub fn contains(&self, fault: Fault) -> bool {
        self.iter().any(|it| it.fault == fault)
    }

    /// Returns the first active fault of the odometry.
    pub fn of_odometry(&self) -> Option<Fault> {
        let mut faults = self.iter().map(|it| it.fault);
        faults.find(|it| it.source() == FaultSource::Odometry)
    }

    /// Whether the odometry, the angles or a receive channel are faulty, so that every burst must be received.
    pub fn has_of_vehicle(&self) -> bool {
        self.iter()
            .any(|it| !matches!(it.fault.source(), FaultSource::RadioHead(_)))
    }

    /// Whether the angles or a receive channel are faulty, so that the localizer receives no angles.
    pub fn withholds_angles(&self) -> bool {
        let is_of_angles = |it: &ActiveFault| {
            matches!(
                it.fault.source(),
                FaultSource::Angles | FaultSource::Channel(_)
            )
        };
        self.iter().any(is_of_angles)
    }

    /// Whether a fault makes every angle wrong: inverted or exchanged channels.
    pub fn affects_angles(&self) -> bool {
        self.of_angles().is_some()
    }

    /// Returns the first active fault that makes every angle wrong.
    pub fn of_angles(&self) -> Option<Fault> {
        let mut faults = self.iter().map(|it| it.fault);
        faults.find(|it| {
            matches!(
                it,
                Fault::InvertedChannel { .. } | Fault::ExchangedChannels { .. }
            )
        })
    }

    /// Adds a fault detected at `since_s`. At most eight faults are stored; a fault of the vehicle
    /// replaces one of a radio head if necessary.
    pub fn begin(&mut self, fault: Fault, since_s: f64) {
        if self.contains(fault) {
            return;
        }
        let is_of_head = |it: Fault| matches!(it.source(), FaultSource::RadioHead(_));
        if self.0.iter().all(Option::is_some) && !is_of_head(fault) {
            let last = self
                .0
                .iter_mut()
                .rfind(|it| it.is_some_and(|it| is_of_head(it.fault)));
            if let Some(last) = last {
                *last = None;
            }
        }
        if let Some(free) = self.0.iter_mut().find(|it| it.is_none()) {
            *free = Some(ActiveFault { fault, since_s });
        }
    }

    /// Removes a fault that has ended.
    pub fn end(&mut self, fault: Fault) {
        let mut kept = 0;
        for place in 0..MAX_FAULTS {
            let active = self.0.get_mut(place).and_then(Option::take);
            if let Some(active) = active.filter(|it| it.fault != fault)
                && let Some(slot) = self.0.get_mut(kept)
            {
                *slot = Some(active);
                kept += 1;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faults_begin_and_end_once_and_keep_their_order() {
        let (mut faults, dead) = (ActiveFaults::default(), Fault::DeadChannel { channel: 2 });
        faults.begin(Fault::OdometryFrozen, 1.0);
        faults.begin(dead, 2.0);
        faults.begin(Fault::OdometryFrozen, 3.0);
        let since: Vec<f64> = faults.iter().map(|it| it.since_s).collect();
        assert_eq!(since, [1.0, 2.0]);
        assert_eq!(faults.of_odometry(), Some(Fault::OdometryFrozen));
        faults.end(Fault::OdometryFrozen);
        assert_eq!(faults.iter().map(|it| it.fault).collect::<Vec<_>>(), [dead]);
        faults.end(dead);
        assert!(faults.is_empty() && faults == ActiveFaults::default());
        for pci in 0..20 {
            let ssb_index = 0;
            faults.begin(Fault::DuplicatePci { pci, ssb_index }, 0.0);
        }
        assert_eq!(faults.iter().count(), MAX_FAULTS);
        assert!(!faults.has_of_vehicle());
        faults.begin(Fault::OdometryFrozen, 0.0);
        assert_eq!(faults.of_odometry(), Some(Fault::OdometryFrozen));
        for channel in 0..20 {
            faults.begin(Fault::DeadChannel { channel }, 0.0);
        }
        assert_eq!(faults.iter().count(), MAX_FAULTS);
        assert_eq!(faults.of_odometry(), Some(Fault::OdometryFrozen));
    }
}
