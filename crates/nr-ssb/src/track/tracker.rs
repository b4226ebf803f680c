//! Tracker of one cell.

use std::f64::consts::TAU;

use num_complex::Complex32;

use super::beams::Beams;
use super::clock::ClockLoop;
use super::despread::despread;
use super::error::TrackError;
use super::frequency::FrequencyLoop;
use super::index::SsbIndex;
use super::late::REACH;
use super::observe::Observer;
use super::output::TrackerOutput;
use crate::dsp::alignment::Alignment;
use crate::dsp::base_rate::{CYCLIC_PREFIX, SYMBOL_FFT};
use crate::dsp::channel_covariance::ChannelCovariance;
use crate::dsp::received_grid::{PerAntenna, ReceivedGrid};
use crate::dsp::timing;
use crate::numeric::decibel::decibel;
use crate::observables::ArrayObservables;
use crate::one_ssb::acquire::{Acquired, Acquirer};
use crate::one_ssb::broadcast::BroadcastDecoder;
use crate::one_ssb::measure::measure;
use crate::search::{DetectedSsb, SearchConfig, SearchError};
use crate::standard::band::likely_lmax;
use crate::standard::grid::{SUBCARRIERS, SYMBOLS, SsbGrid};
use crate::standard::message::payload::BchPayload;
use crate::standard::numerology::Lmax;
use crate::standard::pci::Pci;

/// Range of the search around the expected time, in standard deviations.
const DEVIATIONS: f64 = 4.0;
/// Extension of the range in samples, because another path may have become the strongest.
const OTHER_PATH: f64 = 2.0;
/// Maximum number of demodulations on either side: 60 samples.
const STEPS: usize = 5;
/// Samples between demodulations, so that their ranges adjoin.
const STEP: f64 = 2.0 * REACH as f64;
/// Maximum delay without another demodulation, in samples.
const NEAR: f64 = 0.5;
/// Variance of the pilots' phase for a delay of one sample, in rad².
const PHASE_SPREAD: f64 = (TAU * 60.0 / SYMBOL_FFT as f64) * (TAU * 60.0 / SYMBOL_FFT as f64);

/// Tracker of one cell. It owns all plans and buffers.
pub struct Tracker {
    pci: Pci,
    index: SsbIndex,
    base_rate_hz: f64,
    acquirer: Acquirer,
    decoder: BroadcastDecoder,
    beams: Beams,
    frequency: FrequencyLoop,
    clock: ClockLoop,
    misses: u32,
    /// Observables, if the carrier frequency is known.
    observer: Option<Observer>,
    /// Demodulation of the last SSB, in a window whose first sample has the index `window_start`.
    demodulation: Alignment,
    window_start: f64,
}

impl Tracker {
    /// Creates a tracker of a cell that a search with this configuration detected.
    ///
    /// # Errors
    /// [`SearchError`] for an invalid configuration.
    pub fn new(config: &SearchConfig, cell: &DetectedSsb) -> Result<Self, TrackError> {
        config.check()?;
        let base_rate_hz = config.spacing.base_rate_hz();
        let carrier_hz = config.ssb_freq_hz;
        let likely = likely_lmax(config.spacing, carrier_hz).likely;
        let lmax = cell.lmax.unwrap_or(likely);
        Ok(Self {
            pci: cell.pci,
            index: SsbIndex::new(lmax, config.spacing, cell.ssb_index),
            base_rate_hz,
            acquirer: Acquirer::new(base_rate_hz, carrier_hz, config.antennas, 0.0),
            decoder: BroadcastDecoder::new(config.spacing, Some(lmax), carrier_hz),
            beams: Beams::new(cell.pci, config.antennas),
            frequency: FrequencyLoop::new(cell, base_rate_hz),
            clock: ClockLoop::new(cell.sample_start, cell.cfo_hz, carrier_hz, base_rate_hz),
            misses: 0,
            observer: carrier_hz.map(|hz| Observer::new(config.spacing, hz)),
            demodulation: Alignment {
                start: 0,
                delay: 0.0,
                cfo_cycles: 0.0,
                phase_step: 0.0,
            },
            window_start: 0.0,
        })
    }

    /// Returns the start of an SSB that is transmitted `samples` of the cell's clock after the last
    /// one, including the estimated clock drift, after a sleep too.
    pub fn expected_start(&self, samples: f64) -> f64 {
        self.clock.expected_start(samples)
    }

