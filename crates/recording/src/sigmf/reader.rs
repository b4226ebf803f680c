//! Samples of a recording, as many at a time as is asked for.

use std::fmt;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use num_complex::Complex32;

use super::checksum;
use super::metadata::{Annotation, Capture, Global, Metadata};
use super::samples::Datatype;
use crate::error::RecordingError;
use crate::file as files;

/// Bytes read from a file at once.
const BLOCK_BYTES: usize = 1 << 18;

/// What looks wrong with a recording but does not keep it from being read.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum RecordingWarning {
    /// The data is not what the metadata was written for.
    ChecksumMismatch {
        /// The data file.
        file: String,
    },
    /// An annotation reaches beyond the last sample: the data may have been cut off.
    AnnotationBeyondEnd {
        /// Index of the annotation.
        annotation: usize,
        /// Samples per channel.
        length: u64,
    },
    /// The centre frequency is not said.
    NoFrequency,
}

impl fmt::Display for RecordingWarning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::ChecksumMismatch { file } => {
                write!(
                    f,
                    "{file}: its SHA-512 is not `global.core:sha512`; it may be damaged"
                )
            }
            Self::AnnotationBeyondEnd { annotation, length } => write!(
                f,
                "annotations[{annotation}] reaches beyond the last of {length} samples; \
                 the data may have been cut off"
            ),
            Self::NoFrequency => f.write_str("no capture states `core:frequency`"),
        }
    }
}

/// An open recording of one or more channels.
#[derive(Debug)]
pub struct Recording {
    metadata: Metadata,
    datatype: Datatype,
    /// One file with all channels interleaved, or one per channel.
    files: Vec<(PathBuf, File)>,
    length: u64,
    warnings: Vec<RecordingWarning>,
    block: Vec<u8>,
}

impl Recording {
    /// Opens a SigMF recording by its name, its `.sigmf-meta` or its `.sigmf-data`, and compares
    /// the data's SHA-512 with the metadata's, which reads all of it once.
    ///
    /// # Errors
    /// [`RecordingError`] when a half is missing, the metadata is not usable, or the data is empty
    /// or ends within a sample.
    pub fn open(path: impl AsRef<Path>) -> Result<Self, RecordingError> {
        let mut recording = Self::open_unverified(path)?;
        recording.verify()?;
        Ok(recording)
    }

    /// As [`open`](Self::open), without reading the data for its checksum.
    ///
    /// # Errors
    /// Those of [`open`](Self::open).
    pub fn open_unverified(path: impl AsRef<Path>) -> Result<Self, RecordingError> {
        let (meta_file, data_file) = both_halves(path.as_ref())?;
        let metadata = Metadata::read(&meta_file)?;
        let datatype = Datatype::from_name(&metadata.global.datatype, &meta_file)?;
        let (file, length) = open_data(&data_file, metadata.global.channels, datatype)?;
        for (index, capture) in metadata.captures.iter().enumerate() {
            if capture.sample_start >= length {
                return Err(RecordingError::value(
                    &meta_file,
                    format!("captures[{index}].core:sample_start"),
                    capture.sample_start,
                    format!("it must be below {length}, the number of samples in the data"),
                ));
            }
        }
        Ok(Self::new(
            metadata,
            datatype,
            vec![(data_file, file)],
            length,
        ))
    }

