//! What can be read of site, vehicle and platform, and is most likely not what was meant: degrees
//! for radians, millimetres for metres, a head below the ground. What cannot be is refused on
//! reading ([`SettingsError`](crate::settings::SettingsError)); what is found here is said, and
//! driven all the same.
//!
//! Each check is one row of a table ([`Usual`]) where a number tells by itself, and a function where
//! it takes several. Beside it stand its reason and what to write instead.

mod hearing;
mod platform;
mod site;
mod together;
mod usual;
mod vehicle;
mod warning;

pub use platform::of_platform;
pub use together::{of_both, of_both_along, of_site};
pub use usual::{Usual, as_degrees, as_millimetres, as_milliseconds, as_percent, rounded, unusual};
pub use vehicle::{of_vehicle, speed_in_mps};
pub use warning::Warning;
