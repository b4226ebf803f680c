//! Numbers with their range, provenance and source.

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::Value as Json;

use super::check::Check;
use super::error::SettingsError;
use super::read::join;

/// Power or energy value with its provenance.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Figure {
    /// Value, in the unit of its key.
    #[schemars(range(min = 0.0, max = 1e9))]
    pub value: f64,
    /// Lower end of the range.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = -1e9, max = 1e9))]
    pub low: Option<f64>,
    /// Upper end of the range.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0, max = 1e9))]
    pub high: Option<f64>,
    /// Provenance of the value.
    pub provenance: Provenance,
    /// Document, data set or fit that contains the value.
    pub source: String,
    /// Components that the value includes.
    pub boundary: Boundary,
}

/// Value with its provenance, for quantities other than power and energy.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Quantity {
    /// Value, in the unit of its key.
    #[schemars(range(min = 0.0, max = 1e12))]
    pub value: f64,
    /// Lower end of the range.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0, max = 1e12))]
    pub low: Option<f64>,
    /// Upper end of the range.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0, max = 1e12))]
    pub high: Option<f64>,
    /// Provenance of the value.
    pub provenance: Provenance,
    /// Document, data set or fit that contains the value.
    pub source: String,
}

/// Position within the range of a value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Extent {
    /// Lower end.
    Low,
    /// Nominal value.
    Value,
    /// Upper end.
    High,
}

impl Extent {
    /// Returns the opposite end of the range.
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
    /// Returns the nominal value or an end of its range. Without a range, the nominal value is
    /// returned.
    pub fn at(&self, extent: Extent) -> f64 {
        extent.of(self.value, self.low, self.high)
    }
}

impl Quantity {
    /// Returns the nominal value or an end of its range. Without a range, the nominal value is
    /// returned.
    pub fn at(&self, extent: Extent) -> f64 {
        extent.of(self.value, self.low, self.high)
    }
}

/// Provenance of a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Provenance {
    /// Measured with an instrument.
    Measured,
    /// Fitted so that a model reproduces published totals.
    Fitted,
    /// Taken from a data sheet.
    Datasheet,
    /// Measured on another computer, and scaled by cycles and clock frequency.
    Projected,
    /// Assumed.
    Assumed,
}

/// Components that a power or energy value includes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Boundary {
    /// Power above idle.
    Marginal,
    /// Supply rails of the system on chip.
    SocRails,
    /// Power at the wall socket.
    Wall,
    /// Not specified by the source.
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

/// Returns an error if a range does not contain its value.
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