    /// Opens raw `cf32_le` files, one per channel.
    ///
    /// # Errors
    /// [`RecordingError`] when a file cannot be read, ends within a sample or is not as long as the
    /// others, or the rate is not a positive number.
    pub fn open_raw<P: AsRef<Path>>(
        paths: &[P],
        sample_rate_hz: f64,
        frequency_hz: Option<f64>,
    ) -> Result<Self, RecordingError> {
        let first = paths
            .first()
            .map_or(Path::new("(raw files)"), AsRef::as_ref);
        let metadata = Metadata {
            global: Global {
                datatype: Datatype::Cf32Le.name().to_owned(),
                sample_rate_hz,
                version: None,
                channels: paths.len(),
                sha512: None,
                description: None,
                other: serde_json::Map::new(),
            },
            captures: vec![Capture {
                frequency_hz,
                ..Capture::default()
            }],
            annotations: Vec::new(),
        };
        metadata.check(first)?;
        let mut files = Vec::with_capacity(paths.len());
        let mut length = None;
        for path in paths {
            let path = path.as_ref();
            let (file, samples) = open_data(path, 1, Datatype::Cf32Le)?;
            let expected = *length.get_or_insert(samples);
            if samples != expected {
                return Err(RecordingError::UnequalChannels {
                    file: path.display().to_string(),
                    samples,
                    first: first.display().to_string(),
                    expected,
                });
            }
            files.push((path.to_owned(), file));
        }
        Ok(Self::new(
            metadata,
            Datatype::Cf32Le,
            files,
            length.unwrap_or(0),
        ))
    }

    fn new(
        metadata: Metadata,
        datatype: Datatype,
        files: Vec<(PathBuf, File)>,
        length: u64,
    ) -> Self {
        let mut warnings = Vec::new();
        for (annotation, it) in metadata.annotations.iter().enumerate() {
            if it.sample_start.saturating_add(it.sample_count.unwrap_or(1)) > length {
                warnings.push(RecordingWarning::AnnotationBeyondEnd { annotation, length });
            }
        }
        if !metadata
            .captures
            .iter()
            .any(|capture| capture.frequency_hz.is_some())
        {
            warnings.push(RecordingWarning::NoFrequency);
        }
        Self {
            metadata,
            datatype,
            files,
            length,
            warnings,
            block: Vec::new(),
        }
    }

    fn verify(&mut self) -> Result<(), RecordingError> {
        let (Some(expected), Some((path, _))) = (&self.metadata.global.sha512, self.files.first())
        else {
            return Ok(());
        };
        let found = checksum::of_file(path).map_err(|source| RecordingError::io(path, source))?;
        if !found.eq_ignore_ascii_case(expected) {
            let file = path.display().to_string();
            self.warnings
                .push(RecordingWarning::ChecksumMismatch { file });
        }
        Ok(())
    }

    /// The metadata.
    pub fn metadata(&self) -> &Metadata {
        &self.metadata
    }

    /// The first data file.
    pub fn data_file(&self) -> &Path {
        self.files.first().map_or(Path::new(""), |(path, _)| path)
    }

    /// Samples per second and channel.
    pub fn sample_rate_hz(&self) -> f64 {
        self.metadata.global.sample_rate_hz
    }

    /// Centre frequency of the first capture that states one, in Hz.
    pub fn centre_frequency_hz(&self) -> Option<f64> {
        self.metadata
            .captures
            .iter()
            .find_map(|capture| capture.frequency_hz)
    }

    /// Number of channels.
    pub fn channels(&self) -> usize {
        self.metadata.global.channels
    }

    /// Samples per channel.
    pub fn length(&self) -> u64 {
        self.length
    }

    /// Format of the samples in the file.
    pub fn datatype(&self) -> Datatype {
        self.datatype
    }

    /// What is known of single stretches.
    pub fn annotations(&self) -> &[Annotation] {
        &self.metadata.annotations
    }

    /// What looks wrong.
    pub fn warnings(&self) -> &[RecordingWarning] {
        &self.warnings
    }

