//! Usual ranges of numbers, one row each.

use serde::Serialize;
use serde_json::Value;

use super::warning::Warning;

/// Usual range of a number.
#[derive(Debug, Clone, Copy)]
pub struct Usual {
    /// Path of the key; `[]` denotes every entry of a list, `[2]` the entry at index 2.
    pub key: &'static str,
    /// Lower and upper end of the usual range.
    pub within: [f64; 2],
    /// Reason for the range.
    pub why: &'static str,
    /// Suggestion for an unusual value.
    pub write: fn(f64) -> String,
}

/// Returns a warning for every number outside its usual range.
pub fn unusual(settings: &impl Serialize, rows: &[Usual]) -> Vec<Warning> {
    let settings = serde_json::to_value(settings).unwrap_or_default();
    let mut found = Vec::new();
    for row in rows {
        let steps: Vec<&str> = row.key.split('.').collect();
        visit(&settings, &steps, String::new(), &mut |key, number| {
            let [least, most] = row.within;
            if !(least..=most).contains(&number) {
                found.push(Warning {
                    key,
                    value: number.to_string(),
                    why: row.why.to_owned(),
                    write: (row.write)(number),
                });
            }
        });
    }
    found
}

/// Calls `report` with the path and the value of every number at the path `steps`.
fn visit(parent: &Value, steps: &[&str], path: String, report: &mut impl FnMut(String, f64)) {
    let Some((step, rest)) = steps.split_first() else {
        if let Some(number) = parent.as_f64() {
            report(path, number);
        }
        return;
    };
    let (name, index_text) = step.split_once('[').unwrap_or((step, ""));
    let Some(value) = parent.get(name) else {
        return;
    };
    let path = if path.is_empty() {
        name.to_owned()
    } else {
        format!("{path}.{name}")
    };
    if index_text.is_empty() {
        return visit(value, rest, path, report);
    }
    let wanted: Option<usize> = index_text.trim_end_matches(']').parse().ok();
    for (index, item) in value.as_array().into_iter().flatten().enumerate() {
        if wanted.is_none_or(|wanted| wanted == index) {
            visit(item, rest, format!("{path}[{index}]"), report);
        }
    }
}

/// Returns a number with five significant digits, for display.
pub fn rounded(value: f64) -> f64 {
    format!("{value:.4e}").parse().unwrap_or(value)
}

/// Returns the suggestion for an angle that is probably in degrees.
pub fn as_degrees(value: f64) -> String {
    let rad = value.to_radians();
    format!("write radians: {value} degrees are {rad:.4}")
}

/// Returns the suggestion for a fraction that is probably in percent.
pub fn as_percent(value: f64) -> String {
    format!(
        "write a share of 1: {value} % are {}",
        rounded(value / 100.0)
    )
}

/// Returns the suggestion for a length that is probably in millimetres.
pub fn as_millimetres(value: f64) -> String {
    format!("write metres: {value} mm are {}", rounded(value / 1000.0))
}

/// Returns the suggestion for a standard deviation that is probably in centimetres or millimetres.
pub fn as_centimetres(value: f64) -> String {
    format!(
        "write metres: {value} cm are {}, {value} mm are {}",
        rounded(value / 100.0),
        rounded(value / 1000.0)
    )
}

/// Returns the suggestion for milliseconds that are probably in seconds.
pub fn as_milliseconds(value: f64) -> String {
    format!(
        "write milliseconds: {value} s are {}",
        rounded(value * 1000.0)
    )
}
