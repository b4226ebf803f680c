//! Reader of the samples of a recording.

use std::fmt;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use num_complex::Complex32;

use super::archive::{self, Extent};
use super::checksum;
use super::frequency::check_centre_hz;
use super::metadata::{self, Annotation, Capture, Global, Metadata};
use super::sample_format;
use super::samples::Datatype;
use super::segment::{self, Segment};
use super::timeline::{self, Position};
use crate::error::RecordingError;
use crate::file as files;
use crate::foreign::format_of;

/// Number of bytes read from a file at once.
const BLOCK_BYTES: usize = 1 << 18;
/// Maximum resolution of dates that determine gaps of a drive (s): at most 1 cm driven at 10 m/s.
const MAX_RESOLUTION_S: f64 = 1e-3;

/// Suspicious property of a recording that does not prevent reading.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum RecordingWarning {
    /// The SHA-512 of the data differs from the metadata.
    ChecksumMismatch {
        /// Path of the data file.
        file: String,
    },
    /// An annotation ends after the last sample, so that the data may be truncated.
    AnnotationBeyondEnd {
        /// Index of the annotation.
        annotation: usize,
        /// Number of samples per channel.
        length: u64,
    },
    /// The metadata contain no centre frequency.
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
            Self::NoFrequency => f.write_str("no capture contains `core:frequency`"),
        }
    }
}

/// Open data file of a recording.
#[derive(Debug)]
struct DataFile {
    extent: Extent,
    file: File,
}

/// Open recording of one or more channels.
#[derive(Debug)]
pub struct Recording {
    metadata: Metadata,
    positions: Vec<Position>,
    datatype: Datatype,
    /// One file with interleaved channels, or one file per channel.
    files: Vec<DataFile>,
    length: u64,
    warnings: Vec<RecordingWarning>,
    block: Vec<u8>,
}

impl Recording {
    /// Opens a SigMF recording by its name, its `.sigmf-meta` or `.sigmf-data` file, an archive
    /// (`.sigmf`) or a collection (`.sigmf-collection`) of one recording. Compares the data's
    /// SHA-512 with the metadata's, which reads all data once.
    ///
    /// # Errors
    /// [`RecordingError`] if one file of the pair is missing, the metadata are invalid, or the data
    /// are empty, end within a sample or have another type.
    pub fn open(path: impl AsRef<Path>) -> Result<Self, RecordingError> {
        let mut recording = Self::open_unverified(path)?;
        recording.verify()?;
        Ok(recording)
    }

    /// Opens a recording like [`open`](Self::open), without the comparison of the checksum.
    ///
    /// # Errors
    /// Errors of [`open`](Self::open).
    pub fn open_unverified(path: impl AsRef<Path>) -> Result<Self, RecordingError> {
        let path = path.as_ref();
        let Halves {
            meta_file,
            text,
            data,
        } = halves(path)?;
        let metadata = Metadata::parse(&text, &meta_file)?;
        let datatype = Datatype::from_name(&metadata.global.datatype, &meta_file)?;
        let (data, length) = open_data(data, metadata.global.channels, datatype)?;
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
        let positions = positions(&metadata, &meta_file)?;
        let mut recording = Self::new((metadata, positions), datatype, vec![data], length);
        if let Some(likely) = recording.other_datatype()? {
            let allowed = format!("the samples are probably `{}`", likely.name());
            let stated = format!("`{}`", datatype.name());
            return Err(RecordingError::value(
                &meta_file,
                "global.core:datatype",
                stated,
                allowed,
            ));
        }
        Ok(recording)
    }

