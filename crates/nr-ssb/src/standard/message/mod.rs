//! What the PBCH says, the bits that say it, and their checksum.

pub mod crc;
pub mod mib;
pub mod payload;
