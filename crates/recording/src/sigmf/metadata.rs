//! Metadata of a `.sigmf-meta` file.

use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use super::frequency;
use crate::error::RecordingError;
use crate::file as files;
use crate::foreign::text_of;

/// Maximum number of channels.
const MAX_CHANNELS: usize = 1024;
/// Maximum sample rate of SigMF in Hz.
const MAX_SAMPLE_RATE_HZ: f64 = 1e12;

/// Content of the file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Metadata {
    /// Properties of all samples.
    pub global: Global,
    /// Segments of samples with equal receiver settings, ordered by `sample_start`.
    #[serde(default)]
    pub captures: Vec<Capture>,
    /// Annotations of segments of samples, ordered by `sample_start`.
    #[serde(default)]
    pub annotations: Vec<Annotation>,
}

/// `global`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Global {
    /// Format of a sample, for example `cf32_le`.
    #[serde(rename = "core:datatype")]
    pub datatype: String,
    /// Sample rate in Hz.
    #[serde(rename = "core:sample_rate")]
    pub sample_rate_hz: f64,
    /// Version of SigMF.
    #[serde(
        rename = "core:version",
        default,
        skip_serializing_if = "Option::is_none"
    )]
    pub version: Option<String>,
    /// Number of channels, interleaved sample by sample.
    #[serde(rename = "core:num_channels", default = "one")]
    pub channels: usize,
    /// SHA-512 of the data file in hexadecimal form.
    #[serde(
        rename = "core:sha512",
        default,
        skip_serializing_if = "Option::is_none"
    )]
    pub sha512: Option<String>,
    /// Description of the recording.
    #[serde(
        rename = "core:description",
        default,
        skip_serializing_if = "Option::is_none"
    )]
    pub description: Option<String>,
    /// Other keys.
    #[serde(flatten)]
    pub other: Map<String, Value>,
}

const fn one() -> usize {
    1
}

/// Element of `captures`.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Capture {
    /// Index of the first sample.
    #[serde(rename = "core:sample_start")]
    pub sample_start: u64,
    /// Centre frequency in Hz.
    #[serde(
        rename = "core:frequency",
        default,
        skip_serializing_if = "Option::is_none"
    )]
    pub frequency_hz: Option<f64>,
    /// Other keys.
    #[serde(flatten)]
    pub other: Map<String, Value>,
}

impl Capture {
    /// Returns the index of the first sample since the start of the receiver (`core:global_index`).
    pub fn global_index(&self) -> Option<u64> {
        self.other.get("core:global_index").and_then(Value::as_u64)
    }

    /// Returns the date of the first sample as written (`core:datetime`).
    pub fn datetime(&self) -> Option<&str> {
        self.other.get("core:datetime").and_then(Value::as_str)
    }
}

/// Element of `annotations`.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Annotation {
    /// Index of the first sample.
    #[serde(rename = "core:sample_start")]
    pub sample_start: u64,
    /// Number of samples [default: up to the end of the capture].
    #[serde(
        rename = "core:sample_count",
        default,
        skip_serializing_if = "Option::is_none"
    )]
    pub sample_count: Option<u64>,
    /// Lower edge of the band in Hz.
    #[serde(
        rename = "core:freq_lower_edge",
        default,
        skip_serializing_if = "Option::is_none"
    )]
    pub freq_lower_edge_hz: Option<f64>,
    /// Upper edge of the band in Hz.
    #[serde(
        rename = "core:freq_upper_edge",
        default,
        skip_serializing_if = "Option::is_none"
    )]
    pub freq_upper_edge_hz: Option<f64>,
    /// Short label.
    #[serde(
        rename = "core:label",
        default,
        skip_serializing_if = "Option::is_none"
    )]
    pub label: Option<String>,
    /// Other keys: `nr:ssb`, `aoa:truth`.
    #[serde(flatten)]
    pub other: Map<String, Value>,
}

impl Metadata {
    /// Reads and checks a `.sigmf-meta` file.
    ///
    /// # Errors
    /// [`RecordingError`] with the key that is missing, has a wrong type or is out of range.
    pub fn read(file: &Path) -> Result<Self, RecordingError> {
        Self::parse(&read_text(file)?, file)
    }

    pub(super) fn parse(text: &[u8], file: &Path) -> Result<Self, RecordingError> {
        let syntax = |message: String| RecordingError::Syntax {
            file: file.display().to_string(),
            format: "JSON",
            message,
        };
        let text = text_of(text, "JSON").map_err(syntax)?;
        let text = text.trim_start_matches('\u{feff}');
        let json: Value = serde_json::from_str(text).map_err(|error| syntax(error.to_string()))?;
        let metadata: Self = serde_path_to_error::deserialize(json).map_err(|error| {
            explain(file, &error.path().to_string(), &error.inner().to_string())
        })?;
        metadata.check(file)?;
        Ok(metadata)
    }

