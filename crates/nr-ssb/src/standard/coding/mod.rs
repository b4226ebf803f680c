//! Channel coding of the PBCH.

pub mod polar;
pub mod rate_matching;
