//! From truth to snapshots: link budget, shadowing, fading, noise.

mod fading;
mod link_budget;
mod shadowing;
mod snapshots;

pub use fading::RicianFading;
pub use link_budget::LinkBudget;
pub use shadowing::Shadowing;
pub use snapshots::{HeadChannel, Reception};
