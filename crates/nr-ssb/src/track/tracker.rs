//! The tracker of one cell.

use num_complex::Complex32;

use super::beams::Beams;
use super::despread::despread;
use super::error::TrackError;
use super::frequency::FrequencyLoop;
use super::tracked::Tracked;
use crate::dsp::alignment::Alignment;
use crate::dsp::base_rate::CYCLIC_PREFIX;
use crate::dsp::timing;
use crate::numeric::decibel::decibel;
use crate::receive::acquire::{Acquired, Acquirer};
use crate::receive::broadcast::BroadcastDecoder;
use crate::receive::measure::measure;
use crate::search::{DetectedSsb, SearchConfig, SearchError, Searcher};
use crate::standard::grid::{SUBCARRIERS, SYMBOLS, SsbGrid};
use crate::standard::message::payload::BchPayload;
use crate::standard::numerology::Lmax;
use crate::standard::pci::Pci;

/// Part of a timing deviation that is taken for a rate error of the clocks.
const DRIFT_GAIN: f64 = 0.2;

/// Tracker of one cell; owns all plans and buffers.
pub struct Tracker<const A: usize> {
    pci: Pci,
    lmax: Lmax,
    base_rate_hz: f64,
    acquirer: Acquirer,
    decoder: BroadcastDecoder,
    searcher: Searcher,
    beams: Beams,
    frequency: FrequencyLoop,
    last_start: f64,
    /// Samples per sample that the cell's clock is slow.
    drift: f64,
    misses: u32,
}

impl<const A: usize> Tracker<A> {
    /// Tracks a cell that a search with these settings found.
    ///
    /// # Errors
    /// Those of [`Searcher::new`]; [`SearchError::AntennaCount`] unless the settings are for `A`.
    pub fn new(config: &SearchConfig, cell: &DetectedSsb) -> Result<Self, TrackError> {
        if config.antennas != A {
            let (given, expected) = (config.antennas, A);
            return Err(SearchError::AntennaCount { given, expected }.into());
        }
        let config = SearchConfig {
            lmax: Some(cell.lmax),
            ..config.clone()
        };
        let searcher = Searcher::new(config.clone())?;
        let base_rate_hz = config.spacing.base_rate_hz();
        Ok(Self {
            pci: cell.pci,
            lmax: cell.lmax,
            base_rate_hz,
            acquirer: Acquirer::new(base_rate_hz, config.ssb_freq_hz, A, 0.0),
            decoder: BroadcastDecoder::new(config.spacing, config.lmax, config.ssb_freq_hz),
            searcher,
            beams: Beams::new(cell.pci, A),
            frequency: FrequencyLoop::new(cell, base_rate_hz),
            last_start: cell.sample_start,
            drift: 0.0,
            misses: 0,
        })
    }

    /// Where the SSB that follows the last one by `samples` of the cell's clock will begin.
    pub fn expected_start(&self, samples: f64) -> f64 {
        self.last_start + samples * (1.0 + self.drift)
    }

    /// SSBs in a row that were not there.
    pub fn misses(&self) -> u32 {
        self.misses
    }

    /// Looks at the SSB expected to begin at `expected_start`, in a window whose first sample is
    /// number `window_start`. `None` if the cell is not there: not where it was expected, nor, by a
    /// search, anywhere in the window.
    ///
    /// # Errors
    /// [`TrackError::Window`] if the window does not hold the expected SSB,
    /// [`SearchError::UnequalLengths`].
    pub fn track(
        &mut self,
        antennas: &[&[Complex32]; A],
        window_start: f64,
        expected_start: f64,
        decode_pbch: bool,
    ) -> Result<Option<Tracked<A>>, TrackError> {
        let outside = || TrackError::Window {
            expected: expected_start,
            window_start,
            samples: antennas
                .iter()
                .map(|samples| samples.len())
                .min()
                .unwrap_or(0),
        };
        let pss_start = expected_start - window_start + CYCLIC_PREFIX as f64;
        if pss_start.is_nan() || pss_start < 0.0 {
            return Err(outside());
        }
        let alignment = Alignment {
            start: pss_start.round() as usize,
            delay: pss_start - pss_start.round(),
            cfo_cycles: self.frequency.cfo_cycles,
            phase_step: self.frequency.phase_step,
        };
        let Acquirer {
            demodulator, grids, ..
        } = &mut self.acquirer;
        demodulator
            .run(antennas, &alignment, grids)
            .ok_or_else(outside)?;
        let mut seen = self.look(alignment, decode_pbch);
        if seen.is_none() {
            seen = self.reacquire(antennas, decode_pbch)?;
        }
        let Some(tracked) = &mut seen else {
            self.misses += 1;
            return Ok(None);
        };
        self.misses = 0;
        tracked.sample_start += window_start;
        let elapsed = tracked.sample_start - self.last_start;
        if !tracked.reacquired && elapsed > 0.5 * self.base_rate_hz * 5e-3 {
            self.drift += DRIFT_GAIN * (tracked.sample_start - expected_start) / elapsed;
        }
        self.last_start = tracked.sample_start;
        Ok(seen)
    }

