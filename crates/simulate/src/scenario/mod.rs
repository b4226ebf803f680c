//! Scenario: nominal site and vehicle, the environment, and the deviations of the truth.

mod channel;
mod faults;
mod iq;
mod motion;
mod place_target;
mod plant;
mod plausible;
mod price;
mod scenario_file;
mod size;
mod target;
mod truth;
mod unusual_prices;

pub use channel::{BlockageSettings, ChannelModel, ChannelSettings, HallSettings, ScatterModel};
pub use faults::{FaultKind, FaultSettings};
pub use iq::IqSettings;
pub use motion::{MotionSettings, StopSettings};
pub use place_target::PlaceTarget;
pub use plant::{Fleet, Plant, Prices};
pub use price::Price;
pub use scenario_file::{Fidelity, Scenario};
pub use size::DriveSize;
pub use target::Target;
pub use truth::TruthSettings;
