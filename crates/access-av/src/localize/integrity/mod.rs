//! How far the estimate can be trusted.

mod quantile;

pub use quantile::{RadialQuantile, normal_quantile};
