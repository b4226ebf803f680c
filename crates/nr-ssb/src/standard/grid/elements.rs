//! Resource elements of an SSB.

use num_complex::Complex32;

use super::indices::{SUBCARRIERS, SYMBOLS};

/// The 960 resource elements of one SSB, k fastest.
#[derive(Debug, Clone, PartialEq)]
pub struct SsbGrid([Complex32; SUBCARRIERS * SYMBOLS]);

impl SsbGrid {
    /// Returns a grid of zeros.
    pub const fn zeros() -> Self {
        Self([Complex32::ZERO; SUBCARRIERS * SYMBOLS])
    }

    /// Returns all elements, with index k + 240·l.
    pub const fn elements(&self) -> &[Complex32; SUBCARRIERS * SYMBOLS] {
        &self.0
    }

    /// Returns all elements, mutable.
    pub const fn elements_mut(&mut self) -> &mut [Complex32; SUBCARRIERS * SYMBOLS] {
        &mut self.0
    }

    /// Returns the 240 subcarriers of each symbol, l = 0 to 3.
    pub fn symbols(&self) -> impl ExactSizeIterator<Item = &[Complex32; SUBCARRIERS]> {
        self.0.as_chunks().0.iter()
    }

    /// Returns the 240 subcarriers of each symbol, mutable.
    pub fn symbols_mut(&mut self) -> impl ExactSizeIterator<Item = &mut [Complex32; SUBCARRIERS]> {
        self.0.as_chunks_mut().0.iter_mut()
    }

    /// Writes `values` to the elements `indices`, in order.
    pub fn put(
        &mut self,
        indices: impl IntoIterator<Item = usize>,
        values: impl IntoIterator<Item = Complex32>,
    ) {
        for (index, value) in indices.into_iter().zip(values) {
            if let Some(element) = self.0.get_mut(index) {
                *element = value;
            }
        }
    }
}

impl Default for SsbGrid {
    fn default() -> Self {
        Self::zeros()
    }
}
