//! Covariance and protection level of a localizer as numbers; NaN if it does not provide them.

use onboard::localize::Integrity;
use recording::replay::LocatedPose;
use simulate::Step;

/// Pose with the uncertainty that its localizer reports.
pub trait OwnError {
    /// Returns the covariance of x, y and heading.
    fn covariance(&self) -> Option<&[[f64; 3]; 3]>;
    /// Returns the protection levels.
    fn integrity(&self) -> Option<&Integrity>;
}

impl OwnError for Step {
    fn covariance(&self) -> Option<&[[f64; 3]; 3]> {
        self.covariance.as_ref()
    }

    fn integrity(&self) -> Option<&Integrity> {
        self.integrity.as_ref()
    }
}

impl OwnError for LocatedPose {
    fn covariance(&self) -> Option<&[[f64; 3]; 3]> {
        self.estimate.covariance.as_ref()
    }

    fn integrity(&self) -> Option<&Integrity> {
        self.estimate.integrity.as_ref()
    }
}

/// Returns a protection level in metres; NaN without one.
pub fn level(of: &impl OwnError, which: fn(&Integrity) -> f64) -> f64 {
    of.integrity().map_or(f64::NAN, which)
}

/// Returns an element of the covariance; NaN without one.
pub fn covariance(of: &impl OwnError, row: usize, column: usize) -> f64 {
    let element = of.covariance().and_then(|it| it.get(row)?.get(column));
    element.copied().unwrap_or(f64::NAN)
}
