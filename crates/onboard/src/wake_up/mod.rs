//! Wake-up policies: when an angle of arrival is estimated. [`WakeUpPolicy`] is the interface for
//! plug-ins; `pid.rs` contains the paper's Algorithm 1.

mod adaptive;
mod choose;
mod controller;
mod due;
mod fixed;
mod pid;
mod policy;
mod uncertainty;

pub use adaptive::Adaptive;
pub use choose::{built_in, resolve};
pub use controller::Controller;
pub use due::Due;
pub use fixed::FixedInterval;
pub use pid::Pid;
pub use policy::{Situation, WakeUpPolicy};
pub use uncertainty::UncertaintyDriven;
