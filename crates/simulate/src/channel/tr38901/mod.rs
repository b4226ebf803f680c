//! Geometry-based stochastic channel of 3GPP TR 38.901 (V19.2) between one vertically polarised
//! antenna of a radio head and the vehicle's array: UMi and the indoor factories.
//!
//! The line-of-sight state, the K factor and the shadowing are Gaussian processes of the distance
//! driven ([`track`]). Clusters ([`clusters`]) are drawn one correlation distance apart as plane
//! waves of fixed directions, and are cross-faded in between.

mod clusters;
mod drops;
mod environment;
mod large_scale;
mod normal;
mod propagation;
mod track;

pub use drops::{Drop, draw_drops};
pub use environment::{Environment, LinkGeometry};
pub use propagation::Tr38901Propagation;
