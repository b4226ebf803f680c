//! Implausible values of site, vehicle and platform: degrees instead of radians, millimetres
//! instead of metres, a radio head below the ground. Impossible values are errors on reading
//! ([`SettingsError`](crate::settings::SettingsError)); implausible ones are warnings.
//!
//! A check of a single number is a row of a table ([`Usual`]), with its reason and a suggestion. A
//! check of several values is a function.

mod hearing;
mod platform;
mod site;
mod together;
mod usual;
mod vehicle;
mod warning;

pub use platform::of_platform;
pub use together::{of_site, of_site_and_vehicle, of_site_and_vehicle_along};
pub use usual::{
    Usual, as_centimetres, as_degrees, as_millimetres, as_milliseconds, as_percent, rounded,
    unusual,
};
pub use vehicle::{of_vehicle, speed_in_mps};
pub use warning::Warning;
