//! What the antennas received of an SSB, as resource elements.

use num_complex::Complex32;

use crate::standard::grid::{SUBCARRIERS, SYMBOLS};

/// Largest number of antennas.
pub const MAX_ANTENNAS: usize = 16;

/// Received resource elements of one antenna, `[symbol][subcarrier]`.
pub type ReceivedGrid = [[Complex32; SUBCARRIERS]; SYMBOLS];
