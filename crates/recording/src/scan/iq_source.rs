//! Sources of samples.

use num_complex::Complex32;

use crate::error::RecordingError;
use crate::sigmf::Recording;

/// Samples of one or more antennas, read in blocks.
pub trait IqSource {
    /// Returns the name of the source in errors.
    fn name(&self) -> String;
    /// Returns the number of antennas.
    fn channels(&self) -> usize;
    /// Returns the number of samples per antenna.
    fn length(&self) -> u64;
    /// Returns the sample rate in Hz.
    fn sample_rate_hz(&self) -> f64;
    /// Returns the centre frequency in Hz; `None` if it is unknown.
    fn centre_frequency_hz(&self) -> Option<f64>;
    /// Reads `count` samples of every antenna from sample `start`; `antennas` is resized to one
    /// vector per antenna.
    ///
    /// # Errors
    /// [`RecordingError`] if the samples cannot be read.
    fn read(
        &mut self,
        start: u64,
        count: usize,
        antennas: &mut Vec<Vec<Complex32>>,
    ) -> Result<(), RecordingError>;
}

impl IqSource for Recording {
    fn name(&self) -> String {
        self.data_file().display().to_string()
    }

    fn channels(&self) -> usize {
        Self::channels(self)
    }

    fn length(&self) -> u64 {
        Self::length(self)
    }

    fn sample_rate_hz(&self) -> f64 {
        Self::sample_rate_hz(self)
    }

    fn centre_frequency_hz(&self) -> Option<f64> {
        Self::centre_frequency_hz(self)
    }

    fn read(
        &mut self,
        start: u64,
        count: usize,
        antennas: &mut Vec<Vec<Complex32>>,
    ) -> Result<(), RecordingError> {
        Self::read(self, start, count, antennas)
    }
}

/// Returns the channel and index of the first sample that is not finite.
pub(super) fn first_not_finite(antennas: &[&[Complex32]]) -> Option<(usize, usize)> {
    antennas.iter().enumerate().find_map(|(channel, samples)| {
        let place = samples.iter().position(|sample| !sample.is_finite())?;
        Some((channel, place))
    })
}

/// Samples in memory, one slice of equal length per antenna.
#[derive(Debug, Clone)]
pub struct SampleBlock<'a> {
    /// Samples of each antenna.
    pub antennas: Vec<&'a [Complex32]>,
    /// Sample rate in Hz.
    pub sample_rate_hz: f64,
    /// Centre frequency in Hz; `None` if it is unknown.
    pub centre_frequency_hz: Option<f64>,
}

impl IqSource for SampleBlock<'_> {
    fn name(&self) -> String {
        "samples".to_owned()
    }

    fn channels(&self) -> usize {
        self.antennas.len()
    }

    fn length(&self) -> u64 {
        self.antennas
            .iter()
            .map(|samples| samples.len() as u64)
            .min()
            .unwrap_or(0)
    }

    fn sample_rate_hz(&self) -> f64 {
        self.sample_rate_hz
    }

    fn centre_frequency_hz(&self) -> Option<f64> {
        self.centre_frequency_hz
    }

    fn read(
        &mut self,
        start: u64,
        count: usize,
        antennas: &mut Vec<Vec<Complex32>>,
    ) -> Result<(), RecordingError> {
        antennas.resize_with(self.antennas.len(), Vec::new);
        for (channel, (samples, to)) in self.antennas.iter().zip(antennas).enumerate() {
            let from = start as usize;
            let Some(piece) = samples.get(from..from.saturating_add(count)) else {
                return Err(RecordingError::OutOfRange {
                    file: self.name(),
                    start,
                    count: count as u64,
                    length: samples.len() as u64,
                });
            };
            if let Some(place) = piece.iter().position(|sample| !sample.is_finite()) {
                let sample = start + place as u64;
                return Err(RecordingError::NotFinite {
                    file: self.name(),
                    sample,
                    channel,
                });
            }
            to.clear();
            to.extend_from_slice(piece);
        }
        Ok(())
    }
}
