//! Delay of the first path.
//!
//! In noise alone, the phase slope over the subcarriers is the maximum-likelihood delay, and its
//! standard deviation is the Cramér–Rao bound, `1/(2π β √(2 N SNR))` with the RMS bandwidth β. In
//! multipath, the slope is that of the centroid. The delay is therefore the mean of the posterior
//! of the first path under a channel model, `first_path.rs`, and its standard deviation includes
//! multipath.

/// Multipath of one SSB.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Multipath {
    /// The elements agree with a single path.
    NotDetected,
    /// Multipath is detected, and the first path is stronger than all others together.
    Separated,
    /// The first path may be weaker than the others, or blocked. The standard deviation of the delay
    /// then depends on the prior distribution of the delay spread; a user should give the
    /// measurement less weight or none.
    Uncertain,
}

impl Multipath {
    /// Returns the name in tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::NotDetected => "not detected",
            Self::Separated => "separated",
            Self::Uncertain => "uncertain",
        }
    }
}

/// Delay of the first path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Delay {
    /// First sample of the SSB including its cyclic prefix on the first path, in samples, relative to
    /// the first sample of the stream: at the base rate from a tracker, at the input's rate from a
    /// receiver.
    pub first_path_start: f64,
    /// Delay of the first path relative to `sample_start`, the start according to all paths, in
    /// seconds; usually negative.
    pub offset_s: f64,
    /// Standard deviation in seconds: noise and multipath.
    pub sigma_s: f64,
    /// Standard deviation due to noise in a channel of one path, in seconds.
    pub noise_sigma_s: f64,
    /// State of the first path.
    pub multipath: Multipath,
}
