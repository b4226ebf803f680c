//! What the PBCH says, and the bits that say it.

pub mod mib;
pub mod payload;
