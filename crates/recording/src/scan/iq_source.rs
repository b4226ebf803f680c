//! Where samples come from.

use num_complex::Complex32;

use crate::error::RecordingError;
use crate::sigmf::Recording;

/// Samples of one or more antennas, read piece by piece.
pub trait IqSource {
    /// What errors call it.
    fn name(&self) -> String;
    /// Number of antennas.
    fn channels(&self) -> usize;
    /// Samples per antenna.
    fn length(&self) -> u64;
    /// Samples per second and antenna.
    fn sample_rate_hz(&self) -> f64;
    /// Centre frequency in Hz, where it is known.
    fn centre_frequency_hz(&self) -> Option<f64>;
    /// Reads `count` samples of every antenna from `start` on; `antennas` becomes as many vectors.
    ///
    /// # Errors
    /// [`RecordingError`] where they cannot be had.
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

/// Channel and number of the first sample that is not finite.
pub(super) fn first_not_finite(antennas: &[&[Complex32]]) -> Option<(usize, usize)> {
    antennas.iter().enumerate().find_map(|(channel, samples)| {
        let place = samples.iter().position(|sample| !sample.is_finite())?;
        Some((channel, place))
    })
}

/// Samples in memory, one slice per antenna, all of one length.
#[derive(Debug, Clone)]
pub struct SampleBlock<'a> {
    /// The samples.
    pub antennas: Vec<&'a [Complex32]>,
    /// Samples per second and antenna.
    pub sample_rate_hz: f64,
    /// Centre frequency in Hz, where it is known.
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
