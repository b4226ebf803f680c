//! Tracking: a cell that is known, at a time that is known, for four transforms per antenna.
//!
//! Per SSB: demodulate at the predicted delay and frequency offset; PSS and SSS say how late the
//! SSB is and whether it is there at all; DM-RS says which beam it is; all pilots give delay and
//! frequency offset anew and are despread, symbol by symbol, to one complex number per antenna. The
//! PBCH is decoded only on request, and its 432 elements are then pilots as well.
//!
//! A tracker never searches: an SSB that is not within reach of where it is expected is missed, and
//! expected again a period later. Who searches meanwhile, and how often, is the caller's choice;
//! what is found is handed to [`Tracker::found`].

mod beams;
mod clock;
mod despread;
mod error;
mod frequency;
mod index;
mod late;
mod tracked;
mod tracker;

pub use error::TrackError;
pub use tracked::Tracked;
pub use tracker::Tracker;
