//! Price: one number, or a range with its source.

use std::fmt;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{Error, MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};

/// Uncertain price or carbon intensity.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Price {
    /// Minimum.
    pub low: f64,
    /// Value, in the unit of its key.
    pub value: f64,
    /// Maximum.
    pub high: f64,
    /// Source: an offer, a price list or an estimate.
    pub source: String,
}

const SOURCE: &str = "the plant's own figure";
const LEAST: f64 = 0.0;
const MOST: f64 = 1e9;

impl<'de> Deserialize<'de> for Price {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(Reader)
    }
}

struct Reader;

impl<'de> Visitor<'de> for Reader {
    type Value = Price;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(
            "a number without its unit or currency, or a table { low, value, high, source }",
        )
    }

    fn visit_f64<E: Error>(self, value: f64) -> Result<Price, E> {
        Ok(Price {
            low: value,
            value,
            high: value,
            source: SOURCE.to_owned(),
        })
    }

    fn visit_i64<E: Error>(self, value: i64) -> Result<Price, E> {
        self.visit_f64(value as f64)
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Price, A::Error> {
        let (mut low, mut value, mut high, mut source) = (None, None, None, None);
        while let Some(key) = map.next_key::<String>()? {
            match key.as_str() {
                "low" => low = Some(map.next_value()?),
                "value" => value = Some(map.next_value()?),
                "high" => high = Some(map.next_value()?),
                "source" => source = Some(map.next_value()?),
                _ => {
                    let known = &["low", "value", "high", "source"];
                    return Err(Error::unknown_field(&key, known));
                }
            }
        }
        let value = value.ok_or_else(|| Error::missing_field("value"))?;
        Ok(Price {
            low: low.unwrap_or(value),
            value,
            high: high.unwrap_or(value),
            source: source.unwrap_or_else(|| SOURCE.to_owned()),
        })
    }
}

impl JsonSchema for Price {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Price".into()
    }

    fn json_schema(_generator: &mut SchemaGenerator) -> Schema {
        let number = json_schema!({ "type": "number", "minimum": LEAST, "maximum": MOST });
        json_schema!({
            "description": "A number, or a range with its source.",
            "oneOf": [
                number,
                {
                    "type": "object",
                    "properties": {
                        "low": number, "value": number, "high": number,
                        "source": { "type": "string" },
                    },
                    "required": ["value"],
                    "additionalProperties": false,
                },
            ],
        })
    }
}