    /// Opens raw `cf32_le` files, one per channel.
    ///
    /// # Errors
    /// [`RecordingError`] if a file cannot be read, ends within a sample or has a different length,
    /// or if the rate is not a positive number.
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
        if let Some(hz) = frequency_hz {
            check_centre_hz(hz)
                .map_err(|allowed| RecordingError::value(first, "centre frequency", hz, allowed))?;
        }
        metadata.check(first)?;
        let mut files = Vec::with_capacity(paths.len());
        let mut length = None;
        for path in paths {
            let path = path.as_ref();
            let (data, samples) = open_data(whole(path)?, 1, Datatype::Cf32Le)?;
            let expected = *length.get_or_insert(samples);
            if samples != expected {
                return Err(RecordingError::UnequalChannels {
                    file: path.display().to_string(),
                    samples,
                    first: first.display().to_string(),
                    expected,
                });
            }
            files.push(data);
        }
        let positions = positions(&metadata, first)?;
        let described = (metadata, positions);
        let mut recording = Self::new(described, Datatype::Cf32Le, files, length.unwrap_or(0));
        if let Some(likely) = recording.other_datatype()? {
            let allowed = format!(
                "raw files must be `cf32_le`; for {0}, write a .sigmf-meta file with core:datatype {0}",
                likely.name()
            );
            let found = format!("probably `{}`", likely.name());
            return Err(RecordingError::value(first, "samples", found, allowed));
        }
        Ok(recording)
    }

    fn new(
        (metadata, positions): (Metadata, Vec<Position>),
        datatype: Datatype,
        files: Vec<DataFile>,
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
            positions,
            datatype,
            files,
            length,
            warnings,
            block: Vec::new(),
        }
    }

    fn verify(&mut self) -> Result<(), RecordingError> {
        let (Some(expected), Some(DataFile { extent, .. })) =
            (&self.metadata.global.sha512, self.files.first())
        else {
            return Ok(());
        };
        let path = &extent.file;
        let found =
            checksum::of_extent(extent).map_err(|source| RecordingError::io(path, source))?;
        if !found.eq_ignore_ascii_case(expected) {
            let file = path.display().to_string();
            self.warnings
                .push(RecordingWarning::ChecksumMismatch { file });
        }
        Ok(())
    }

    /// Returns the probable type of the samples if it differs from the one in the metadata.
    fn other_datatype(&mut self) -> Result<Option<Datatype>, RecordingError> {
        for DataFile { extent, file } in &mut self.files {
            let failed = |source| RecordingError::io(&extent.file, source);
            let count = extent.bytes.min(sample_format::JUDGED_BYTES as u64);
            self.block.resize(count as usize, 0);
            file.seek(SeekFrom::Start(extent.offset)).map_err(failed)?;
            file.read_exact(&mut self.block).map_err(failed)?;
            if let Some(likely) = sample_format::contradiction(self.datatype, &self.block) {
                return Ok(Some(likely));
            }
        }
        Ok(None)
    }

    /// Returns the segments of the recording in order, each with one centre frequency and without a gap.
    pub fn segments(&self) -> Vec<Segment> {
        segment::segments(&self.metadata.captures, &self.positions, self.length)
    }

    /// Checks that the recording has one centre frequency and gaps of known duration, as a drive requires.
    ///
    /// # Errors
    /// [`RecordingError::Value`] with the first capture of another frequency, or after an inaccurate gap.
    pub fn check_drive(&self) -> Result<(), RecordingError> {
        let segments = self.segments();
        let coarse = |it: &&Segment| it.gap_resolution_s.is_some_and(|it| it > MAX_RESOLUTION_S);
        if let Some(after) = segments.iter().find(coarse) {
            let capture = self.metadata.captures.get(after.capture);
            let date = capture.and_then(Capture::datetime).unwrap_or_default();
            return Err(RecordingError::value(
                self.data_file(),
                format!("captures[{}].core:datetime", after.capture),
                date,
                "a gap precedes this capture, and its duration must be known to a millisecond; write more digits, or \
                 core:global_index",
            ));
        }
        let Some(first) = segments.first() else {
            return Ok(());
        };
        let Some(second) = segments.iter().find(|it| !it.has_frequency_of(first)) else {
            return Ok(());
        };
        let hz = |it: &Segment| it.centre_frequency_hz.unwrap_or(f64::NAN);
        let key = format!("captures[{}].core:frequency", second.capture);
        let allowed = format!(
            "a drive is received at one centre frequency, and begins at {} Hz; write one recording for each frequency",
            hz(first)
        );
        Err(RecordingError::value(
            self.data_file(),
            key,
            hz(second),
            allowed,
        ))
    }

    /// Returns the metadata.
    pub fn metadata(&self) -> &Metadata {
        &self.metadata
    }

    /// Returns the path of the first data file.
    pub fn data_file(&self) -> &Path {
        self.files
            .first()
            .map_or(Path::new(""), |it| &it.extent.file)
    }

    /// Returns the sample rate in Hz.
    pub fn sample_rate_hz(&self) -> f64 {
        self.metadata.global.sample_rate_hz
    }

    /// Returns the centre frequency of the first capture that has one, in Hz.
    pub fn centre_frequency_hz(&self) -> Option<f64> {
        self.metadata
            .captures
            .iter()
            .find_map(|capture| capture.frequency_hz)
    }

    /// Returns the number of channels.
    pub fn channels(&self) -> usize {
        self.metadata.global.channels
    }

    /// Returns the number of samples per channel.
    pub fn length(&self) -> u64 {
        self.length
    }

    /// Returns the format of the samples in the file.
    pub fn datatype(&self) -> Datatype {
        self.datatype
    }

    /// Returns the annotations.
    pub fn annotations(&self) -> &[Annotation] {
        &self.metadata.annotations
    }

    /// Returns the warnings.
    pub fn warnings(&self) -> &[RecordingWarning] {
        &self.warnings
    }

    /// Reads `count` samples of every channel from sample `start`; `channels` is resized to one
    /// vector of this length per channel.
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
        for (DataFile { extent, file }, channels) in
            self.files.iter_mut().zip(channels.chunks_mut(per_file))
        {
            let span = FileSpan {
                extent,
                start,
                count,
                datatype: self.datatype,
            };
            span.read(file, &mut self.block, channels)?;
        }
        Ok(())
    }
}

