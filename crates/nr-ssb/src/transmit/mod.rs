//! Generation of a cell's samples from payloads.

pub mod burst;
pub mod ofdm;
