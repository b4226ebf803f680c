//! The channel between radio heads and the vehicle's antennas, as snapshots or as samples.
//! [`Propagation`] is the door for others.

mod fading;
mod head_channel;
mod iq;
mod phasor;
mod propagation;
mod shadowing;

pub use fading::RicianPropagation;
pub use head_channel::{HeadChannel, Reception};
pub use iq::{IqAir, IqBurst};
pub use propagation::Propagation;
pub use shadowing::Shadowing;
