//! Whether noise and geometry leave a doubt of an estimate.

use std::fmt;

/// Whether an estimate may be used as a Gaussian measurement with its standard deviation, if plane waves in
/// white noise are what was received: that is told beside it, by the
/// [`GoodnessOfFit`](crate::GoodnessOfFit).
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
    /// The SNR is too low, below 0 dB, to exclude a wholly wrong direction with so many snapshots.
    ThresholdSnr,
    /// Too few snapshots to exclude a wholly wrong direction at this SNR, which is above 0 dB.
    TooFewSnapshots,
    /// What arrives with the source's waveform is no plane wave: there are reflections, or the antennas
    /// are not as described. The standard deviation holds what that displaces, see
    /// [`GoodnessOfFit`](crate::GoodnessOfFit).
    Multipath,
    /// What the sources leave is no white noise: there are more of them, or the channels' noise is
    /// unequal, or larger than stated.
    MoreSources,
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
    pub const ALL: [Self; 10] = [
        Self::Resolved,
        Self::Unresolved(Reason::ThresholdSnr),
        Self::Unresolved(Reason::NearEndFire),
        Self::Unresolved(Reason::Ambiguous),
        Self::Unresolved(Reason::SourcesNotSeparated),
        Self::Unresolved(Reason::Correlated),
        Self::Unresolved(Reason::EdgeOfElevations),
        Self::Unresolved(Reason::TooFewSnapshots),
        Self::Unresolved(Reason::Multipath),
        Self::Unresolved(Reason::MoreSources),
    ];

    /// The reason, if there is one.
    pub const fn reason(&self) -> Option<Reason> {
        match self {
            Self::Resolved => None,
            Self::Unresolved(reason) => Some(*reason),
        }
    }

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
            Self::Unresolved(Reason::TooFewSnapshots) => 7,
            Self::Unresolved(Reason::Multipath) => 8,
            Self::Unresolved(Reason::MoreSources) => 9,
        }
    }
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::ThresholdSnr => "SNR too low to exclude a wholly wrong direction",
            Self::TooFewSnapshots => "too few snapshots to exclude a wholly wrong direction",
            Self::Multipath => "no plane wave: reflections, or antennas unlike those described",
            Self::MoreSources => {
                "more than white noise is left: another source, or unequal channels"
            }
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
