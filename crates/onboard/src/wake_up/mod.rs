//! When an angle of arrival is worth its energy. [`WakeUpPolicy`] is the door for others; the paper's
//! Algorithm 1 stands in `pid.rs` alone.

mod adaptive;
mod choose;
mod controller;
mod due;
mod fixed;
mod gated;
mod pid;
mod policy;
mod uncertainty;

pub use adaptive::Adaptive;
pub use choose::{built_in, resolve};
pub use controller::Controller;
pub use due::Due;
pub use fixed::FixedInterval;
pub use gated::Gated;
pub use pid::Pid;
pub use policy::{Situation, WakeUpPolicy};
pub use uncertainty::UncertaintyDriven;
