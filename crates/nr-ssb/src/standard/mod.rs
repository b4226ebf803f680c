//! Definitions of the standard for an SSB: identities, positions in time and frequency, sequences,
//! coding.

pub mod band;
pub mod coding;
pub mod grid;
pub mod message;
pub mod numerology;
pub mod pbch;
pub(crate) mod pci;
pub mod sequence;
