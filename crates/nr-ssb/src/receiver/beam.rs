//! A beam that a receiver keeps to.

use crate::search::{DetectedSsb, SearchConfig};
use crate::standard::pci::Pci;
use crate::track::{TrackError, Tracker};

/// SSBs in a row that must be missing before a beam is given up.
const MISSES: u32 = 8;

/// A beam that is tracked. Places are in samples at the base rate.
pub(super) struct Beam<const A: usize> {
    pub pci: Pci,
    pub ssb_index: u8,
    pub tracker: Tracker<A>,
    /// Where the next SSB is expected ...
    pub next_start: f64,
    /// ... so many periods after the last one that was seen, and where that was.
    periods: f64,
    last_seen: f64,
    /// Whether it was seen since a search found it.
    pub is_followed: bool,
}

impl<const A: usize> Beam<A> {
    pub fn new(config: &SearchConfig, found: &DetectedSsb) -> Result<Self, TrackError> {
        Ok(Self {
            pci: found.pci,
            ssb_index: found.ssb_index,
            tracker: Tracker::new(config, found)?,
            next_start: found.sample_start,
            periods: 0.0,
            last_seen: found.sample_start,
            is_followed: false,
        })
    }

    /// Its SSB was seen, and is expected a period later.
    pub fn seen(&mut self, start: f64, period: f64) {
        (self.last_seen, self.periods, self.is_followed) = (start, 0.0, true);
        self.skip(1.0, period);
    }

    /// Moves on by some bursts; the clocks drift meanwhile as they were seen to.
    pub fn skip(&mut self, bursts: f64, period: f64) {
        self.periods += bursts;
        self.next_start = self.tracker.expected_start(self.periods * period);
    }

    /// Moves on to its first SSB that does not begin before `first`: asleep meanwhile, or the samples are
    /// missing.
    pub fn skip_to(&mut self, first: f64, period: f64) {
        if self.next_start < first {
            let drifted = self.tracker.expected_start(period) - self.tracker.expected_start(0.0);
            self.skip(((first - self.next_start) / drifted).ceil(), period);
        }
    }

    /// A search has found it again; by how many samples it came off its period.
    pub fn found(&mut self, found: &DetectedSsb, period: f64) -> f64 {
        // Bursts since it was seen last.
        let late = (found.sample_start - self.next_start) / period;
        let bursts = self.periods + late.round();
        self.tracker.found(found, bursts.max(1.0) * period);
        (self.periods, self.next_start) = (0.0, found.sample_start);
        self.is_followed = false;
        (late - late.round()) * period
    }

    pub fn is_lost(&self, lost_after: f64) -> bool {
        self.tracker.misses() >= MISSES && self.next_start - self.last_seen >= lost_after
    }
}
