//! Faults at given times.

use onboard::settings::{Check, SettingsError};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// `[[faults]]`: a simulated fault.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FaultSettings {
    /// Start of the fault in seconds from the start of the run.
    #[schemars(range(min = 0.0, max = 1e9))]
    pub from_s: f64,
    /// End of the fault in seconds from the start of the run.
    #[schemars(range(min = 0.0, max = 1e9))]
    pub until_s: f64,
    /// Kind of fault.
    pub what: FaultKind,
}

/// Kind of fault.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum FaultKind {
    /// The signal of a radio head arrives on a reflected path, which gives an error of the
    /// electrical angle.
    NonLineOfSight {
        /// Number of the radio head in the site, from 0.
        radio_head: usize,
        /// Error of the electrical angle in radians.
        #[schemars(range(min = -6.3, max = 6.3))]
        bias_rad: f64,
    },
    /// A radio head, or a transmitter that imitates it, is at a position different from the
    /// surveyed one.
    MovedHead {
        /// Number of the radio head in the site, from 0.
        radio_head: usize,
        /// True position minus surveyed position, `[x, y]` in metres.
        #[schemars(inner(range(min = -1e5, max = 1e5)))]
        by_m: [f64; 2],
    },
    /// The wheels slip, which gives a scale error of the odometer.
    OdometerSlip {
        /// Scale factor: distance measured per distance driven.
        #[schemars(range(min = 0.0, max = 10.0))]
        scale: f64,
    },
    /// The odometry repeats the values of its last sample before the fault.
    OdometerFrozen,
    /// The odometry repeats the speed of its last sample before the fault; the distance advances at this speed.
    OdometerHeld,
    /// The odometry reports no motion: constant distance, zero speed and zero yaw rate.
    OdometerStopped,
    /// The odometry reports motion of the wrong sign.
    OdometerReversed,
    /// The signal of an antenna is independent of the field.
    StuckAntenna {
        /// List with the number of one antenna, from 0.
        antennas: [usize; 1],
    },
    /// An antenna has no signal.
    DeadAntenna {
        /// List with the number of one antenna, from 0.
        antennas: [usize; 1],
    },
    /// An antenna's signal has the wrong sign.
    InvertedAntenna {
        /// List with the number of one antenna, from 0.
        antennas: [usize; 1],
    },
    /// The signals of two antennas are exchanged.
    ExchangedAntennas {
        /// Numbers of the antennas, from 0.
        antennas: [usize; 2],
    },
    /// Another transmitter sends the PCI of a radio head at the same time, with the same power at the vehicle.
    DuplicateHead {
        /// Number of the radio head in the site, from 0.
        radio_head: usize,
        /// Position of the other transmitter minus that of the radio head, `[x, y]` in metres.
        #[schemars(inner(range(min = -1e5, max = 1e5)))]
        by_m: [f64; 2],
    },
    /// The signals arrive late by the clock of the receiver: a clock step, or a blocked first path if a
    /// radio head is given. Only simulated samples (`fidelity = "iq"`) contain it.
    LateArrival {
        /// Number of the radio head in the site, from 0. Default: all radio heads, a step of the
        /// vehicle's clock.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        radio_head: Option<usize>,
        /// Additional delay in nanoseconds.
        #[schemars(range(min = -1e4, max = 1e4))]
        by_ns: f64,
    },
}

impl FaultKind {
    /// Whether the fault affects the receive channels.
    pub const fn is_of_channels(&self) -> bool {
        matches!(
            self,
            Self::StuckAntenna { .. }
                | Self::DeadAntenna { .. }
                | Self::InvertedAntenna { .. }
                | Self::ExchangedAntennas { .. }
        )
    }
}

impl FaultSettings {
    /// Checks the fault for consistency with the site and the vehicle.
    ///
    /// # Errors
    /// [`SettingsError::Value`].
    pub fn check(
        &self,
        check: Check<'_>,
        index: usize,
        heads: usize,
        elements: u8,
    ) -> Result<(), SettingsError> {
        let key = |name: &str| format!("faults[{index}].{name}");
        let later = self.until_s > self.from_s;
        check.that(
            later,
            &key("until_s"),
            self.until_s,
            "must be greater than `from_s`",
        )?;
        let has_antennas = |antennas: &[usize]| {
            antennas.iter().enumerate().try_for_each(|(at, &antenna)| {
                check.that(
                    antenna < usize::from(elements),
                    &key(&format!("what.antennas[{at}]")),
                    antenna,
                    &format!("the array has {elements} antennas with numbers from 0"),
                )
            })
        };
        match self.what {
            FaultKind::NonLineOfSight { radio_head, .. }
            | FaultKind::MovedHead { radio_head, .. }
            | FaultKind::DuplicateHead { radio_head, .. }
            | FaultKind::LateArrival {
                radio_head: Some(radio_head),
                ..
            } => check.that(
                radio_head < heads,
                &key("what.radio_head"),
                radio_head,
                &format!("the site has {heads} radio heads with numbers from 0"),
            ),
            FaultKind::StuckAntenna { antennas }
            | FaultKind::DeadAntenna { antennas }
            | FaultKind::InvertedAntenna { antennas } => has_antennas(&antennas),
            FaultKind::ExchangedAntennas {
                antennas: [first, second],
            } => {
                check.that(
                    first != second,
                    &key("what.antennas"),
                    format!("[{first}, {second}]"),
                    "the antennas must differ",
                )?;
                has_antennas(&[first, second])
            }
            FaultKind::LateArrival {
                radio_head: None, ..
            }
            | FaultKind::OdometerSlip { .. }
            | FaultKind::OdometerFrozen
            | FaultKind::OdometerHeld
            | FaultKind::OdometerStopped
            | FaultKind::OdometerReversed => Ok(()),
        }
    }
}
