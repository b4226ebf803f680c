//! What can be wrong with a recorded file, said so that it can be put right.

use std::io;

use thiserror::Error;

/// An unusable recording. `file` is the path; `key` the place inside, as `captures[1].core:frequency`.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum RecordingError {
    /// The file system refuses.
    #[error("{file}: {source}")]
    Io {
        /// The file.
        file: String,
        /// Why.
        source: io::Error,
    },
    /// Metadata without data, or data without metadata.
    #[error("{present}: its other half {missing} is missing; a SigMF recording needs both")]
    HalfMissing {
        /// The file that is there.
        present: String,
        /// The file that is not.
        missing: String,
    },
    /// Neither half is there.
    #[error("no recording {file}: neither .sigmf-meta nor .sigmf-data exists")]
    NoSuchRecording {
        /// What was asked for.
        file: String,
    },
    /// Not text of the announced format.
    #[error("{file}: not valid {format}: {message}")]
    Syntax {
        /// The file.
        file: String,
        /// "JSON", "TOML", "CSV" or "MCAP".
        format: &'static str,
        /// The parser's message, with its place.
        message: String,
    },
    /// A key that must be there is not.
    #[error("{file}: `{key}` is missing; {allowed}")]
    Missing {
        /// The file.
        file: String,
        /// The key.
        key: String,
        /// What should stand there.
        allowed: String,
    },
    /// A value of the wrong type, out of range, or at odds with another.
    #[error("{file}: `{key}` is {value}; {allowed}")]
    Value {
        /// The file.
        file: String,
        /// The key.
        key: String,
        /// Its value.
        value: String,
        /// What is allowed.
        allowed: String,
    },
    /// Data that ends within a sample.
    #[error(
        "{file}: truncated: {bytes} bytes are not a positive multiple of {frame_bytes} \
         ({channels} channels of {datatype})"
    )]
    PartialFrame {
        /// The data file.
        file: String,
        /// Its length.
        bytes: u64,
        /// Bytes of one sample of all channels.
        frame_bytes: u64,
        /// Number of channels in the file.
        channels: usize,
        /// The samples' datatype.
        datatype: &'static str,
    },
    /// Raw files of different lengths.
    #[error(
        "{file} holds {samples} samples, {first} holds {expected}; channels must be equally long"
    )]
    UnequalChannels {
        /// The file that differs.
        file: String,
        /// Its samples.
        samples: u64,
        /// The first channel's file.
        first: String,
        /// Samples of the first channel.
        expected: u64,
    },
    /// Samples asked for that are not there.
    #[error("{file}: samples {start} to {start} + {count} asked for; it has {length}")]
    OutOfRange {
        /// The data file.
        file: String,
        /// First sample asked for.
        start: u64,
        /// Number asked for.
        count: u64,
        /// Samples per channel.
        length: u64,
    },
    /// A sample that is not a number, or infinite.
    #[error("{file}: sample {sample} of channel {channel} is not finite")]
    NotFinite {
        /// The data file.
        file: String,
        /// Index of the sample.
        sample: u64,
        /// Index of the channel.
        channel: usize,
    },
    /// Samples to be written that do not fit the recording.
    #[error("{file}: {message}")]
    Write {
        /// The file.
        file: String,
        /// What does not fit.
        message: String,
    },
}

impl RecordingError {
    /// What the file system says of a file.
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
