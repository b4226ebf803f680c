//! The receiver of a stream.

use num_complex::Complex32;

use super::beam_tracker::{BeamTracker, beam_tracker};
use super::config::ReceiverConfig;
use super::error::ReceiverError;
use super::heard::HeardSsb;
use crate::dsp::base_rate::{CYCLIC_PREFIX, SSB_SAMPLES};
use crate::input::front_end::FrontEnd;
use crate::search::Searcher;
use crate::standard::pci::Pci;

/// Samples at the base rate to either side of an SSB in which its tracker may look for it.
const GUARD: usize = 64;
/// What is needed beyond a period: an SSB that begins at its end, and the guards.
const OVERLAP: usize = SSB_SAMPLES + 2 * GUARD;
/// Two places of one beam closer than this, in samples, are one SSB.
const SAME_SSB_SAMPLES: f64 = CYCLIC_PREFIX as f64;

/// A beam that is tracked.
struct Beam {
    pci: Pci,
    ssb_index: u8,
    tracker: Box<dyn BeamTracker>,
    /// Periods since it was heard, and where it is expected next, samples at the base rate.
    periods: f64,
    next_start: f64,
}

/// See the [module](super).
pub struct Receiver {
    config: ReceiverConfig,
    front_end: FrontEnd,
    searcher: Searcher,
    /// Samples of a period at the base rate.
    period: f64,
    /// Per antenna the guard before, and the samples at the base rate that are not yet heard; the
    /// first is number `start` of the stream.
    base: Vec<Vec<Complex32>>,
    start: i64,
    /// From this sample on a search is due.
    search_at: f64,
    beams: Vec<Beam>,
}

impl Receiver {
    /// Plans transforms and buffers.
    ///
    /// # Errors
    /// [`ReceiverError`] for a rate, band, number of antennas or setting that is not possible.
    pub fn new(config: ReceiverConfig) -> Result<Self, ReceiverError> {
        config.check()?;
        let search = &config.search;
        let offset_hz =
            search.ssb_freq_hz.unwrap_or(config.centre_frequency_hz) - config.centre_frequency_hz;
        let (spacing, antennas) = (search.spacing, search.antennas);
        Ok(Self {
            front_end: FrontEnd::new(config.sample_rate_hz, offset_hz, spacing.hz(), antennas)?,
            searcher: Searcher::new(search.clone())?,
            period: (config.period_s * spacing.base_rate_hz()).round(),
            base: vec![vec![Complex32::ZERO; GUARD]; antennas],
            start: -(GUARD as i64),
            search_at: 0.0,
            beams: Vec::new(),
            config,
        })
    }

    /// The settings.
    pub const fn config(&self) -> &ReceiverConfig {
        &self.config
    }

    /// Beams that are tracked now.
    pub fn tracked(&self) -> usize {
        self.beams.len()
    }

    /// Takes the next samples of every antenna and shows `take` the SSBs that they complete, in order
    /// of time within a period. Two periods at most are held back.
    ///
    /// # Errors
    /// [`ReceiverError::FrontEnd`] for another number of antennas or unequal lengths.
    pub fn push(
        &mut self,
        antennas: &[&[Complex32]],
        take: &mut dyn FnMut(&HeardSsb),
    ) -> Result<(), ReceiverError> {
        self.front_end.push(antennas, &mut self.base)?;
        while self.length() >= self.period as usize + OVERLAP {
            self.hear(self.period as usize, take)?;
        }
        Ok(())
    }

    /// Ends the stream: shows what is held back and forgets all cells.
    ///
    /// # Errors
    /// None that [`push`](Self::push) has not.
    pub fn finish(&mut self, take: &mut dyn FnMut(&HeardSsb)) -> Result<(), ReceiverError> {
        self.front_end.finish(&mut self.base);
        while self.length() >= GUARD + SSB_SAMPLES {
            let rest = self.length() - GUARD;
            self.hear(rest.min(self.period as usize), take)?;
        }
        for samples in &mut self.base {
            samples.clear();
            samples.resize(GUARD, Complex32::ZERO);
        }
        self.beams.clear();
        (self.start, self.search_at) = (-(GUARD as i64), 0.0);
        Ok(())
    }

    fn length(&self) -> usize {
        self.base.first().map_or(0, Vec::len)
    }

    /// Hears the SSBs that begin in the next `hop` samples beyond the guard, and moves on by as many.
    fn hear(&mut self, hop: usize, take: &mut dyn FnMut(&HeardSsb)) -> Result<(), ReceiverError> {
        let mut heard = if self.start as f64 >= self.search_at || self.beams.is_empty() {
            self.search(hop)?
        } else {
            self.track(hop)?
        };
        heard.sort_by(|a, b| a.sample_start.total_cmp(&b.sample_start));
        let ratio = self.front_end.input_per_output();
        for ssb in &mut heard {
            ssb.sample_start *= ratio;
            take(ssb);
        }
        for samples in &mut self.base {
            samples.drain(..hop);
        }
        self.start += hop as i64;
        let lost = self.config.lost_after_s / self.config.period_s;
        self.beams
            .retain(|beam| beam.periods <= lost.max(1.0) + 1.0);
        Ok(())
    }

