//! Searches of noise, and their false alarms.
#![allow(dead_code, reason = "each program uses its part")]

use nr_ssb::SubcarrierSpacing;
use nr_ssb::search::{SearchConfig, Searcher};

use crate::air;

/// Results of a number of searches of 20 ms each.
#[derive(Debug, Clone, Copy, Default)]
pub struct Tally {
    pub searches: u64,
    /// Searches that reported a cell, decoded or not.
    pub false_cells: u64,
    /// Number of false cells with a MIB and a correct CRC.
    pub false_mibs: u64,
    pub pss_candidates: u64,
    pub pbch_tried: u64,
}

impl Tally {
    pub fn add(&mut self, other: Self) {
        self.searches += other.searches;
        self.false_cells += other.false_cells;
        self.false_mibs += other.false_mibs;
        self.pss_candidates += other.pss_candidates;
        self.pbch_tried += other.pbch_tried;
    }
}

/// Searches of 20 ms of noise at 15 kHz, one with each seed.
pub fn search_noise(antennas: usize, seeds: impl Iterator<Item = u64>) -> Tally {
    let spacing = SubcarrierSpacing::Khz15;
    let mut searcher = Searcher::new(SearchConfig::new(spacing, antennas)).unwrap();
    let mut samples = air::silence(antennas, (0.02 * spacing.base_rate_hz()) as usize);
    let mut tally = Tally::default();
    for seed in seeds {
        let mut rng = air::rng(seed);
        air::fill_with_noise(&mut samples, 0.0, &mut rng);
        let found = searcher.search(&air::slices(&samples)).unwrap();
        tally.searches += 1;
        tally.false_cells += u64::from(!found.is_empty());
        tally.false_mibs += u64::from(found.iter().any(|ssb| ssb.payload.is_some()));
        let counts = searcher.counts();
        tally.pss_candidates += counts.pss_candidates as u64;
        tally.pbch_tried += counts.pbch_tried as u64;
    }
    tally
}

/// Returns the probability that `events` in `trials` refute with 95 % confidence: the upper limit
/// of Clopper and Pearson.
pub fn upper_limit(events: u64, trials: u64) -> f64 {
    let so_few = |p: f64| {
        let mut term = trials as f64 * (-p).ln_1p();
        let mut sum = term.exp();
        for i in 0..events {
            term += ((trials - i) as f64 / (i + 1) as f64).ln() + p.ln() - (-p).ln_1p();
            sum += term.exp();
        }
        sum
    };
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if so_few(middle) > 0.05 {
            low = middle;
        } else {
            high = middle;
        }
    }
    high
}
