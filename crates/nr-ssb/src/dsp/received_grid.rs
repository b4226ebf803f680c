//! Received resource elements of an SSB.

use num_complex::Complex32;

use crate::standard::grid::{SUBCARRIERS, SYMBOLS};

/// Maximum number of antennas.
pub const MAX_ANTENNAS: usize = 16;

/// Received resource elements of one antenna, `[symbol][subcarrier]`.
pub type ReceivedGrid = [[Complex32; SUBCARRIERS]; SYMBOLS];
