//! Required accuracy in the form `"0.3 m 99 %"`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Maximum horizontal error and the fraction of time for which it is required.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "String", into = "String")]
#[schemars(with = "String")]
pub struct Target {
    text: String,
    error_m: f64,
    percent: f64,
}

const UNITS_M: [(&str, f64); 3] = [("mm", 1e-3), ("cm", 1e-2), ("m", 1.0)];

impl Target {
    /// Returns the maximum horizontal error in metres.
    pub const fn error_m(&self) -> f64 {
        self.error_m
    }

    /// Returns the required fraction of time in percent.
    pub const fn percent(&self) -> f64 {
        self.percent
    }
}

impl TryFrom<String> for Target {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        let parsed = parse(&text).ok_or_else(|| {
            format!(
                "{:?} is not a target; write a length from 1 mm to 100 m and a share from 50 % to \
                 99.9 %, such as \"0.3 m 99 %\"",
                text.chars().take(40).collect::<String>()
            )
        });
        parsed.map(|(error_m, percent)| Self {
            text,
            error_m,
            percent,
        })
    }
}

impl From<Target> for String {
    fn from(target: Target) -> Self {
        target.text
    }
}

fn parse(text: &str) -> Option<(f64, f64)> {
    let (share, rest) = text
        .trim()
        .strip_suffix('%')?
        .trim_end()
        .rsplit_once(|sign: char| sign.is_whitespace() || sign == ',')
        .map(|(length, share)| (share, length))?;
    let length = rest.trim_end_matches(|sign: char| sign.is_whitespace() || sign == ',');
    let (unit, metres) = UNITS_M.iter().find(|(unit, _)| length.ends_with(unit))?;
    let number: f64 = length.strip_suffix(unit)?.trim().parse().ok()?;
    let (error_m, percent) = (number * metres, share.parse().ok()?);
    let sound = (1e-3..=100.0).contains(&error_m) && (50.0..=99.9).contains(&percent);
    sound.then_some((error_m, percent))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn targets_are_parsed_in_common_notations() {
        for text in ["0.3 m 99 %", "0.3m 99%", "30 cm, 99 %", " 300 mm 99.0 % "] {
            let target = Target::try_from(text.to_owned()).unwrap();
            assert!((target.error_m() - 0.3).abs() < 1e-12, "{text}");
            assert!((target.percent() - 99.0).abs() < 1e-12, "{text}");
        }
        for text in [
            "",
            "0.3",
            "0.3 m",
            "99 %",
            "0.3 ft 99 %",
            "0,3 m 99 %",
            "0.3 m 101 %",
            "NaN m 99 %",
            "-1 m 99 %",
            "0.3 m 0.99 %",
        ] {
            assert!(Target::try_from(text.to_owned()).is_err(), "{text}");
        }
    }
}
