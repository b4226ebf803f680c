//! A tracker of however many antennas.

use num_complex::Complex32;

use super::heard::HeardSsb;
use crate::search::{DetectedSsb, SearchConfig, SearchError};
use crate::standard::grid::SUBCARRIERS;
use crate::track::{TrackError, Tracker};

/// A tracker whose number of antennas is not part of its type.
pub(super) trait BeamTracker: Send {
    /// As [`Tracker::expected_start`].
    fn expected_start(&self, samples: f64) -> f64;

    /// As [`Tracker::found`].
    fn found(&mut self, cell: &DetectedSsb, samples: f64);

    /// As [`Tracker::track`]; places in samples at the base rate.
    fn track(
        &mut self,
        antennas: &[&[Complex32]],
        window_start: f64,
        expected_start: f64,
    ) -> Result<Option<HeardSsb>, TrackError>;
}

impl<const A: usize> BeamTracker for Tracker<A> {
    fn expected_start(&self, samples: f64) -> f64 {
        self.expected_start(samples)
    }

    fn found(&mut self, cell: &DetectedSsb, samples: f64) {
        self.found(cell, samples);
    }

    fn track(
        &mut self,
        antennas: &[&[Complex32]],
        window_start: f64,
        expected_start: f64,
    ) -> Result<Option<HeardSsb>, TrackError> {
        let Ok(antennas) = <&[&[Complex32]; A]>::try_from(antennas) else {
            let (given, expected) = (antennas.len(), A);
            return Err(SearchError::AntennaCount { given, expected }.into());
        };
        let Some(seen) = self.track(antennas, window_start, expected_start, true)? else {
            return Ok(None);
        };
        let mut channel = vec![[Complex32::ZERO; SUBCARRIERS]; A];
        self.channel(seen.residual_delay, &mut channel);
        Ok(Some(HeardSsb {
            pci: seen.pci,
            ssb_index: seen.ssb_index,
            lmax: Some(self.lmax()),
            half_frame: seen.half_frame,
            payload: seen.payload,
            sample_start: seen.sample_start,
            cfo_hz: seen.cfo_hz,
            snr_db: seen.snr_db,
            channel,
            noise_variance: seen.noise_variance.to_vec(),
            measurements: seen.measurements.to_vec(),
            tracked: true,
        }))
    }
}

/// A tracker of the cell that a search with these settings found.
pub(super) fn beam_tracker(
    config: &SearchConfig,
    cell: &DetectedSsb,
) -> Result<Box<dyn BeamTracker>, TrackError> {
    macro_rules! of {
        ($($antennas:literal)*) => {
            match config.antennas {
                $($antennas => Ok(Box::new(Tracker::<$antennas>::new(config, cell)?)),)*
                other => Err(SearchError::Antennas(other).into()),
            }
        };
    }
    of!(1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16)
}
