//! Batches of estimates from contiguous samples.

use num_complex::Complex;

use super::choice::Method;
use super::side_by_side::SideBySide;
use super::smoothing::Smoothing;
use crate::array::calibration::Calibration;
use crate::array::linear::Array;
use crate::covariance::sample::Covariance;
use crate::error::Error;
use crate::kernel::real::Real;
use crate::result::angle::{AngleEstimate, UntestedEstimate};
use crate::result::direction::Output;
use crate::simd::instructions::LARGEST_VECTORISED;

/// Number of items that are estimated together: large enough to hide instruction latency, and small
/// enough for the data to stay in the cache.
const BLOCK: usize = 32;

/// Samples of many estimates: items of `N` channels with `snapshots` samples each, row-major with
/// the shape `(items, N, snapshots)`.
#[derive(Debug, Clone, Copy)]
pub struct Batch<'a, T, const N: usize> {
    samples: &'a [Complex<T>],
    snapshots: usize,
}

/// [`Error`] with the index of the item that caused it.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("item {item}: {error}")]
pub struct BatchError {
    /// Index of the item.
    pub item: usize,
    /// Error of the item.
    #[source]
    pub error: Error,
}

impl BatchError {
    /// Returns the error for a batch in which this batch starts at item `items`.
    #[must_use]
    pub fn shifted(self, items: usize) -> Self {
        Self {
            item: self.item + items,
            ..self
        }
    }
}

impl<'a, T: Real, const N: usize> Batch<'a, T, N> {
    /// Creates a view of `samples`; an incomplete item at the end is ignored.
    ///
    /// # Errors
    /// [`Error::NoSnapshots`] if `snapshots` is zero; [`Error::TooManySnapshots`] if the number of
    /// samples of an item overflows.
    pub fn new(samples: &'a [Complex<T>], snapshots: usize) -> Result<Self, Error> {
        let antennas = N;
        match snapshots.checked_mul(antennas) {
            None => Err(Error::TooManySnapshots {
                snapshots,
                antennas,
            }),
            Some(0) => Err(Error::NoSnapshots),
            Some(_) => Ok(Self { samples, snapshots }),
        }
    }

    /// Returns the number of items.
    pub fn len(&self) -> usize {
        self.samples.len() / (N * self.snapshots)
    }

    /// Whether there are no items.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns the channels of each item.
    fn items(self) -> impl Iterator<Item = [&'a [Complex<T>]; N]> {
        self.samples
            .chunks_exact(N * self.snapshots)
            .map(move |item| {
                let mut channels = item.chunks_exact(self.snapshots);
                std::array::from_fn(|_| channels.next().unwrap_or_default())
            })
    }

    /// Returns the covariance of each item.
    pub fn covariances(self) -> impl Iterator<Item = Result<Covariance<N>, Error>> {
        self.items().map(Covariance::from_channels)
    }

    /// Splits the batch into parts of `items` items; the last part may be shorter.
    pub fn split(self, items: usize) -> impl Iterator<Item = Self> {
        let part = items.saturating_mul(N * self.snapshots).max(1);
        self.samples
            .chunks(part)
            .map(move |samples| Self { samples, ..self })
    }

    /// Estimates `sources` sources in every item and writes the estimates, item after item, to
    /// `estimates`. The shorter of batch and output determines the number of items.
    ///
    /// # Errors
    /// Errors of [`estimate_several`](crate::estimate_several) with the index of the first affected
    /// item.
    pub fn estimate(
        self,
        method: Method,
        array: &Array<N>,
        smoothing: Smoothing,
        sources: usize,
        estimates: &mut [AngleEstimate],
    ) -> Result<(), BatchError> {
        if sources == 1 && smoothing.subarray.is_none() {
            return self.estimate_one(method, array, smoothing.forward_backward, estimates);
        }
        let ideal = array.with_calibration(Calibration::IDENTITY);
        let places = estimates.chunks_exact_mut(sources.max(1));
        for (item, (covariance, places)) in self.covariances().zip(places).enumerate() {
            let outcome = covariance.and_then(|covariance| {
                smoothing.estimate(method, &covariance.calibrated(array), &ideal, places)
            });
            outcome.map_err(|error| BatchError { item, error })?;
        }
        Ok(())
    }

    /// Estimates one source in every item without the goodness of fit. The shorter of batch and
    /// output determines the number of items. The values equal those of [`estimate`](Self::estimate).
    ///
    /// # Errors
    /// Errors of [`estimate`](crate::estimate()) with the index of the first affected item.
    pub fn estimate_untested(
        self,
        method: Method,
        array: &Array<N>,
        estimates: &mut [UntestedEstimate],
    ) -> Result<(), BatchError> {
        self.estimate_one(method, array, false, estimates)
    }

    fn estimate_one<O: Output>(
        self,
        method: Method,
        array: &Array<N>,
        forward_backward: bool,
        estimates: &mut [O],
    ) -> Result<(), BatchError> {
        let side_by_side = SideBySide {
            method,
            array,
            forward_backward,
            snapshots: self.snapshots,
        };
        if const { N <= LARGEST_VECTORISED } && self.len() * 8 > BLOCK {
            self.in_blocks::<O, BLOCK>(side_by_side, estimates)
        } else {
            self.in_blocks::<O, 1>(side_by_side, estimates)
        }
    }

    /// Estimates one source per item, `W` items at a time.
    fn in_blocks<O: Output, const W: usize>(
        self,
        side_by_side: SideBySide<'_, N>,
        estimates: &mut [O],
    ) -> Result<(), BatchError> {
        let parts = self.split(W).zip(estimates.chunks_mut(W));
        for (index, (part, places)) in parts.enumerate() {
            let outcome = side_by_side.of_samples::<T, O, W>(part.samples, places);
            outcome.map_err(|(item, error)| BatchError {
                item: index * W + item,
                error,
            })?;
        }
        Ok(())
    }
}
