//! Spectra `a(omega)^H M a(omega)`, which all methods except ESPRIT search, and their maxima.

pub(crate) mod polynomial;
pub(crate) mod side_by_side;
