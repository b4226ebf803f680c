//! Target of a position or stretch of the road.

use onboard::settings::{Check, SettingsError};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::target::Target;

/// `[[targets]]`: the accuracy that a position or a stretch needs, at a gate or a stop for example.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PlaceTarget {
    /// Display name.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub name: String,
    /// Position as distance along the road, in metres; the target applies from 5 m before to 5 m behind it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0, max = 1e5))]
    pub at_m: Option<f64>,
    /// Beginning of a stretch as distance along the road, in metres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0, max = 1e5))]
    pub from_m: Option<f64>,
    /// End of the stretch, in metres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0, max = 1e5))]
    pub to_m: Option<f64>,
    /// Horizontal error, and how much of the time it has to be within it: `"0.1 m 95 %"`.
    pub target: Target,
}

/// Distance before and behind a position to which its target applies (m): about the length of a tow tractor with
/// its trailer.
const ABOUT_M: f64 = 5.0;

impl PlaceTarget {
    /// Returns both ends of the stretch to which the target applies, as distances along a road of
    /// length `road_m`, in metres.
    pub fn ends_m(&self, road_m: f64) -> [f64; 2] {
        let from_m = self.at_m.map(|it| it - ABOUT_M).or(self.from_m);
        let to_m = self.at_m.map(|it| it + ABOUT_M).or(self.to_m);
        [
            from_m.unwrap_or(0.0).max(0.0),
            to_m.unwrap_or(road_m).min(road_m),
        ]
    }

    /// Rejects a target without a position on the driven road.
    ///
    /// # Errors
    /// [`SettingsError::Value`] naming the key and the allowed values.
    pub fn check(
        &self,
        check: Check<'_>,
        key: &str,
        start_m: f64,
        road_m: f64,
    ) -> Result<(), SettingsError> {
        let has_stretch = self.from_m.is_some() || self.to_m.is_some();
        let (at, to) = (format!("{key}.at_m"), format!("{key}.to_m"));
        let driven = format!("the trip leads from {start_m:.1} to {road_m:.1} m along the road");
        let is_driven = |it: f64| (start_m..=road_m).contains(&it);
        match (self.at_m, has_stretch) {
            (Some(at_m), true) => {
                let allowed = "give a position (at_m), or a stretch (from_m and to_m)";
                Err(check.error(&at, at_m, allowed))
            }
            (None, false) => {
                let allowed = "give a position (at_m), or a stretch (from_m and to_m)";
                Err(check.error(&at, "missing", allowed))
            }
            (Some(at_m), false) => check.that(is_driven(at_m), &at, at_m, &driven),
            (None, true) => {
                let (Some(from_m), Some(to_m)) = (self.from_m, self.to_m) else {
                    let missing = if self.to_m.is_none() {
                        "to_m"
                    } else {
                        "from_m"
                    };
                    let allowed = "a stretch needs from_m and to_m";
                    return Err(check.error(&format!("{key}.{missing}"), "missing", allowed));
                };
                check.that(from_m < to_m, &to, to_m, "it must be above from_m")?;
                check.that(is_driven(from_m), &format!("{key}.from_m"), from_m, &driven)?;
                check.that(is_driven(to_m), &to, to_m, &driven)
            }
        }
    }
}
