//! Tracked beam of a receiver.

use crate::search::{DetectedSsb, SearchConfig};
use crate::standard::pci::Pci;
use crate::track::{TrackError, Tracker};

/// Number of consecutive missed SSBs before a beam is removed.
const MISSES: u32 = 8;

/// Tracked beam. Positions are in samples at the base rate.
pub(super) struct Beam {
    pub pci: Pci,
    pub ssb_index: u8,
    pub tracker: Tracker,
    /// Expected start of the next SSB, in samples.
    pub next_start: f64,
    /// Number of periods between the last received SSB and the expected one.
    periods: f64,
    /// Start of the last received SSB, in samples.
    last_seen: f64,
    /// Whether the beam was received since a search detected it.
    pub is_followed: bool,
}

impl Beam {
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

    /// Records a received SSB. The next one is expected one period later.
    pub fn seen(&mut self, start: f64, period: f64) {
        (self.last_seen, self.periods, self.is_followed) = (start, 0.0, true);
        self.skip(1.0, period);
    }

    /// Advances by some bursts, with the estimated clock drift.
    pub fn skip(&mut self, bursts: f64, period: f64) {
        self.periods += bursts;
        self.next_start = self.tracker.expected_start(self.periods * period);
    }

    /// Advances to the first SSB that does not begin before `first`, after a sleep or missing
    /// samples.
    pub fn skip_to(&mut self, first: f64, period: f64) {
        if self.next_start < first {
            let drifted = self.tracker.expected_start(period) - self.tracker.expected_start(0.0);
            self.skip(((first - self.next_start) / drifted).ceil(), period);
        }
    }

    /// Continues at an SSB from a search; returns its deviation from the period in samples.
    pub fn found(&mut self, found: &DetectedSsb, period: f64) -> f64 {
        // Number of bursts since the last received one.
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
