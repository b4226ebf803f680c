//! A scenario: a site and a vehicle, as they are believed to be, and the world around them.

mod channel;
mod faults;
mod iq;
mod motion;
mod plausible;
mod scenario_file;
mod size;
mod truth;

pub use channel::{BlockageSettings, ChannelModel, ChannelSettings, HallSettings, ScatterModel};
pub use faults::{FaultKind, FaultSettings};
pub use iq::IqSettings;
pub use motion::{MotionSettings, StopSettings};
pub use scenario_file::{Fidelity, Scenario};
pub use size::DriveSize;
pub use truth::{Draw, TruthSettings};
