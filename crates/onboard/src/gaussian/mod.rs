//! Gaussian distributions of fixed size: prediction, scalar updates, fixed-interval smoother and
//! quantiles. Only the smoother allocates memory. The physical meaning of the states is defined by
//! the callers.

mod belief;
mod quantile;
pub mod smoother;

pub use belief::{
    CERTAIN_SIGMAS, Gaussian, Innovation, Matrix, dot, identity, principal_variances, product,
    transformed, with_outliers,
};
pub use quantile::{RadialQuantile, normal_quantile};
