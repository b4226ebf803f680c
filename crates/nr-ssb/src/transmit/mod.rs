//! From payloads to samples: what a cell sends.

pub mod burst;
pub mod ofdm;
