//! The resource elements themselves.

use num_complex::Complex32;

use super::indices::{SUBCARRIERS, SYMBOLS};

/// The 960 resource elements of one SSB, k fastest.
#[derive(Debug, Clone, PartialEq)]
pub struct SsbGrid([Complex32; SUBCARRIERS * SYMBOLS]);

impl SsbGrid {
    /// A grid of zeros.
    pub const fn zeros() -> Self {
        Self([Complex32::ZERO; SUBCARRIERS * SYMBOLS])
    }

    /// All elements, index k + 240·l.
    pub const fn elements(&self) -> &[Complex32; SUBCARRIERS * SYMBOLS] {
        &self.0
    }

    /// All elements, to be changed.
    pub const fn elements_mut(&mut self) -> &mut [Complex32; SUBCARRIERS * SYMBOLS] {
        &mut self.0
    }

    /// The 240 subcarriers of each symbol, l = 0 to 3.
    pub fn symbols(&self) -> impl ExactSizeIterator<Item = &[Complex32; SUBCARRIERS]> {
        self.0.as_chunks().0.iter()
    }

    /// The 240 subcarriers of each symbol, to be changed.
    pub fn symbols_mut(&mut self) -> impl ExactSizeIterator<Item = &mut [Complex32; SUBCARRIERS]> {
        self.0.as_chunks_mut().0.iter_mut()
    }

    /// Write `values` to the elements that `indices` name, in order.
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