    /// All SSBs that begin in the hop, and a tracker for each beam among them.
    fn search(&mut self, hop: usize) -> Result<Vec<HeardSsb>, ReceiverError> {
        let slices: Vec<&[Complex32]> = self.base.iter().map(Vec::as_slice).collect();
        let mut channels = Vec::new();
        self.searcher.reset();
        let found = self.searcher.push_with(&slices, &mut |ssb, received| {
            let channel = received.channel.to_vec();
            let noise = received.noise_variance.to_vec();
            channels.push((ssb.pci, ssb.sample_start, channel, noise));
        })?;
        let mut heard = Vec::new();
        let begins = GUARD as f64..(GUARD + hop) as f64;
        for ssb in found
            .iter()
            .filter(|ssb| begins.contains(&ssb.sample_start))
        {
            let same = |(pci, start, ..): &&(Pci, f64, _, _)| {
                (*pci, *start) == (ssb.pci, ssb.sample_start)
            };
            let Some((.., channel, noise_variance)) = channels.iter().find(same) else {
                continue;
            };
            let mut ssb = ssb.clone();
            ssb.sample_start += self.start as f64;
            heard.push(HeardSsb {
                pci: ssb.pci,
                ssb_index: ssb.ssb_index,
                lmax: ssb.lmax,
                half_frame: ssb.half_frame,
                payload: ssb.payload,
                sample_start: ssb.sample_start,
                cfo_hz: ssb.cfo_hz,
                snr_db: ssb.snr_db,
                channel: channel.clone(),
                noise_variance: noise_variance.clone(),
                measurements: ssb.measurements().to_vec(),
                tracked: false,
            });
            let known = |beam: &&mut Beam| (beam.pci, beam.ssb_index) == (ssb.pci, ssb.ssb_index);
            if let Some(beam) = self.beams.iter_mut().find(known) {
                let late = ((ssb.sample_start - beam.next_start) / self.period).round();
                let sent_after = (beam.periods + late).max(1.0) * self.period;
                beam.tracker.found(&ssb, sent_after);
                beam.heard(self.period);
            } else {
                let mut beam = Beam {
                    pci: ssb.pci,
                    ssb_index: ssb.ssb_index,
                    tracker: beam_tracker(&self.config.search, &ssb)?,
                    periods: 0.0,
                    next_start: 0.0,
                };
                beam.heard(self.period);
                self.beams.push(beam);
            }
        }
        self.skip_to(self.start as f64 + begins.end);
        let every = self.config.search_every_s * self.config.search.spacing.base_rate_hz();
        self.search_at = self.start as f64 + every.max(self.period);
        Ok(heard)
    }

    /// The SSBs of known beams that are expected to begin in the hop.
    fn track(&mut self, hop: usize) -> Result<Vec<HeardSsb>, ReceiverError> {
        let slices: Vec<&[Complex32]> = self.base.iter().map(Vec::as_slice).collect();
        let (start, length) = (self.start as f64, self.length() as f64);
        let end = start + (GUARD + hop) as f64;
        let mut heard: Vec<HeardSsb> = Vec::new();
        for beam in &mut self.beams {
            while beam.next_start < end {
                let next = beam.next_start;
                let inside = next >= start && next + SSB_SAMPLES as f64 <= start + length;
                let seen = if inside {
                    beam.tracker.track(&slices, start, next)?
                } else {
                    None
                };
                // The beam is told by DM-RS; another's SSB is not this one.
                match seen.filter(|seen| seen.ssb_index == beam.ssb_index) {
                    Some(seen) => {
                        beam.heard(self.period);
                        let again = |it: &HeardSsb| {
                            (it.pci, it.ssb_index) == (seen.pci, seen.ssb_index)
                                && (it.sample_start - seen.sample_start).abs() < SAME_SSB_SAMPLES
                        };
                        if !heard.iter().any(again) {
                            heard.push(seen);
                        }
                    }
                    None => beam.miss(self.period),
                }
            }
        }
        Ok(heard)
    }

    /// Beams that a search has not heard are expected again after it.
    fn skip_to(&mut self, end: f64) {
        for beam in &mut self.beams {
            while beam.next_start < end {
                beam.miss(self.period);
            }
        }
    }
}

impl Beam {
    /// It was heard, and is expected a period later.
    fn heard(&mut self, period: f64) {
        self.periods = 0.0;
        self.miss(period);
    }

    /// Expects it a period later.
    fn miss(&mut self, period: f64) {
        self.periods += 1.0;
        self.next_start = self.tracker.expected_start(self.periods * period);
    }
}
