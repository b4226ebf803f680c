//! Sequences of an SSB's resource elements.

pub mod dmrs;
pub mod gold;
pub(crate) mod m_sequence;
pub(crate) mod modulation;
pub mod pss;
pub mod sss;
