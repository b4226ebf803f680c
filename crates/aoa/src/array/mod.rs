//! Array: antenna positions and receive channels.

pub(crate) mod arbitrary;
pub(crate) mod calibration;
pub(crate) mod linear;
pub(crate) mod manifold;
pub(crate) mod measured;
pub(crate) mod steering;
