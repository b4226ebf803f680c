//! Verdict on an estimate with respect to noise and geometry.

use std::fmt;

/// Whether an estimate is a Gaussian measurement with its standard deviation, provided that the
/// samples are plane waves in white noise. [`GoodnessOfFit`](crate::GoodnessOfFit) tests this
/// assumption.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// The estimate is resolved.
    Resolved,
    /// The estimate is not resolved, with the reason.
    Unresolved(Reason),
}

/// Reason for an unreliable estimate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Reason {
    /// The SNR is below 0 dB and too low to exclude an outlier with this number of snapshots.
    ThresholdSnr,
    /// The number of snapshots is too small to exclude an outlier at this SNR, which is above 0 dB.
    TooFewSnapshots,
    /// The signal with the source's waveform is not a plane wave because of reflections or
    /// deviations of the antennas. The standard deviation includes the effect, see
    /// [`GoodnessOfFit`](crate::GoodnessOfFit).
    Multipath,
    /// The residual is not white noise: there are more sources, the noise of the channels is
    /// unequal, or it is larger than specified.
    MoreSources,
    /// The direction is so near to the array's axis that the opposite direction or no direction
    /// fits as well.
    NearEndFire,
    /// Elements are more than half a wavelength apart, so that several directions fit equally well.
    Ambiguous,
    /// There are fewer peaks than sources, or two sources are closer than their standard
    /// deviations.
    SourcesNotSeparated,
    /// Sources are too correlated for the method; spatial smoothing is required.
    Correlated,
    /// The estimate is at the limit of the elevation range, so that the source may be outside.
    EdgeOfElevations,
}

impl Verdict {
    /// All verdicts.
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

    /// Returns the reason; `None` for a resolved estimate.
    pub const fn reason(&self) -> Option<Reason> {
        match self {
            Self::Resolved => None,
            Self::Unresolved(reason) => Some(*reason),
        }
    }

    /// Returns the index in [`Verdict::ALL`].
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
            Self::ThresholdSnr => "SNR too low to exclude an outlier",
            Self::TooFewSnapshots => "too few snapshots to exclude an outlier",
            Self::Multipath => "not a plane wave: reflections, or deviations of the antennas",
            Self::MoreSources => "residual is not white noise: another source, or unequal channels",
            Self::NearEndFire => "too near to the array's axis",
            Self::Ambiguous => "several directions fit: elements more than half a wavelength apart",
            Self::SourcesNotSeparated => "sources not separated",
            Self::Correlated => "sources too correlated: average over subarrays",
            Self::EdgeOfElevations => "at the limit of the elevation range",
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