/// Segment of one data file.
struct FileSpan<'a> {
    extent: &'a Extent,
    start: u64,
    count: usize,
    datatype: Datatype,
}

impl FileSpan<'_> {
    fn read(
        &self,
        file: &mut File,
        block: &mut Vec<u8>,
        channels: &mut [Vec<Complex32>],
    ) -> Result<(), RecordingError> {
        let failed = |source| RecordingError::io(&self.extent.file, source);
        let sample_bytes = self.datatype.bytes();
        let frame_bytes = sample_bytes * channels.len();
        let frames_at_once = (BLOCK_BYTES / frame_bytes).max(1);
        file.seek(SeekFrom::Start(
            self.extent.offset + self.start * frame_bytes as u64,
        ))
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
                            file: self.extent.file.display().to_string(),
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

/// Returns the position of every capture in the stream of the receiver.
///
/// # Errors
/// [`RecordingError`] with the index or date that contradicts the previous captures.
fn positions(metadata: &Metadata, file: &Path) -> Result<Vec<Position>, RecordingError> {
    timeline::positions(&metadata.captures, metadata.global.sample_rate_hz).map_err(|it| {
        let key = format!("captures[{}].{}", it.capture, it.key);
        RecordingError::value(file, key, it.found, it.allowed)
    })
}

/// Metadata and data of a recording.
struct Halves {
    /// Name of the metadata in errors.
    meta_file: PathBuf,
    text: Vec<u8>,
    data: Extent,
}

/// Returns the metadata and data of the recording that `path` names.
fn halves(path: &Path) -> Result<Halves, RecordingError> {
    let is = |extension: &str| path.extension().is_some_and(|it| it == extension) && path.is_file();
    if is("sigmf") {
        let (text, data) = archive::recording_in(path)?;
        let meta_file = path.to_owned();
        return Ok(Halves {
            meta_file,
            text,
            data,
        });
    }
    if is("sigmf-collection") {
        return halves(&archive::recording_of(path)?);
    }
    let (meta_file, data_file) = both_halves(path)?;
    Ok(Halves {
        text: metadata::read_text(&meta_file)?,
        data: whole(&data_file)?,
        meta_file,
    })
}

/// Returns the byte range of a whole file.
fn whole(path: &Path) -> Result<Extent, RecordingError> {
    let failed = |source| RecordingError::io(path, source);
    let bytes = files::open(path)
        .and_then(|file| file.metadata())
        .map_err(failed)?
        .len();
    Ok(Extent {
        file: path.to_owned(),
        offset: 0,
        bytes,
    })
}

/// Returns the metadata file and data file of the recording that `path` names.
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
        (false, false) if path.is_file() => Err(other_format(path)?),
        (false, false) => Err(RecordingError::NoSuchRecording {
            file: if path.is_dir() {
                path.display().to_string()
            } else {
                name.into_owned()
            },
        }),
    }
}

/// Number of bytes that determine the format of a file.
const JUDGED_BYTES: usize = 300;

/// Creates the error for a file that is not of a SigMF recording.
///
/// # Errors
/// [`RecordingError::Io`].
fn other_format(path: &Path) -> Result<RecordingError, RecordingError> {
    let failed = |source| RecordingError::io(path, source);
    let mut bytes = Vec::new();
    let opened = files::open(path).map_err(failed)?;
    let mut start = opened.take(JUDGED_BYTES as u64);
    start.read_to_end(&mut bytes).map_err(failed)?;
    let is_tar = bytes.get(257..262).is_some_and(|it| it == b"ustar");
    let found = match format_of(&bytes) {
        Some(name) => name,
        None if is_tar => "a tar file; name a SigMF archive .sigmf",
        None => "in another format",
    };
    let allowed = "it must be a .sigmf-meta, .sigmf-data or .sigmf file; for other files, write a .sigmf-meta file, or give \
                   raw cf32 samples with their rate";
    Ok(RecordingError::value(path, "recording", found, allowed))
}

/// Opens data and returns the number of samples per channel too.
fn open_data(
    extent: Extent,
    channels: usize,
    datatype: Datatype,
) -> Result<(DataFile, u64), RecordingError> {
    let file =
        files::open(&extent.file).map_err(|source| RecordingError::io(&extent.file, source))?;
    let bytes = extent.bytes;
    let frame_bytes = (channels * datatype.bytes()) as u64;
    if bytes == 0 || !bytes.is_multiple_of(frame_bytes) {
        return Err(RecordingError::PartialFrame {
            file: extent.file.display().to_string(),
            bytes,
            frame_bytes,
            channels,
            datatype: datatype.name(),
        });
    }
    Ok((DataFile { extent, file }, bytes / frame_bytes))
}
