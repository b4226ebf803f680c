//! Channel coding of the PBCH.

pub mod crc;
pub mod polar;
pub mod rate_matching;
