//! Public estimators: from samples or a covariance to directions.

pub(crate) mod batch;
pub(crate) mod channel_gains;
pub(crate) mod choice;
pub(crate) mod direction_finder;
mod noise_eigenvalues;
pub(crate) mod one;
pub(crate) mod pilots;
pub(crate) mod pseudo_spectrum;
mod residual;
pub(crate) mod several;
mod several_directions;
mod side_by_side;
pub(crate) mod smoothing;
pub(crate) mod source_count;
mod spread;
pub(crate) mod unequal;
mod whole_array;
