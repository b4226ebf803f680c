//! Things that go wrong, at stated times.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Check, ScenarioError};
use crate::observation::ANTENNAS;

/// `[[faults]]`
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FaultSettings {
    /// From when on, in seconds.
    pub from_s: f64,
    /// Until when, in seconds.
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
        /// Number of the radio head in the scenario, from 0.
        radio_head: usize,
        /// Error of the electrical angle in radians.
        bias_rad: f64,
    },
    /// A radio head, or one that pretends to be it, is not where the survey says.
    MovedHead {
        /// Number of the radio head in the scenario, from 0.
        radio_head: usize,
        /// How far off it is, `[x, y]` in metres.
        by_m: [f64; 2],
    },
    /// The wheels slip: the odometer reads so many times the distance.
    OdometerSlip {
        /// Reading over distance.
        ratio: f64,
    },
    /// An antenna's signal no longer follows the field.
    StuckAntenna {
        /// Number of the antenna, from 0.
        antenna: usize,
    },
}

impl FaultSettings {
    pub(super) fn check(
        &self,
        check: &Check<'_>,
        index: usize,
        heads: usize,
    ) -> Result<(), ScenarioError> {
        let key = |name: &str| format!("faults[{index}].{name}");
        check.not_negative(&key("from_s"), self.from_s)?;
        let after = "it must be after from_s";
        check.that(
            self.until_s > self.from_s,
            &key("until_s"),
            self.until_s,
            after,
        )?;
        let known = |radio_head: usize| {
            let allowed = format!("the scenario has {heads} radio heads, counted from 0");
            check.that(
                radio_head < heads,
                &key("what.radio_head"),
                radio_head,
                &allowed,
            )
        };
        match self.what {
            FaultKind::NonLineOfSight {
                radio_head,
                bias_rad,
            } => {
                known(radio_head)?;
                check.between(&key("what.bias_rad"), bias_rad, -6.3, 6.3)
            }
            FaultKind::MovedHead { radio_head, .. } => known(radio_head),
            FaultKind::OdometerSlip { ratio } => {
                check.between(&key("what.ratio"), ratio, 0.0, 10.0)
            }
            FaultKind::StuckAntenna { antenna } => {
                let allowed = format!("the array has {ANTENNAS} antennas, counted from 0");
                check.that(antenna < ANTENNAS, &key("what.antenna"), antenna, &allowed)
            }
        }
    }
}
