//! Linear algebra of small complex matrices of known size.

pub(crate) mod dense;
pub(crate) mod eigen;
pub(crate) mod hermitians;
pub(crate) mod matrix;
