//! Comparison of numbers with the ranges of the JSON Schema.

use serde_json::{Map, Value};

use super::check::Check;
use super::error::SettingsError;
use super::read::join;

/// Returns an error for the first number, or list length, outside its range in `schema`.
///
/// # Errors
/// [`SettingsError::Value`] naming the key and the range.
pub fn check_limits(value: &Value, schema: &Value, check: Check<'_>) -> Result<(), SettingsError> {
    let empty = Map::new();
    let definitions = schema.get("$defs").and_then(Value::as_object);
    let walk = Walk {
        definitions: definitions.unwrap_or(&empty),
        check,
    };
    walk.visit(value, schema, "")
}

struct Walk<'a> {
    definitions: &'a Map<String, Value>,
    check: Check<'a>,
}

impl Walk<'_> {
    fn visit(&self, value: &Value, schema: &Value, path: &str) -> Result<(), SettingsError> {
        let target = schema
            .get("$ref")
            .and_then(Value::as_str)
            .and_then(|target| self.definitions.get(target.strip_prefix("#/$defs/")?));
        if let Some(target) = target {
            self.visit(value, target, path)?;
        }
        for key in ["oneOf", "anyOf", "allOf"] {
            for variant in schema
                .get(key)
                .and_then(Value::as_array)
                .into_iter()
                .flatten()
            {
                if is_selected_variant(value, variant) {
                    self.visit(value, variant, path)?;
                }
            }
        }
        match value {
            Value::Number(number) => self.number(number.as_f64(), schema, path),
            Value::Array(items) => {
                self.length(items.len(), schema, path)?;
                let each = schema.get("items");
                items.iter().enumerate().try_for_each(|(index, item)| {
                    let each = each.unwrap_or(&Value::Null);
                    self.visit(item, each, &format!("{path}[{index}]"))
                })
            }
            Value::Object(table) => table.iter().try_for_each(|(name, item)| {
                let named = schema.get("properties").and_then(|all| all.get(name));
                match named.or_else(|| schema.get("additionalProperties")) {
                    Some(schema) => self.visit(item, schema, &join(path, name)),
                    None => Ok(()),
                }
            }),
            _ => Ok(()),
        }
    }

    fn number(&self, number: Option<f64>, schema: &Value, path: &str) -> Result<(), SettingsError> {
        let limit = |name: &str| schema.get(name).and_then(Value::as_f64);
        let Some(number) = number else {
            return Ok(());
        };
        if let Some(choices) = schema.get("enum").and_then(Value::as_array) {
            let choices: Vec<f64> = choices.iter().filter_map(Value::as_f64).collect();
            let listed: Vec<String> = choices.iter().map(f64::to_string).collect();
            let allowed = format!("it must be one of {}", listed.join(", "));
            self.check
                .that(choices.contains(&number), path, number, &allowed)?;
        }
        let (least, most) = (limit("minimum"), limit("maximum"));
        let inside =
            least.is_none_or(|least| number >= least) && most.is_none_or(|most| number <= most);
        let allowed = format!("{}{}", allowed(least, most), unit_hint(path, number));
        self.check.that(inside, path, number, &allowed)
    }

    fn length(&self, length: usize, schema: &Value, path: &str) -> Result<(), SettingsError> {
        let limit = |name: &str| schema.get(name).and_then(Value::as_u64);
        let least = limit("minItems").unwrap_or(0);
        let most = limit("maxItems").unwrap_or(u64::MAX);
        let allowed = format!("{least} to {most} entries are allowed");
        self.check.that(
            (least..=most).contains(&(length as u64)),
            path,
            format!("a list of {length}"),
            &allowed,
        )
    }
}

/// Returns a hint if a number that is out of range is plausible in another unit.
fn unit_hint(path: &str, value: f64) -> String {
    let key = path.rsplit('.').next().unwrap_or(path);
    let key = key.split('[').next().unwrap_or(key);
    let is_share = ["confidence", "probability", "share", "scale_std"]
        .iter()
        .any(|it| key.ends_with(it));
    if !(1e-6..=1e11).contains(&value.abs()) {
        return String::new(); // of no unit
    }
    let (large, small) = (value.abs() > 1.0, value.abs() < 1.0);
    let hint = if key.ends_with("_rad") || key.ends_with("_radps") {
        format!(
            "it is in radians, and {value} degrees are {:.4}",
            value.to_radians()
        )
    } else if key.ends_with("_wavelengths") && small {
        "it is in wavelengths, not metres: half a wavelength is 0.5".to_owned()
    } else if key.ends_with("_mhz") && value < 100.0 {
        format!("it is in MHz, and {value} GHz are {}", value * 1e3)
    } else if key.ends_with("_mhz") {
        format!("it is in MHz, and {value} Hz are {}", value * 1e-6)
    } else if is_share && large {
        format!("it is a share of 1, and {value} % are {}", value / 100.0)
    } else if key.ends_with("_m") && large {
        format!("it is in metres, and {value} mm are {}", value / 1e3)
    } else if key.ends_with("_ms") {
        format!("it is in milliseconds, and {value} s are {}", value * 1e3)
    } else if key.ends_with("_s") && large {
        format!("it is in seconds, and {value} ms are {}", value / 1e3)
    } else {
        return String::new();
    };
    format!("; {hint}")
}

/// Whether `variant` is the selected one: its tag has the value's tag, or it has no tag.
fn is_selected_variant(value: &Value, variant: &Value) -> bool {
    let tags = variant.get("properties").and_then(Value::as_object);
    tags.into_iter().flatten().all(|(name, schema)| {
        schema
            .get("const")
            .is_none_or(|tag| value.get(name) == Some(tag))
    })
}

fn allowed(least: Option<f64>, most: Option<f64>) -> String {
    match (least, most) {
        (Some(least), Some(most)) => format!("it must be between {least} and {most}"),
        (Some(least), None) => format!("it must not be below {least}"),
        (None, Some(most)) => format!("it must not be above {most}"),
        (None, None) => String::new(),
    }
}
