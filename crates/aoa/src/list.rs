//! List of fixed capacity without heap allocation.

use std::ops::{Deref, DerefMut};

/// List of up to `N` values on the stack, which dereferences to a slice.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct List<T, const N: usize> {
    items: [T; N],
    len: usize,
}

impl<T: Copy, const N: usize> List<T, N> {
    /// Creates an empty list. `fill` initialises the unused entries.
    pub(crate) const fn empty(fill: T) -> Self {
        Self {
            items: [fill; N],
            len: 0,
        }
    }

    /// Appends a value; a full list is unchanged.
    pub(crate) fn push(&mut self, value: T) {
        if let Some(place) = self.items.get_mut(self.len) {
            *place = value;
            self.len += 1;
        }
    }

    /// Collects an iterator up to the capacity. `fill` initialises the unused entries.
    pub(crate) fn collect(fill: T, values: impl IntoIterator<Item = T>) -> Self {
        let mut list = Self::empty(fill);
        for value in values.into_iter().take(N) {
            list.push(value);
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

impl<T, const N: usize> DerefMut for List<T, N> {
    fn deref_mut(&mut self) -> &mut [T] {
        &mut self.items[..self.len]
    }
}