    /// Continues at an SSB from a search, transmitted `samples` of the cell's clock after the last
    /// one; the clock drift is estimated again.
    pub fn found(&mut self, cell: &DetectedSsb, samples: f64) {
        self.frequency = FrequencyLoop::new(cell, self.base_rate_hz);
        self.clock.found(cell.sample_start, samples);
        self.index.follow(cell.ssb_index);
        self.misses = 0;
        // Missing samples, or a restarted mixer, may be the reason of the search.
        if let Some(observer) = &mut self.observer {
            observer.forget();
        }
    }

    /// Returns the filtered carrier frequency offset in Hz.
    pub fn cfo_hz(&self) -> f64 {
        self.frequency.cfo_cycles * self.base_rate_hz
    }

    /// Returns the number of consecutive missed SSBs.
    pub fn misses(&self) -> u32 {
        self.misses
    }

    /// Tracks the SSB with the expected start `expected_start`, in a window whose first sample has
    /// the index `window_start`. The search range is six samples on either side, more if the clocks
    /// are uncertain. Returns `None` if the SSB is not detected, or its beam is ambiguous.
    ///
    /// # Errors
    /// [`TrackError::Window`] if the window does not contain the expected SSB, and
    /// [`SearchError::AntennaCount`] for another number of antennas than configured.
    pub fn track(
        &mut self,
        antennas: &[&[Complex32]],
        window_start: f64,
        expected_start: f64,
        decode_pbch: bool,
    ) -> Result<Option<TrackerOutput>, TrackError> {
        let (given, expected) = (antennas.len(), self.acquirer.grids.len());
        if given != expected {
            return Err(SearchError::AntennaCount { given, expected }.into());
        }
        let expected = expected_start - window_start;
        let reach = DEVIATIONS * self.clock.deviation(expected_start) + OTHER_PATH;
        let steps = ((reach - REACH as f64) / STEP)
            .ceil()
            .clamp(0.0, STEPS as f64) as usize;
        let mut seen = None;
        for step in 0..=2 * steps {
            // 0, +1, −1, +2, …
            let away = step.div_ceil(2) as f64 * STEP;
            let place = expected + if step % 2 == 1 { away } else { -away };
            let Some(alignment) = self.demodulated(antennas, place) else {
                if step > 0 {
                    continue;
                }
                return Err(TrackError::Window {
                    expected: expected_start,
                    window_start,
                    samples: antennas.iter().map(|it| it.len()).min().unwrap_or(0),
                });
            };
            seen = self.measure(antennas, alignment, decode_pbch);
            if seen.is_some() {
                break;
            }
        }
        let Some(tracked) = &mut seen else {
            self.misses += 1;
            return Ok(None);
        };
        self.misses = 0;
        tracked.sample_start += window_start;
        self.window_start = window_start;
        let sent_after = self.clock.sent_after(tracked.sample_start);
        tracked.ssb_index = match tracked.payload {
            Some(payload) => payload.ssb_index,
            None => self.index.of(tracked.ssb_index, sent_after),
        };
        self.index.follow(tracked.ssb_index);
        let elapsed_s = self.clock.elapsed_s(tracked.sample_start);
        let (blocks, noise) = (&tracked.blocks, &tracked.noise_variance);
        self.frequency.follow(elapsed_s, blocks, noise);
        tracked.cfo_hz = self.cfo_hz();
        // Delay variance of a single path, by the SNR of all pilots and antennas together.
        let pilots: u16 = tracked.pilots.iter().sum();
        let snr = 10.0_f64.powf(0.1 * tracked.snr_db) * given as f64 * f64::from(pilots);
        let variance = 0.5 / (PHASE_SPREAD * snr.max(1.0));
        let late = tracked.sample_start - expected_start;
        self.clock.follow(expected_start, late, variance);
        Ok(seen)
    }

