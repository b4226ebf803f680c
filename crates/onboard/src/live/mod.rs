//! Pipeline for a program on a vehicle: inputs are samples, odometry and angles in order of
//! arrival; the status is available at any time.
//!
//! [`Live`] combines receiver and pipeline, and records missing samples, the reception of each
//! radio head and the energy. It has no clock and no threads, and allocates nothing after
//! initialisation, except for a new pose or a reset.
//!
//! ```
//! use onboard::live::{AngleObservation, State};
//! use onboard::localize::MeasurementKind;
//! use onboard::observation::OdometrySample;
//! use onboard::settings::{Platform, Shipped, Site, TomlFile, Vehicle};
//! use onboard::{Custom, Live};
//!
//! let site = Site::from_library("yard", &Shipped)?;
//! let vehicle = Vehicle::from_library("tugger", &Shipped)?;
//! let platform = Platform::from_library(&vehicle.platform.name, &Shipped)?;
//! // Without a start pose: the vehicle searches for it. Angles are given, and no samples.
//! let mut live = Live::new(&site, &vehicle, &platform, None, None, Custom::default())?;
//! live.odometry(&OdometrySample::of_speed(0.0, 1.5, None))?;
//! live.angle(&AngleObservation {
//!     kind: MeasurementKind::Angle,
//!     pci: site.radio_heads[0].pci,
//!     ssb_index: 0,
//!     time_s: 0.01,
//!     phase_rad: 0.3,
//!     sigma_rad: 0.02,
//!     snr_db: None,
//!     resolved: true,
//! })?;
//! let status = live.status(0.02)?;
//! assert_eq!(status.state, State::Searching);
//! println!("{}; {}", status.reason, status.reason.what_to_do());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod clocks;
mod error;
mod feed;
mod outcome;
mod saved;
mod start;
mod status;
mod stream;
mod stream_clock;
mod time_base;
mod time_check;

pub use error::LiveError;
pub use feed::{AngleObservation, Live, LiveEnergy, RangeObservation, RangeValue};
pub use outcome::{AngleRecord, HeadStatus};
pub use saved::{MAX_GROWTH_M, Resumption, SavedState};
pub use start::starting_at;
pub use status::{Reason, State, Status, TONES};
pub use stream::{SampleStream, StreamConfig, StreamCounts};
pub use stream_clock::Continuity;
pub use time_base::ClockStep;
pub use time_check::{TimeCheck, TimeDefect, TimeVerdict};
