//! From truth to snapshots or samples: link budget, shadowing, fading, noise.

mod fading;
mod iq;
mod link_budget;
mod shadowing;
mod snapshots;

pub use fading::RicianFading;
pub use iq::{IqAir, IqBurst};
pub use link_budget::LinkBudget;
pub use shadowing::Shadowing;
pub use snapshots::{HeadChannel, Reception};
