//! Whether the angles still come from where they are expected.

use super::measurement::{UpdateReason, UpdateVerdict};

/// Weight of the newest angle.
const WEIGHT: f64 = 1.0 / 16.0;

/// Angles before anything is said.
const LEAST: u32 = 5;

/// Share of refused angles above which the vehicle is lost, and below which it is not.
const LOST: f64 = 0.5;
const SURE: f64 = 0.2;

/// Mean squared Mahalanobis distance, capped at the gate, above which it is lost as well; it is 1
/// where the belief is right.
const SURPRISED: f64 = 5.0;

/// A running judgement of the localizer's own expectations.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Watch {
    refused: f64,
    surprise: f64,
    angles: u32,
}

impl Watch {
    /// Takes in what became of an angle; such that met no expectation say nothing.
    pub fn see(&mut self, verdict: &UpdateVerdict) {
        let refused = match verdict.reason {
            UpdateReason::Consistent => 0.0,
            UpdateReason::Outlier => 1.0,
            _ => return,
        };
        let Some(distance) = verdict.mahalanobis_squared else {
            return;
        };
        let capped = distance.min(verdict.threshold.unwrap_or(distance));
        self.angles = self.angles.saturating_add(1);
        let weight = WEIGHT.max(1.0 / f64::from(self.angles));
        self.refused += weight * (refused - self.refused);
        self.surprise += weight * (capped - self.surprise);
    }

    /// Whether the angles come from elsewhere than expected.
    pub fn is_lost(&self) -> bool {
        self.angles >= LEAST && (self.refused > LOST || self.surprise > SURPRISED)
    }

    /// Whether they come from where they are expected.
    pub fn is_sure(&self) -> bool {
        self.angles >= LEAST && self.refused < SURE && self.surprise < SURPRISED
    }
}
