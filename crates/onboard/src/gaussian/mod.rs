//! Gaussians of fixed size, without allocation but for the smoother: the belief that a linearised motion spreads and
//! scalar measurements correct, its fixed-interval smoother, and quantiles. What they are of, nobody here knows.

mod belief;
mod quantile;
pub mod smoother;

pub use belief::{
    CERTAIN_SIGMAS, Gaussian, Innovation, Matrix, dot, identity, principal_variances, product,
    transformed, with_outliers,
};
pub use quantile::{RadialQuantile, normal_quantile};
