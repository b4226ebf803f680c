//! Many estimates in one call, from samples as they lie in memory.

use num_complex::Complex;

use super::choice::Method;
use super::side_by_side::SideBySide;
use super::smoothing::Smoothing;
use crate::array::calibration::Calibration;
use crate::array::linear::Array;
use crate::covariance::sample::Covariance;
use crate::error::Error;
use crate::kernel::real::Real;
use crate::result::angle::AngleEstimate;

/// Items that are estimated side by side: so many that the steps of some need not wait for others, and
/// so few that all they need stays near the processor.
const BLOCK: usize = 32;

/// Samples of many estimates: items of `N` channels of `snapshots` samples each, row-major
/// `(items, N, snapshots)`.
#[derive(Debug, Clone, Copy)]
pub struct Batch<'a, T, const N: usize> {
    samples: &'a [Complex<T>],
    snapshots: usize,
}

/// An [`Error`] and the item of the batch that caused it.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("item {item}: {error}")]
pub struct BatchError {
    /// Index of the item.
    pub item: usize,
    /// What is wrong with it.
    #[source]
    pub error: Error,
}

impl BatchError {
    /// The same error for a batch of which this one was a part, `items` from its start.
    #[must_use]
    pub fn shifted(self, items: usize) -> Self {
        Self {
            item: self.item + items,
            ..self
        }
    }
}

impl<'a, T: Real, const N: usize> Batch<'a, T, N> {
    /// A view of `samples`; what is left over beyond whole items is not part of it.
    ///
    /// # Errors
    /// [`Error::NoSnapshots`] if `snapshots` is zero, [`Error::TooManySnapshots`] if those of all
    /// antennas cannot be counted.
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

    /// Number of items.
    pub fn len(&self) -> usize {
        self.samples.len() / (N * self.snapshots)
    }

    /// Whether there are no items.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The channels of each item.
    fn items(self) -> impl Iterator<Item = [&'a [Complex<T>]; N]> {
        self.samples
            .chunks_exact(N * self.snapshots)
            .map(move |item| {
                let mut channels = item.chunks_exact(self.snapshots);
                std::array::from_fn(|_| channels.next().unwrap_or_default())
            })
    }

    /// The covariance of each item.
    pub fn covariances(self) -> impl Iterator<Item = Result<Covariance<N>, Error>> {
        self.items().map(Covariance::from_channels)
    }

    /// Parts of `items` items each, the last one shorter.
    pub fn split(self, items: usize) -> impl Iterator<Item = Self> {
        let part = items.saturating_mul(N * self.snapshots).max(1);
        self.samples
            .chunks(part)
            .map(move |samples| Self { samples, ..self })
    }

    /// Estimates every item: `sources` estimates each, one item after the other, into `estimates`.
    /// Stops where either ends.
    ///
    /// # Errors
    /// Those of [`estimate_several`](crate::estimate_several), with the index of the first item concerned.
    pub fn estimate(
        self,
        method: Method,
        array: &Array<N>,
        smoothing: Smoothing,
        sources: usize,
        estimates: &mut [AngleEstimate],
    ) -> Result<(), BatchError> {
        if sources == 1 && smoothing.subarray.is_none() {
            let side_by_side = SideBySide {
                method,
                array,
                forward_backward: smoothing.forward_backward,
                snapshots: self.snapshots,
            };
            return if self.len() * 8 > BLOCK {
                self.in_blocks::<BLOCK>(side_by_side, estimates)
            } else {
                self.in_blocks::<1>(side_by_side, estimates)
            };
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

    /// One source, `W` items at a time.
    fn in_blocks<const W: usize>(
        self,
        side_by_side: SideBySide<'_, N>,
        estimates: &mut [AngleEstimate],
    ) -> Result<(), BatchError> {
        let parts = self.split(W).zip(estimates.chunks_mut(W));
        for (index, (part, places)) in parts.enumerate() {
            let outcome = side_by_side.of_samples::<T, W>(part.samples, places);
            outcome.map_err(|(item, error)| BatchError {
                item: index * W + item,
                error,
            })?;
        }
        Ok(())
    }
}
