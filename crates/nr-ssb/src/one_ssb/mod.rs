//! Processing of one SSB, from a candidate in time to cell, beam, message and measurements.

pub(crate) mod acquire;
pub(crate) mod broadcast;
pub(crate) mod identify;
pub mod measure;
