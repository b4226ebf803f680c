//! Tracking of a known cell at a known time, with four FFTs per antenna.
//!
//! For each SSB: demodulate at the predicted delay and frequency offset; detect the SSB and measure
//! its delay with PSS and SSS; identify the beam with the DM-RS; estimate delay and frequency
//! offset with all pilots; despread each symbol to one complex amplitude per antenna. The PBCH is
//! decoded on request only, and its 432 elements then are additional pilots.
//!
//! A tracker never searches: an SSB outside the range of its expected delay is missed, and expected
//! again one period later. The caller decides about searches in the meantime, and passes their
//! results to [`Tracker::found`].

mod beams;
mod clock;
mod despread;
mod error;
mod frequency;
mod index;
mod late;
mod observe;
mod output;
mod tracker;

pub use crate::dsp::received_grid::{PerAntenna, ReceivedGrid};
pub use error::TrackError;
pub use output::TrackerOutput;
pub use tracker::Tracker;