    /// Demodulates the SSB that begins at `place` in the window, if it is within the window.
    fn demodulated(&mut self, antennas: &[&[Complex32]], place: f64) -> Option<Alignment> {
        let pss_start = place + CYCLIC_PREFIX as f64;
        if pss_start.is_nan() || pss_start < 0.0 {
            return None;
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
        demodulator.run(antennas, &alignment, grids)?;
        Some(alignment)
    }

    /// Returns the received resource elements of every antenna of the last SSB. The predicted delay
    /// and frequency offset are compensated; [`TrackerOutput::residual_delay`] is not.
    pub fn received(&self) -> &[ReceivedGrid] {
        &self.acquirer.grids
    }

    /// Returns the known resource elements of the last SSB, zero elsewhere: the least-squares
    /// channel is [`received`](Self::received) times their conjugate.
    pub fn known(&self) -> &SsbGrid {
        &self.acquirer.reference
    }

    /// Returns the channel on the 240 subcarriers of every antenna, from all known elements of the
    /// last SSB, with its `residual_delay` compensated, and the covariance of its noise over the
    /// subcarriers.
    pub fn channel(
        &mut self,
        residual_delay: f64,
        channel: &mut [[Complex32; SUBCARRIERS]],
    ) -> ChannelCovariance {
        let Acquirer {
            estimate,
            grids,
            reference,
            ..
        } = &mut self.acquirer;
        estimate.fit(grids, reference);
        let ramp = timing::ramp(residual_delay);
        for (slot, estimate) in channel.iter_mut().zip(&estimate.channel) {
            *slot = std::array::from_fn(|k| estimate[k] * ramp[k]);
        }
        estimate.covariance().delayed(residual_delay)
    }

    /// Returns delay, carrier phase, range rate and power of the last SSB, which [`track`](Self::track)
    /// returned; `None` without a carrier frequency. Each SSB is passed once, in order of time.
    pub fn observe(&mut self, ssb: &TrackerOutput) -> Option<ArrayObservables> {
        let observer = self.observer.as_mut()?;
        Some(observer.observe(ssb, &self.acquirer, &self.demodulation, self.window_start))
    }

    /// Returns the burst set size: decoded, or the more probable one.
    pub const fn lmax(&self) -> Lmax {
        self.index.lmax()
    }

    /// Processes the demodulated grids.
    fn measure(
        &mut self,
        antennas: &[&[Complex32]],
        mut alignment: Alignment,
        decode_pbch: bool,
    ) -> Option<TrackerOutput> {
        let phases = alignment.symbol_phases();
        let mut travelled = 0.0;
        let mut found = self.beams.identify(&self.acquirer.grids, &phases)?;
        // At the edge of the range, the actual delay may be larger than the estimate.
        while found.delay.abs() > NEAR {
            travelled += found.delay.abs();
            if travelled > STEP {
                return None;
            }
            alignment.shift(found.delay)?;
            let Acquirer {
                demodulator, grids, ..
            } = &mut self.acquirer;
            demodulator.run(antennas, &alignment, grids)?;
            found = self.beams.identify(&self.acquirer.grids, &phases)?;
        }
        let ibar_ssb = found.ibar_ssb;
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
        let delay = timing::refine_combined(&estimate.rows, found.delay);
        let (blocks, pilots) = despread(grids, reference, delay);
        let noise_variance: PerAntenna<f64> = estimate.noise_variance.iter().copied().collect();
        // Samples that are not finite, or far too large, must not change the state.
        if !(blocks.iter().flatten().all(|block| block.is_finite())
            && noise_variance.iter().all(|noise| noise.is_finite()))
        {
            return None;
        }
        let demodulation = alignment;
        alignment.shift(delay)?;
        let known: f64 = pilots.iter().map(|count| f64::from(*count)).sum();
        let mut snr = 0.0;
        let measurements = grids.iter().zip(&noise_variance).enumerate();
        let measurements = measurements.map(|(antenna, (grid, &noise))| {
            let energy: f64 = blocks.iter().map(|block| block[antenna].norm_sqr()).sum();
            let power = ((energy - SYMBOLS as f64 * noise) / known).max(0.0);
            snr += power / noise.max(1e-30) / antennas.len() as f64;
            measure(grid, power, noise)
        });
        let measurements = measurements.collect();
        self.demodulation = demodulation;
        let half_frame = match (payload, self.index.lmax()) {
            (Some(BchPayload { half_frame, .. }), _) => Some(half_frame),
            (None, Lmax::L4) => Some(ibar_ssb >= 4),
            (None, _) => None,
        };
        Some(TrackerOutput {
            pci: self.pci,
            // `track` derives index and time from these values.
            ssb_index: ibar_ssb,
            half_frame,
            sample_start: alignment.first_sample(),
            cfo_hz: self.cfo_hz(),
            snr_db: decibel(snr),
            blocks,
            residual_delay: delay,
            pilots,
            noise_variance,
            measurements,
            payload,
        })
    }

    /// Decodes the PBCH and adds it to the known elements.
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
        self.acquirer.add_known_pbch(self.pci, &broadcast.symbols);
        Some(broadcast.payload)
    }
}
