//! Tracking: a cell that is known, at a time that is known, for four transforms per antenna.
//!
//! Per SSB: demodulate at the predicted delay and frequency offset; PSS and SSS say whether the
//! cell is there; DM-RS says which beam it is; all pilots give delay and frequency offset anew and
//! are despread, symbol by symbol, to one complex number per antenna. The PBCH is decoded only on
//! request, and its 432 elements are then pilots as well.

mod beams;
mod despread;
mod error;
mod frequency;
mod tracked;
mod tracker;

pub use error::TrackError;
pub use tracked::Tracked;
pub use tracker::Tracker;
