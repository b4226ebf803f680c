//! Configuration of the nominal model, as TOML files: a *site* (the plant, one file for the fleet),
//! a *vehicle* and a *platform* (onboard computer).
//!
//! The names of the keys contain the units. Methods of the types return SI values, which all
//! computations use. Every uncertain value has a key for its standard deviation. Ranges of numbers
//! are attributes of the fields: the JSON Schema contains them, and [`TomlFile`] checks them.

mod array;
mod array_shape;
mod check;
mod error;
mod figure;
mod integrity;
mod limits;
mod localizer;
mod odometry;
mod overlay;
mod platform;
mod power;
mod radio;
mod ranging;
mod read;
mod receiver;
mod renamed;
mod road;
mod shipped;
mod site;
mod start;
mod toml_file;
mod underlay;
mod vehicle;
mod wake_up;
mod walls;

pub use array::ArraySettings;
pub use array_shape::{ArrayShape, MeasuredShape};
pub use check::Check;
pub use error::SettingsError;
pub use figure::{Boundary, Extent, Figure, Provenance, Quantity};
pub use integrity::{ERROR_CORRELATION_S, FaultProbability, IntegritySettings};
pub use localizer::{DeadReckoningSettings, HeadingBetween, LocalizerSettings, TrackerSettings};
pub use odometry::{DriveKind, GyroscopeSettings, LaneKeepingSettings, OdometerSettings};
pub use overlay::merge_table;
pub use platform::Platform;
pub use power::{CorePower, CpuSettings, IdleSettings, PowerMode, ReceiverPower, SuspendSettings};
pub use radio::{HeadArraySettings, RadioHeadSettings, SsbSettings};
pub use ranging::{RangingKind, RangingSettings};
pub use read::{from_table, parse};
pub use receiver::{EstimatorMethod, EstimatorSettings, Pilots, ReceiverSettings};
pub use road::RoadSettings;
pub use shipped::Shipped;
pub use site::{SPEED_OF_LIGHT_MPS, Site};
pub use start::StartSettings;
pub use toml_file::{Library, NamedText, TomlFile, TomlFormat};
pub use underlay::UnderlaySettings;
pub use vehicle::{PlatformSettings, Vehicle, check_together};
pub use wake_up::{
    DeltaT, FixedSettings, GatedSettings, PidSettings, SensingMode, SnrSetPoint, SsbSelection,
    TriggerSettings, UncertaintySettings, WakeUpSettings,
};
pub use walls::WallSettings;
