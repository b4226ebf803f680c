//! Whether the innovations of most radio heads are consistent with the filter.

use crate::clone_in_place::clone_in_place;
use crate::localize::output::{UpdateReason, UpdateVerdict};
use crate::radio_head::RadioHead;

/// Weight of the newest angle of a radio head.
const WEIGHT: f64 = 1.0 / 8.0;

/// Angles before anything is said.
const LEAST: u32 = 5;

/// Angles, of all radio heads, within which one must have been heard to count.
const RECENT: u32 = 32;

/// Share of refused angles above which a radio head is not where it is expected, and below which it
/// is.
const LOST: f64 = 0.5;
const SURE: f64 = 0.2;

/// Mean squared Mahalanobis distance, capped at the gate, above which it is not as well; it is 1
/// where the belief is right.
const SURPRISED: f64 = 5.0;

clone_in_place! {
    /// Exponentially weighted statistics of the innovations of each radio head, of which the majority decides: one that
    /// is seen by a reflection is off for metres, whatever the number of its angles.
    #[derive(Debug, PartialEq)]
    pub struct ConsistencyMonitor {
        heads: Vec<HeadStatistics>,
        angles: u32,
    }
}

/// Those of a radio head: share of refused angles, mean squared Mahalanobis distance.
#[derive(Clone, Copy, Debug, PartialEq)]
struct HeadStatistics {
    pci: u16,
    ssb_index: u8,
    refused: f64,
    surprise: f64,
    heard: u32,
    /// Number of the last one among all angles.
    last: u32,
}

impl ConsistencyMonitor {
    /// Nothing is known yet of these radio heads.
    pub fn new(heads: &[RadioHead]) -> Self {
        let head = |head: &RadioHead| HeadStatistics {
            pci: head.pci,
            ssb_index: head.ssb_index,
            refused: 0.0,
            surprise: 0.0,
            heard: 0,
            last: 0,
        };
        Self {
            heads: heads.iter().map(head).collect(),
            angles: 0,
        }
    }

    /// Takes in what became of an angle to a radio head, of so many times the variance that is stated;
    /// such that met no expectation say nothing.
    pub fn see(&mut self, head: &RadioHead, verdict: &UpdateVerdict, noise_ratio: f64) {
        let refused = match verdict.reason {
            UpdateReason::Consistent => 0.0,
            UpdateReason::Outlier => 1.0,
            _ => return,
        };
        let Some(distance) = verdict.mahalanobis_squared else {
            return;
        };
        let capped = distance.min(verdict.threshold.unwrap_or(distance)) / noise_ratio;
        self.angles = self.angles.saturating_add(1);
        let is_it = |it: &&mut HeadStatistics| (it.pci, it.ssb_index) == (head.pci, head.ssb_index);
        let Some(head) = self.heads.iter_mut().find(is_it) else {
            return;
        };
        head.last = self.angles;
        head.heard = head.heard.saturating_add(1);
        let weight = WEIGHT.max(1.0 / f64::from(head.heard));
        head.refused += weight * (refused - head.refused);
        head.surprise += weight * (capped - head.surprise);
    }

    /// Forgets all that was seen.
    pub fn reset(&mut self) {
        for head in &mut self.heads {
            head.heard = 0;
        }
        self.angles = 0;
    }

    /// Share of the radio heads heard lately that are off; `None` before enough angles.
    fn off(&self, refused: f64) -> Option<f64> {
        let is_recent =
            |it: &&HeadStatistics| it.heard > 0 && self.angles.saturating_sub(it.last) < RECENT;
        let recent = || self.heads.iter().filter(is_recent);
        let off = recent().filter(|it| it.refused > refused || it.surprise > SURPRISED);
        (self.angles >= LEAST).then(|| off.count() as f64 / recent().count().max(1) as f64)
    }

    /// Whether the angles come from elsewhere than expected.
    pub fn is_lost(&self) -> bool {
        self.off(LOST).is_some_and(|share| share > 0.5)
    }

    /// Whether they come from where they are expected.
    pub fn is_sure(&self) -> bool {
        self.off(SURE).is_some_and(|share| share < 0.5)
    }
}