    /// Reads `count` samples of every channel from sample `start` on; `channels` becomes as many
    /// vectors of that length.
    ///
    /// # Errors
    /// [`RecordingError::OutOfRange`], [`RecordingError::NotFinite`], [`RecordingError::Io`].
    pub fn read(
        &mut self,
        start: u64,
        count: usize,
        channels: &mut Vec<Vec<Complex32>>,
    ) -> Result<(), RecordingError> {
        if start
            .checked_add(count as u64)
            .is_none_or(|end| end > self.length)
        {
            return Err(RecordingError::OutOfRange {
                file: self.data_file().display().to_string(),
                start,
                count: count as u64,
                length: self.length,
            });
        }
        channels.resize_with(self.channels(), Vec::new);
        for channel in channels.iter_mut() {
            channel.clear();
            channel.reserve(count);
        }
        let per_file = if self.files.len() == 1 {
            self.channels()
        } else {
            1
        };
        for ((path, file), channels) in self.files.iter_mut().zip(channels.chunks_mut(per_file)) {
            let place = Place {
                path,
                start,
                count,
                datatype: self.datatype,
            };
            place.read(file, &mut self.block, channels)?;
        }
        Ok(())
    }
}

/// A stretch of one data file.
struct Place<'a> {
    path: &'a Path,
    start: u64,
    count: usize,
    datatype: Datatype,
}

impl Place<'_> {
    fn read(
        &self,
        file: &mut File,
        block: &mut Vec<u8>,
        channels: &mut [Vec<Complex32>],
    ) -> Result<(), RecordingError> {
        let failed = |source| RecordingError::io(self.path, source);
        let sample_bytes = self.datatype.bytes();
        let frame_bytes = sample_bytes * channels.len();
        let frames_at_once = (BLOCK_BYTES / frame_bytes).max(1);
        file.seek(SeekFrom::Start(self.start * frame_bytes as u64))
            .map_err(failed)?;
        let mut done = 0;
        while done < self.count {
            let frames = frames_at_once.min(self.count - done);
            block.resize(frames * frame_bytes, 0);
            file.read_exact(block).map_err(failed)?;
            for (index, frame) in block.chunks_exact(frame_bytes).enumerate() {
                let samples = frame.chunks_exact(sample_bytes).zip(channels.iter_mut());
                for (channel, (bytes, samples)) in samples.enumerate() {
                    let sample = self.datatype.decode(bytes);
                    if !sample.is_finite() {
                        return Err(RecordingError::NotFinite {
                            file: self.path.display().to_string(),
                            sample: self.start + (done + index) as u64,
                            channel,
                        });
                    }
                    samples.push(sample);
                }
            }
            done += frames;
        }
        Ok(())
    }
}

/// Metadata file and data file of the recording that `path` names.
fn both_halves(path: &Path) -> Result<(PathBuf, PathBuf), RecordingError> {
    let name = path.to_string_lossy();
    let stem = [".sigmf-meta", ".sigmf-data", ".sigmf"]
        .into_iter()
        .find_map(|suffix| name.strip_suffix(suffix))
        .unwrap_or(&name);
    let [meta, data] = [".sigmf-meta", ".sigmf-data"].map(|suffix| format!("{stem}{suffix}"));
    match (Path::new(&meta).is_file(), Path::new(&data).is_file()) {
        (true, true) => Ok((meta.into(), data.into())),
        (true, false) => Err(RecordingError::HalfMissing {
            present: meta,
            missing: data,
        }),
        (false, true) => Err(RecordingError::HalfMissing {
            present: data,
            missing: meta,
        }),
        (false, false) => Err(RecordingError::NoSuchRecording {
            file: name.into_owned(),
        }),
    }
}

fn open_data(
    path: &Path,
    channels: usize,
    datatype: Datatype,
) -> Result<(File, u64), RecordingError> {
    let failed = |source| RecordingError::io(path, source);
    let file = files::open(path).map_err(failed)?;
    let bytes = file.metadata().map_err(failed)?.len();
    let frame_bytes = (channels * datatype.bytes()) as u64;
    if bytes == 0 || !bytes.is_multiple_of(frame_bytes) {
        return Err(RecordingError::PartialFrame {
            file: path.display().to_string(),
            bytes,
            frame_bytes,
            channels,
            datatype: datatype.name(),
        });
    }
    Ok((file, bytes / frame_bytes))
}
