//! The array: where its antennas are, and what its receive channels do to them.

pub(crate) mod arbitrary;
pub(crate) mod calibration;
pub(crate) mod linear;
pub(crate) mod manifold;
pub(crate) mod measured;
pub(crate) mod steering;
