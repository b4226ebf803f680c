//! Channel between radio heads and the vehicle's antennas, for snapshots or for samples. Other
//! channel models implement [`Propagation`].

mod blockage;
mod clocks;
mod fading;
mod head_channel;
mod iq;
mod propagation;
mod shadowing;
pub mod tr38901;
mod traced;

pub use blockage::Blockage;
pub use fading::RicianPropagation;
pub use head_channel::{HeadChannel, Reception};
pub use iq::{IqAir, IqBurst};
pub use propagation::{Link, Propagation};
pub use shadowing::Shadowing;
pub use tr38901::Tr38901Propagation;
pub use traced::{Paths, PathsError, TracedPropagation};
