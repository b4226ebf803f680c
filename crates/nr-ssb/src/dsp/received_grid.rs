//! Received resource elements of an SSB.

use arrayvec::ArrayVec;
use num_complex::Complex32;

use crate::standard::grid::{SUBCARRIERS, SYMBOLS};

/// Maximum number of antennas.
pub const MAX_ANTENNAS: usize = 16;

/// One value for each antenna, without memory on the heap.
pub type PerAntenna<T> = ArrayVec<T, MAX_ANTENNAS>;

/// Received resource elements of one antenna, `[symbol][subcarrier]`.
pub type ReceivedGrid = [[Complex32; SUBCARRIERS]; SYMBOLS];
