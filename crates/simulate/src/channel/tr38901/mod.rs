//! The geometry-based stochastic channel of 3GPP TR 38.901 (V19.2), for one antenna of a radio head
//! and the vehicle's array, vertically polarised: UMi and the indoor factories.
//!
//! Along the way run Gaussian processes: the state of the line of sight, K and shadowing of every
//! place ([`track`]). Clusters ([`clusters`]) are drawn a correlation distance apart, as plane waves
//! of fixed directions, and fade over into each other in between.

mod clusters;
mod drops;
mod environment;
mod large_scale;
mod normal;
mod propagation;
mod track;

pub use drops::{Drop, draw_drops};
pub use environment::{Environment, Place};
pub use propagation::Tr38901Propagation;