    pub(super) fn check(&self, file: &Path) -> Result<(), RecordingError> {
        let global = &self.global;
        if !(global.sample_rate_hz > 0.0 && global.sample_rate_hz <= MAX_SAMPLE_RATE_HZ) {
            let allowed = "it must be a positive number of hertz, at most 1e12";
            return Err(RecordingError::value(
                file,
                "global.core:sample_rate",
                global.sample_rate_hz,
                allowed,
            ));
        }
        if !(1..=MAX_CHANNELS).contains(&global.channels) {
            let allowed = format!("it must be an integer from 1 to {MAX_CHANNELS}");
            return Err(RecordingError::value(
                file,
                "global.core:num_channels",
                global.channels,
                allowed,
            ));
        }
        let unsupported = [
            (
                "core:metadata_only",
                "recordings without data have no samples to read",
            ),
            (
                "core:dataset",
                "only data in a .sigmf-data file of the same name is read",
            ),
            (
                "core:trailing_bytes",
                "only conforming data, without trailing bytes, is read",
            ),
        ];
        for (key, allowed) in unsupported {
            if let Some(value) = global.other.get(key).filter(|value| !is_unset(value)) {
                return Err(RecordingError::value(
                    file,
                    format!("global.{key}"),
                    value,
                    allowed,
                ));
            }
        }
        for (index, capture) in self.captures.iter().enumerate() {
            let key = |name| format!("captures[{index}].{name}");
            let header = capture.other.get("core:header_bytes");
            if let Some(value) = header.filter(|value| !is_unset(value)) {
                let allowed = "only conforming data, without header bytes, is read";
                return Err(RecordingError::value(
                    file,
                    key("core:header_bytes"),
                    value,
                    allowed,
                ));
            }
            if let Some(hz) = capture.frequency_hz {
                frequency::check_centre_hz(hz).map_err(|allowed| {
                    RecordingError::value(file, key("core:frequency"), hz, allowed)
                })?;
            }
            let before = index
                .checked_sub(1)
                .and_then(|before| self.captures.get(before));
            if before.is_some_and(|before| before.sample_start > capture.sample_start) {
                let allowed = "captures must be in order of their first sample";
                return Err(RecordingError::value(
                    file,
                    key("core:sample_start"),
                    capture.sample_start,
                    allowed,
                ));
            }
            if let Some(before) = before {
                check_frequencies(before, capture).map_err(|allowed| {
                    RecordingError::value(
                        file,
                        key("core:sample_start"),
                        capture.sample_start,
                        allowed,
                    )
                })?;
            }
            let number = capture.other.get("core:global_index");
            if let Some(value) = number.filter(|it| !it.is_null() && it.as_u64().is_none()) {
                let allowed = "it must be an integer of at least 0";
                return Err(RecordingError::value(
                    file,
                    key("core:global_index"),
                    value,
                    allowed,
                ));
            }
        }
        Ok(())
    }
}

/// Checks that two captures with one first sample have one centre frequency.
fn check_frequencies(before: &Capture, capture: &Capture) -> Result<(), String> {
    match (before.frequency_hz, capture.frequency_hz) {
        (Some(a), Some(b)) if before.sample_start == capture.sample_start && a != b => {
            Err(format!(
                "the previous capture begins at this sample too, with core:frequency {a} in place of {b}"
            ))
        }
        _ => Ok(()),
    }
}

/// Reads a `.sigmf-meta` file as text.
///
/// # Errors
/// [`RecordingError::Io`].
pub(super) fn read_text(file: &Path) -> Result<Vec<u8>, RecordingError> {
    files::read(file, files::MAX_BYTES).map_err(|source| RecordingError::io(file, source))
}

fn is_unset(value: &Value) -> bool {
    matches!(value, Value::Null | Value::Bool(false)) || value.as_u64() == Some(0)
}

/// Converts a message of serde to the fields of the error.
fn explain(file: &Path, path: &str, message: &str) -> RecordingError {
    let at = |name: &str| match path {
        "." | "" => name.to_owned(),
        path => format!("{path}.{name}"),
    };
    if let Some(name) = message
        .strip_prefix("missing field `")
        .and_then(|rest| rest.split('`').next())
    {
        return RecordingError::Missing {
            file: file.display().to_string(),
            key: at(name),
            allowed: "SigMF metadata must contain it".to_owned(),
        };
    }
    // Format of the message: "invalid type: string "x", expected f64"
    let (found, expected) = message
        .split_once(", expected ")
        .unwrap_or((message, "another type"));
    let found = found.split_once(": ").map_or(found, |(_, found)| found);
    let key = if path == "." { "(top level)" } else { path };
    let expected = match expected {
        "f64" | "f32" => "a number",
        "u64" | "usize" | "u32" => "an integer of at least 0",
        "i64" | "i32" => "an integer",
        "a sequence" => "a list",
        other if other.starts_with("struct") || other == "a map" => "a JSON object",
        other => other,
    };
    let found = match found {
        "sequence" => "a list",
        "map" => "a JSON object",
        other => other,
    };
    RecordingError::value(file, key, found, format!("it must be {expected}"))
}
