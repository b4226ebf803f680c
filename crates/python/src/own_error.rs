//! What a localizer says of its own error, as numbers: NaN where it says nothing.

use onboard::localize::Integrity;
use recording::replay::LocatedPose;
use simulate::Step;

/// A pose with what its localizer says of its error.
pub trait OwnError {
    /// Covariance of x, y and heading.
    fn covariance(&self) -> Option<&[[f64; 3]; 3]>;
    /// Protection levels.
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

/// A protection level.
pub fn level(of: &impl OwnError, which: fn(&Integrity) -> f64) -> f64 {
    of.integrity().map_or(f64::NAN, which)
}

/// An element of the covariance.
pub fn covariance(of: &impl OwnError, row: usize, column: usize) -> f64 {
    let element = of.covariance().and_then(|it| it.get(row)?.get(column));
    element.copied().unwrap_or(f64::NAN)
}
