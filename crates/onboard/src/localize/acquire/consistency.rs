//! Consistency of the innovations of most radio heads with the filter.

use crate::clone_in_place::clone_in_place;
use crate::localize::output::{UpdateReason, UpdateResult};
use crate::radio_head::RadioHead;

/// Weight of the newest angle of a radio head.
const WEIGHT: f64 = 1.0 / 8.0;

/// Minimum number of angles for a decision.
const LEAST: u32 = 5;

/// Number of angles, of all radio heads, within which a radio head must have been received to
/// count.
const RECENT: u32 = 32;

/// Fraction of rejected angles above which a radio head is inconsistent with the filter.
const LOST: f64 = 0.5;
/// Fraction of rejected angles below which a radio head is consistent with the filter.
const SURE: f64 = 0.2;

/// Mean squared Mahalanobis distance, limited by the gate, above which a radio head is
/// inconsistent. Its expected value is 1.
const SURPRISED: f64 = 5.0;

clone_in_place! {
    /// Exponentially weighted statistics of the innovations of each radio head, with a decision by
    /// majority: a radio head that is received by a reflection is inconsistent for metres, whatever
    /// the number of its angles.
    #[derive(Debug, PartialEq)]
    pub struct ConsistencyMonitor {
        heads: Vec<HeadStatistics>,
        angles: u32,
    }
}

/// Statistics of a radio head: fraction of rejected angles, mean squared Mahalanobis distance.
#[derive(Clone, Copy, Debug, PartialEq)]
struct HeadStatistics {
    pci: u16,
    ssb_index: u8,
    refused: f64,
    surprise: f64,
    received: u32,
    /// Index of the radio head's last angle among all angles.
    last: u32,
}

impl ConsistencyMonitor {
    /// Creates the statistics of these radio heads.
    pub fn new(heads: &[RadioHead]) -> Self {
        let head = |head: &RadioHead| HeadStatistics {
            pci: head.pci,
            ssb_index: head.ssb_index,
            refused: 0.0,
            surprise: 0.0,
            received: 0,
            last: 0,
        };
        Self {
            heads: heads.iter().map(head).collect(),
            angles: 0,
        }
    }

    /// Adds the result of an angle with `noise_scale` times its specified variance. Angles without
    /// an innovation are ignored.
    pub fn see(&mut self, head: &RadioHead, verdict: &UpdateResult, noise_scale: f64) {
        let refused = match verdict.reason {
            UpdateReason::Consistent => 0.0,
            UpdateReason::Outlier => 1.0,
            _ => return,
        };
        let Some(distance) = verdict.mahalanobis_squared else {
            return;
        };
        let capped = distance.min(verdict.threshold.unwrap_or(distance)) / noise_scale;
        self.angles = self.angles.saturating_add(1);
        let is_it = |it: &&mut HeadStatistics| (it.pci, it.ssb_index) == (head.pci, head.ssb_index);
        let Some(head) = self.heads.iter_mut().find(is_it) else {
            return;
        };
        head.last = self.angles;
        head.received = head.received.saturating_add(1);
        let weight = WEIGHT.max(1.0 / f64::from(head.received));
        head.refused += weight * (refused - head.refused);
        head.surprise += weight * (capped - head.surprise);
    }

    /// Resets all statistics.
    pub fn reset(&mut self) {
        for head in &mut self.heads {
            head.received = 0;
        }
        self.angles = 0;
    }

    /// Returns the fraction of recently received radio heads that are inconsistent; `None` before
    /// enough angles.
    fn off(&self, refused: f64) -> Option<f64> {
        let is_recent =
            |it: &&HeadStatistics| it.received > 0 && self.angles.saturating_sub(it.last) < RECENT;
        let recent = || self.heads.iter().filter(is_recent);
        let off = recent().filter(|it| it.refused > refused || it.surprise > SURPRISED);
        (self.angles >= LEAST).then(|| off.count() as f64 / recent().count().max(1) as f64)
    }

    /// Whether most radio heads are inconsistent with the filter.
    pub fn is_lost(&self) -> bool {
        self.off(LOST).is_some_and(|share| share > 0.5)
    }

    /// Whether most radio heads are consistent with the filter.
    pub fn is_consistent(&self) -> bool {
        self.off(SURE).is_some_and(|share| share < 0.5)
    }
}
