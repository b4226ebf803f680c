//! Numbers that say where they come from.

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::Value as Json;

use super::check::Check;
use super::error::SettingsError;
use super::read::join;

/// A number and where it comes from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Figure {
    /// The number, in the unit its key names.
    #[schemars(range(min = 0.0, max = 1e9))]
    pub value: f64,
    /// The least it may be.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = -1e9, max = 1e9))]
    pub low: Option<f64>,
    /// The most it may be.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0, max = 1e9))]
    pub high: Option<f64>,
    /// How it came about.
    pub provenance: Provenance,
    /// Document, data set or fit it is taken from.
    pub source: String,
    /// What is counted in it.
    pub boundary: Boundary,
}

/// A number that is neither power nor energy, and where it comes from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Quantity {
    /// The number, in the unit its key names.
    #[schemars(range(min = 0.0, max = 1e12))]
    pub value: f64,
    /// The least it may be.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0, max = 1e12))]
    pub low: Option<f64>,
    /// The most it may be.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0, max = 1e12))]
    pub high: Option<f64>,
    /// How it came about.
    pub provenance: Provenance,
    /// Document, data set or fit it is taken from.
    pub source: String,
}

/// Which value of a range is meant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Extent {
    /// The least that it may be.
    Low,
    /// The value itself.
    Value,
    /// The most that it may be.
    High,
}

impl Extent {
    /// The other end.
    #[must_use]
    pub fn opposite(self) -> Self {
        match self {
            Self::Low => Self::High,
            Self::Value => Self::Value,
            Self::High => Self::Low,
        }
    }

    fn of(self, value: f64, low: Option<f64>, high: Option<f64>) -> f64 {
        match self {
            Self::Low => low.unwrap_or(value),
            Self::Value => value,
            Self::High => high.unwrap_or(value),
        }
    }
}

impl Figure {
    /// Its value, or an end of its range; the value where it states no range.
    pub fn at(&self, extent: Extent) -> f64 {
        extent.of(self.value, self.low, self.high)
    }
}

impl Quantity {
    /// Its value, or an end of its range; the value where it states no range.
    pub fn at(&self, extent: Extent) -> f64 {
        extent.of(self.value, self.low, self.high)
    }
}

/// How a number came about.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Provenance {
    /// With an instrument.
    Measured,
    /// Chosen so that a model meets published totals.
    Fitted,
    /// From the maker's documents.
    Datasheet,
    /// Measured on another machine and carried over by cycles and clock.
    Projected,
    /// Somebody's judgement.
    Assumed,
}

/// What a power or energy figure counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Boundary {
    /// What is drawn above idle.
    Marginal,
    /// The rails of the system on chip.
    SocRails,
    /// The wall socket.
    Wall,
    /// The source does not say.
    Unstated,
}

impl fmt::Display for Boundary {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Marginal => "marginal",
            Self::SocRails => "soc-rails",
            Self::Wall => "wall",
            Self::Unstated => "unstated",
        })
    }
}

/// Refuses a range that does not hold its value.
pub(super) fn check_ranges(
    value: &Json,
    path: &str,
    check: Check<'_>,
) -> Result<(), SettingsError> {
    match value {
        Json::Array(items) => items
            .iter()
            .enumerate()
            .try_for_each(|(index, item)| check_ranges(item, &format!("{path}[{index}]"), check)),
        Json::Object(table) => {
            let number = |name: &str| table.get(name).and_then(Json::as_f64);
            if let Some(value) = number("value") {
                let low = number("low").unwrap_or(value);
                let high = number("high").unwrap_or(value);
                let inside = low <= value && value <= high;
                let allowed = "it must lie between `low` and `high`";
                check.that(inside, &join(path, "value"), value, allowed)?;
            }
            table
                .iter()
                .try_for_each(|(name, item)| check_ranges(item, &join(path, name), check))
        }
        _ => Ok(()),
    }
}
