//! Synchronization signal blocks (SSBs) of 5G NR.

pub mod burst;
pub mod crc;
pub mod dmrs;
mod error;
pub mod gold;
pub mod grid;
pub mod mib;
pub mod numerology;
pub mod ofdm;
pub mod payload;
pub mod pbch;
mod pci;
pub mod polar;
pub mod pss;
mod qpsk;
pub mod rate_matching;
pub mod sss;

pub use burst::{Beam, Burst};
pub use error::Error;
pub use gold::Gold;
pub use grid::SsbGrid;
pub use mib::Mib;
pub use num_complex::Complex32;
pub use numerology::{Case, Lmax, Numerology, SubcarrierSpacing};
pub use ofdm::Ofdm;
pub use payload::BchPayload;
pub use pci::Pci;
