//! Angle of arrival with uniform linear arrays.
mod array;
mod batch;
pub mod bound;
mod calibration;
mod covariance;
mod eigen;
mod error;
mod esprit;
mod estimate;
mod kernel;
mod linear;
mod list;
mod math;
mod maximum_likelihood;
mod music;
mod peak;
mod pilots;
mod root_music;
mod source_count;
mod spectrum;

pub use array::Array;
pub use batch::{Batch, BatchError};
pub use calibration::Calibration;
pub use covariance::{Covariance, Matrix};
pub use error::Error;
pub use estimate::{
    AngleEstimate, AngleEstimates, Method, Reason, Verdict, estimate, estimate_several,
};
pub use kernel::Real;
pub use list::List;
pub use num_complex::Complex64;
pub use pilots::maximum_likelihood_pilots;
pub use source_count::{Criterion, source_count};
