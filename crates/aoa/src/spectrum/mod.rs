//! The spectra `a(omega)^H M a(omega)` that every method but ESPRIT searches, and how they are searched.

pub(crate) mod polynomial;
pub(crate) mod side_by_side;
