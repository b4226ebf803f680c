//! Writer of a recording: samples as they arrive, the metadata at the end.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use num_complex::Complex32;
use serde_json::{Map, Value, json};
use sha2::{Digest, Sha512};

use super::checksum::hexadecimal;
use super::metadata::{Annotation, Capture, Global, Metadata};
use super::samples::Datatype;
use crate::error::RecordingError;
use crate::file::{self as files, Partial};

/// Version of SigMF in written files.
const VERSION: &str = "1.2.0";

/// Metadata of a recording to be written.
#[derive(Debug, Clone, PartialEq)]
pub struct WriterSettings {
    /// Format of the samples in the file.
    pub datatype: Datatype,
    /// Number of channels.
    pub channels: usize,
    /// Sample rate in Hz.
    pub sample_rate_hz: f64,
    /// Centre frequency in Hz.
    pub frequency_hz: f64,
    /// Description of the recording.
    pub description: String,
    /// Extension keys for `global`.
    pub global: Map<String, Value>,
}

/// Recording that is being written. Without [`finish`](Self::finish), its files are removed.
#[derive(Debug)]
pub struct RecordingWriter {
    settings: WriterSettings,
    meta_file: PathBuf,
    data_file: PathBuf,
    partial: Partial,
    data: BufWriter<File>,
    hash: Sha512,
    captures: Vec<Capture>,
    annotations: Vec<Annotation>,
    length: u64,
    block: Vec<u8>,
}

impl RecordingWriter {
    /// Creates `STEM.sigmf-data`.
    ///
    /// # Errors
    /// [`RecordingError::Io`] if the file cannot be created; [`RecordingError::Value`] for a
    /// setting that a reader would reject.
    pub fn create(stem: &Path, settings: WriterSettings) -> Result<Self, RecordingError> {
        let file = |suffix: &str| {
            let mut name = stem.as_os_str().to_owned();
            name.push(suffix);
            PathBuf::from(name)
        };
        let (meta_file, data_file) = (file(".sigmf-meta"), file(".sigmf-data"));
        settings
            .metadata(String::new(), Vec::new(), Vec::new())
            .check(&meta_file)?;
        let (partial, data) = Partial::create(&data_file)?;
        Ok(Self {
            settings,
            meta_file,
            data_file,
            partial,
            data: BufWriter::new(data),
            hash: Sha512::new(),
            captures: Vec::new(),
            annotations: Vec::new(),
            length: 0,
            block: Vec::new(),
        })
    }

    /// Appends samples: one slice of equal length per channel.
    ///
    /// # Errors
    /// [`RecordingError::Write`] for a wrong number or length of slices; [`RecordingError::Io`].
    pub fn write(&mut self, channels: &[&[Complex32]]) -> Result<(), RecordingError> {
        let count = channels.first().map_or(0, |samples| samples.len());
        let equal = channels.iter().all(|samples| samples.len() == count);
        if channels.len() != self.settings.channels || !equal {
            return Err(RecordingError::Write {
                file: self.data_file.display().to_string(),
                message: format!(
                    "the channels have the lengths {:?}; the recording needs {} channels of equal length",
                    channels
                        .iter()
                        .map(|samples| samples.len())
                        .collect::<Vec<_>>(),
                    self.settings.channels
                ),
            });
        }
        self.block.clear();
        for index in 0..count {
            for sample in channels.iter().filter_map(|samples| samples.get(index)) {
                self.settings.datatype.encode(*sample, &mut self.block);
            }
        }
        self.hash.update(&self.block);
        self.length += count as u64;
        let data_file = &self.data_file;
        self.data
            .write_all(&self.block)
            .map_err(|source| RecordingError::io(data_file, source))
    }

    /// Starts a segment whose first sample has the number `global_index` since the receiver began
    /// to count. Samples before and after the start are not contiguous.
    pub fn begin_capture(&mut self, global_index: u64) {
        let index = ("core:global_index".to_owned(), json!(global_index));
        self.captures.push(Capture {
            sample_start: self.length,
            frequency_hz: Some(self.settings.frequency_hz),
            other: Map::from_iter([index]),
        });
    }

    /// Adds an annotation.
    pub fn annotate(&mut self, annotation: Annotation) {
        self.annotations.push(annotation);
    }

    /// Returns the number of samples per channel so far.
    pub fn length(&self) -> u64 {
        self.length
    }

    /// Ends the data and writes the metadata; returns its path.
    ///
    /// # Errors
    /// [`RecordingError::Io`].
    pub fn finish(mut self) -> Result<PathBuf, RecordingError> {
        let data_file = &self.data_file;
        self.data
            .flush()
            .map_err(|source| RecordingError::io(data_file, source))?;
        // SigMF requires annotations in order of their first sample.
        self.annotations
            .sort_by_key(|annotation| annotation.sample_start);
        let metadata =
            self.settings
                .metadata(hexadecimal(self.hash), self.captures, self.annotations);
        let text = serde_json::to_string_pretty(&metadata)
            .map_err(|error| RecordingError::io(&self.meta_file, error.into()))?;
        self.partial.finish()?;
        files::write(&self.meta_file, (text + "\n").as_bytes())?;
        Ok(self.meta_file)
    }
}

impl WriterSettings {
    fn metadata(
        &self,
        sha512: String,
        mut captures: Vec<Capture>,
        annotations: Vec<Annotation>,
    ) -> Metadata {
        if captures.is_empty() {
            captures.push(Capture {
                frequency_hz: Some(self.frequency_hz),
                ..Capture::default()
            });
        }
        let mut other = self.global.clone();
        other.insert(
            "core:recorder".to_owned(),
            json!(concat!("access-av ", env!("CARGO_PKG_VERSION"))),
        );
        let mut names: Vec<&str> = annotations
            .iter()
            .flat_map(|annotation| annotation.other.keys())
            .chain(self.global.keys())
            .filter_map(|key| key.split_once(':').map(|(name, _)| name))
            .filter(|name| *name != "core")
            .collect();
        names.sort_unstable();
        names.dedup();
        if !names.is_empty() {
            let extension = |name| json!({"name": name, "version": "0.1.0", "optional": true});
            other.insert(
                "core:extensions".to_owned(),
                names.into_iter().map(extension).collect(),
            );
        }
        Metadata {
            global: Global {
                datatype: self.datatype.name().to_owned(),
                sample_rate_hz: self.sample_rate_hz,
                version: Some(VERSION.to_owned()),
                channels: self.channels,
                sha512: Some(sha512),
                description: Some(self.description.clone()),
                other,
            },
            captures,
            annotations,
        }
    }
}
