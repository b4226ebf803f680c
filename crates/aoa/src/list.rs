//! A list that needs no heap.

use std::ops::Deref;

/// Up to `N` values, on the stack; use it as a slice.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct List<T, const N: usize> {
    items: [T; N],
    len: usize,
}

impl<T: Copy, const N: usize> List<T, N> {
    /// The values of an iterator, up to the capacity. `fill` occupies the unused places.
    pub(crate) fn collect(fill: T, values: impl IntoIterator<Item = T>) -> Self {
        let mut list = Self {
            items: [fill; N],
            len: 0,
        };
        for (place, value) in list.items.iter_mut().zip(values) {
            *place = value;
            list.len += 1;
        }
        list
    }
}

impl<T, const N: usize> Deref for List<T, N> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        &self.items[..self.len]
    }
}
