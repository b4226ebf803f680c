//! Whether an estimate may be relied on.

use std::fmt;

/// Whether an estimate may be used as a Gaussian measurement with its standard deviation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// It may.
    Resolved,
    /// It may not, for this reason.
    Unresolved(Reason),
}

/// Why an estimate should not be relied on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Reason {
    /// SNR and snapshots are too few to exclude a wholly wrong direction.
    ThresholdSnr,
    /// So near to the array's axis that the other end, or no direction, fits as well.
    NearEndFire,
    /// Elements more than half a wavelength apart: several directions fit equally well.
    Ambiguous,
    /// Fewer peaks than sources, or two sources closer than their standard deviations.
    SourcesNotSeparated,
    /// Sources that are reflections of each other, more alike than the method can tell apart: average
    /// over subarrays.
    Correlated,
    /// At the edge of the elevations that were looked at, beyond which the source may be as well.
    EdgeOfElevations,
}

impl Verdict {
    /// Every verdict there is.
    pub const ALL: [Self; 7] = [
        Self::Resolved,
        Self::Unresolved(Reason::ThresholdSnr),
        Self::Unresolved(Reason::NearEndFire),
        Self::Unresolved(Reason::Ambiguous),
        Self::Unresolved(Reason::SourcesNotSeparated),
        Self::Unresolved(Reason::Correlated),
        Self::Unresolved(Reason::EdgeOfElevations),
    ];

    /// Its place in [`Verdict::ALL`].
    pub const fn index(&self) -> usize {
        match self {
            Self::Resolved => 0,
            Self::Unresolved(Reason::ThresholdSnr) => 1,
            Self::Unresolved(Reason::NearEndFire) => 2,
            Self::Unresolved(Reason::Ambiguous) => 3,
            Self::Unresolved(Reason::SourcesNotSeparated) => 4,
            Self::Unresolved(Reason::Correlated) => 5,
            Self::Unresolved(Reason::EdgeOfElevations) => 6,
        }
    }
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::ThresholdSnr => "SNR too low to exclude a wholly wrong direction",
            Self::NearEndFire => "too near to the array's axis",
            Self::Ambiguous => "several directions fit: elements more than half a wavelength apart",
            Self::SourcesNotSeparated => "sources not separated",
            Self::Correlated => "sources too correlated: average over subarrays",
            Self::EdgeOfElevations => "at the edge of the elevations looked at",
        })
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Resolved => f.write_str("resolved"),
            Self::Unresolved(reason) => write!(f, "unresolved: {reason}"),
        }
    }
}
