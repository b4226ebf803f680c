//! Errors of recorded files.

use std::io;

use thiserror::Error;

/// Unusable recording. `file` is the path, and `key` is the position in the file, for example
/// `captures[1].core:frequency`.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum RecordingError {
    /// Error of the file system.
    #[error("{file}: {source}")]
    Io {
        /// Path of the file.
        file: String,
        /// Cause.
        source: io::Error,
    },
    /// SigMF metadata without data, or data without metadata.
    #[error("{present}: {missing} is missing; a SigMF recording needs both files")]
    HalfMissing {
        /// Existing file.
        present: String,
        /// Missing file.
        missing: String,
    },
    /// Neither metadata nor data exist.
    #[error("no recording {file}: neither .sigmf-meta nor .sigmf-data exists")]
    NoSuchRecording {
        /// Path of the recording.
        file: String,
    },
    /// The file is not valid in its format.
    #[error("{file}: not valid {format}: {message}")]
    Syntax {
        /// Path of the file.
        file: String,
        /// Format: "JSON", "TOML", "CSV" or "MCAP".
        format: &'static str,
        /// Message of the parser with the position.
        message: String,
    },
    /// A required key is missing.
    #[error("{file}: `{key}` is missing; {allowed}")]
    Missing {
        /// Path of the file.
        file: String,
        /// Name of the key.
        key: String,
        /// Allowed values.
        allowed: String,
    },
    /// A value has a wrong type, is out of range, or contradicts another value.
    #[error("{file}: `{key}` is {value}; {allowed}")]
    Value {
        /// Path of the file.
        file: String,
        /// Name of the key.
        key: String,
        /// Value of the key.
        value: String,
        /// Allowed values.
        allowed: String,
    },
    /// Data that ends within a sample.
    #[error(
        "{file}: truncated: {bytes} bytes are not a positive multiple of {frame_bytes} \
         ({channels} channels of {datatype})"
    )]
    PartialFrame {
        /// Path of the data file.
        file: String,
        /// Length of the file in bytes.
        bytes: u64,
        /// Number of bytes of one sample of all channels.
        frame_bytes: u64,
        /// Number of channels in the file.
        channels: usize,
        /// Datatype of the samples.
        datatype: &'static str,
    },
    /// Raw files have different lengths.
    #[error(
        "{file} holds {samples} samples, {first} holds {expected}; channels must be equally long"
    )]
    UnequalChannels {
        /// Path of the differing file.
        file: String,
        /// Number of samples in the file.
        samples: u64,
        /// Path of the first channel's file.
        first: String,
        /// Number of samples of the first channel.
        expected: u64,
    },
    /// The requested samples do not exist.
    #[error("{file}: samples {start} to {start} + {count} requested; the recording has {length}")]
    OutOfRange {
        /// Path of the data file.
        file: String,
        /// First requested sample.
        start: u64,
        /// Number of requested samples.
        count: u64,
        /// Number of samples per channel.
        length: u64,
    },
    /// A sample is NaN or infinite.
    #[error("{file}: sample {sample} of channel {channel} is not finite")]
    NotFinite {
        /// Path of the data file.
        file: String,
        /// Index of the sample.
        sample: u64,
        /// Index of the channel.
        channel: usize,
    },
    /// Samples to be written do not match the recording.
    #[error("{file}: {message}")]
    Write {
        /// Path of the file.
        file: String,
        /// Description of the mismatch.
        message: String,
    },
}

impl RecordingError {
    /// Creates an error of the file system.
    pub fn io(file: &std::path::Path, source: io::Error) -> Self {
        Self::Io {
            file: file.display().to_string(),
            source,
        }
    }

    pub(crate) fn value(
        file: &std::path::Path,
        key: impl Into<String>,
        value: impl std::fmt::Display,
        allowed: impl Into<String>,
    ) -> Self {
        Self::Value {
            file: file.display().to_string(),
            key: key.into(),
            value: value.to_string(),
            allowed: allowed.into(),
        }
    }
}
