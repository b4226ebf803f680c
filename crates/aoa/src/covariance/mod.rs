//! The covariance of the antennas, which is all that an estimate sees of the samples.

pub(crate) mod averaging;
pub(crate) mod sample;
