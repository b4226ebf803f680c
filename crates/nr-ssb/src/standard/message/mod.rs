//! Content of the PBCH: message, bits and CRC.

pub mod crc;
pub mod mib;
pub mod payload;
