//! Numerical functions that do not depend on SSBs.

pub(crate) mod decibel;
pub(crate) mod false_alarm;
pub mod fft;
pub(crate) mod hermitian;
#[cfg(test)]
pub(crate) mod noise;
pub(crate) mod phasors;
pub(crate) mod sums;