    /// Received resource elements of one antenna, `[symbol][subcarrier]`, of the last SSB, delay
    /// and frequency offset as predicted taken out; [`Tracked::residual_delay`] is left.
    pub fn received(&self, antenna: usize) -> Option<&[[Complex32; SUBCARRIERS]; SYMBOLS]> {
        self.acquirer.grids.get(antenna)
    }

    /// The resource elements known in the last SSB, zero elsewhere: least squares is
    /// [`received`](Self::received) times their conjugate.
    pub fn known(&self) -> &SsbGrid {
        &self.acquirer.reference
    }

    /// Everything from the demodulated grids on.
    fn look(&mut self, mut alignment: Alignment, decode_pbch: bool) -> Option<Tracked<A>> {
        let phases = alignment.symbol_phases();
        let ibar_ssb = self.beams.identify(&self.acquirer.grids, &phases)?;
        self.acquirer
            .reference
            .clone_from(self.beams.reference(ibar_ssb)?);
        let mut payload = None;
        if decode_pbch {
            payload = self.decode(ibar_ssb, alignment);
        }
        let Acquirer {
            estimate,
            grids,
            reference,
            ..
        } = &mut self.acquirer;
        estimate.fold(grids, reference, &phases);
        estimate.estimate_noise();
        let delay = timing::refine_combined(&estimate.rows);
        let (blocks, pilots) = despread(grids, reference, delay);
        let noise_variance = std::array::from_fn(|antenna| estimate.noise_variance[antenna]);
        // Samples that are no numbers, or beyond all bounds, must not reach what is kept.
        if !(blocks.iter().flatten().all(|block| block.is_finite())
            && noise_variance.iter().all(|noise| noise.is_finite()))
        {
            return None;
        }
        alignment.shift(delay)?;
        let known: f64 = pilots.iter().map(|count| f64::from(*count)).sum();
        let mut snr = 0.0;
        let measurements = std::array::from_fn(|antenna| {
            let energy: f64 = blocks.iter().map(|block| block[antenna].norm_sqr()).sum();
            let noise = noise_variance[antenna];
            let power = ((energy - SYMBOLS as f64 * noise) / known).max(0.0);
            snr += power / noise.max(1e-30) / A as f64;
            measure(&grids[antenna], power, noise)
        });
        self.frequency.follow(&blocks, &noise_variance);
        let half_frame = match (payload, self.lmax) {
            (Some(BchPayload { half_frame, .. }), _) => Some(half_frame),
            (None, Lmax::L4) => Some(ibar_ssb >= 4),
            (None, _) => None,
        };
        Some(Tracked {
            pci: self.pci,
            ssb_index: self.lmax.index_lsb(ibar_ssb),
            half_frame,
            sample_start: alignment.first_sample(),
            cfo_hz: self.frequency.cfo_cycles * self.base_rate_hz,
            snr_db: decibel(snr),
            blocks,
            residual_delay: delay,
            pilots,
            noise_variance,
            measurements,
            payload,
            reacquired: false,
        })
    }

    /// Decodes the PBCH and adds it to what is known.
    fn decode(&mut self, ibar_ssb: u8, alignment: Alignment) -> Option<BchPayload> {
        let Acquirer {
            estimate,
            grids,
            reference,
            ..
        } = &mut self.acquirer;
        estimate.fold(grids, reference, &alignment.symbol_phases());
        estimate.fit(grids, reference);
        let acquired = Acquired {
            pci: self.pci,
            ibar_ssb,
            alignment,
            coarse_cfo_cycles: alignment.cfo_cycles,
            statistic: 0.0,
        };
        let broadcast = self.decoder.decode(&self.acquirer, &acquired)?;
        self.acquirer.know_pbch(self.pci, &broadcast.symbols);
        Some(broadcast.payload)
    }

    /// Searches the whole window for the cell.
    fn reacquire(
        &mut self,
        antennas: &[&[Complex32]; A],
        decode_pbch: bool,
    ) -> Result<Option<Tracked<A>>, TrackError> {
        let found = match self.searcher.search(antennas) {
            Ok(found) => found,
            Err(SearchError::TooShort { .. }) => return Ok(None),
            Err(error) => return Err(error.into()),
        };
        let Some(cell) = found.iter().find(|ssb| ssb.pci == self.pci) else {
            return Ok(None);
        };
        self.frequency = FrequencyLoop::new(cell, self.base_rate_hz);
        let mut alignment = Alignment {
            start: 0,
            delay: 0.0,
            cfo_cycles: self.frequency.cfo_cycles,
            phase_step: self.frequency.phase_step,
        };
        if alignment
            .shift(cell.sample_start + CYCLIC_PREFIX as f64)
            .is_none()
        {
            return Ok(None);
        }
        let Acquirer {
            demodulator, grids, ..
        } = &mut self.acquirer;
        if demodulator.run(antennas, &alignment, grids).is_none() {
            return Ok(None);
        }
        let seen = self.look(alignment, decode_pbch);
        Ok(seen.map(|tracked| Tracked {
            reacquired: true,
            ..tracked
        }))
    }
}
