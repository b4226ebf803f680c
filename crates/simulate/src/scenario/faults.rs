//! Things that go wrong, at stated times.

use onboard::settings::{Check, SettingsError};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// `[[faults]]`
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FaultSettings {
    /// From when on, in seconds.
    #[schemars(range(min = 0.0, max = 1e9))]
    pub from_s: f64,
    /// Until when, in seconds.
    #[schemars(range(min = 0.0, max = 1e9))]
    pub until_s: f64,
    /// What goes wrong.
    pub what: FaultKind,
}

/// What goes wrong.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum FaultKind {
    /// A radio head is heard by a detour: its electrical angle is off.
    NonLineOfSight {
        /// Number of the radio head in the site, from 0.
        radio_head: usize,
        /// Error of the electrical angle in radians.
        #[schemars(range(min = -6.3, max = 6.3))]
        bias_rad: f64,
    },
    /// A radio head, or one that pretends to be it, is not where the survey says.
    MovedHead {
        /// Number of the radio head in the site, from 0.
        radio_head: usize,
        /// How far off it is, `[x, y]` in metres.
        #[schemars(inner(range(min = -1e5, max = 1e5)))]
        by_m: [f64; 2],
    },
    /// The wheels slip: the odometer reads so many times the distance.
    OdometerSlip {
        /// Reading over distance.
        #[schemars(range(min = 0.0, max = 10.0))]
        ratio: f64,
    },
    /// The odometry repeats the values of its last sample before the fault.
    OdometerFrozen,
    /// The odometry reports no motion: constant distance, zero speed and zero yaw rate.
    OdometerStopped,
    /// The odometry reports motion of the wrong sign.
    OdometerReversed,
    /// An antenna's signal no longer follows the field.
    StuckAntenna {
        /// Number of the antenna, from 0.
        antenna: usize,
    },
    /// An antenna has no signal.
    DeadAntenna {
        /// Number of the antenna, from 0.
        antenna: usize,
    },
    /// An antenna's signal has the wrong sign.
    InvertedAntenna {
        /// Number of the antenna, from 0.
        antenna: usize,
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
}

impl FaultKind {
    /// Whether the fault is one of the receive channels.
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
    /// Refuses what contradicts itself, or the site and its vehicle.
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
            "it must be after from_s",
        )?;
        let has_antenna = |name: &str, antenna: usize| {
            check.that(
                antenna < usize::from(elements),
                &key(name),
                antenna,
                &format!("the array has {elements} antennas, counted from 0"),
            )
        };
        match self.what {
            FaultKind::NonLineOfSight { radio_head, .. }
            | FaultKind::MovedHead { radio_head, .. }
            | FaultKind::DuplicateHead { radio_head, .. } => check.that(
                radio_head < heads,
                &key("what.radio_head"),
                radio_head,
                &format!("the site has {heads} radio heads, counted from 0"),
            ),
            FaultKind::StuckAntenna { antenna }
            | FaultKind::DeadAntenna { antenna }
            | FaultKind::InvertedAntenna { antenna } => has_antenna("what.antenna", antenna),
            FaultKind::ExchangedAntennas {
                antennas: [first, second],
            } => {
                check.that(
                    first != second,
                    &key("what.antennas"),
                    format!("[{first}, {second}]"),
                    "the antennas must differ",
                )?;
                has_antenna("what.antennas[0]", first)?;
                has_antenna("what.antennas[1]", second)
            }
            FaultKind::OdometerSlip { .. }
            | FaultKind::OdometerFrozen
            | FaultKind::OdometerStopped
            | FaultKind::OdometerReversed => Ok(()),
        }
    }
}
