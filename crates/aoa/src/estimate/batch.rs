//! Many estimates in one call, from samples as they lie in memory.

use num_complex::Complex;

use super::choice::Method;
use super::one::estimate;
use super::smoothing::Smoothing;
use crate::array::calibration::Calibration;
use crate::array::linear::Array;
use crate::covariance::sample::Covariance;
use crate::error::Error;
use crate::kernel::real::Real;
use crate::method::maximum_likelihood;
use crate::result::angle::AngleEstimate;

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
        let many = self.len() > maximum_likelihood::BLOCK / 8;
        let whole = smoothing.subarray.is_none();
        if method == Method::MaximumLikelihood && sources == 1 && array.is_ideal() && many && whole
        {
            return self.maximum_likelihood(array, estimates);
        }
        let ideal = array.with_calibration(Calibration::IDENTITY);
        let places = estimates.chunks_exact_mut(sources.max(1));
        for (item, (covariance, places)) in self.covariances().zip(places).enumerate() {
            let outcome = covariance.and_then(|covariance| {
                let covariance = covariance.calibrated(array);
                match places {
                    [only] if whole => {
                        let covariance = if smoothing.forward_backward {
                            covariance.forward_backward()
                        } else {
                            covariance
                        };
                        *only = estimate(method, &covariance, &ideal)?;
                    }
                    _ => smoothing.estimate(method, &covariance, &ideal, places)?,
                }
                Ok(())
            });
            outcome.map_err(|error| BatchError { item, error })?;
        }
        Ok(())
    }

    /// Maximum likelihood for ideal channels, block by block. Forward–backward averaging would change
    /// nothing: it leaves the sums along the diagonals as they are.
    fn maximum_likelihood(
        self,
        array: &Array<N>,
        estimates: &mut [AngleEstimate],
    ) -> Result<(), BatchError> {
        let places = estimates.chunks_mut(maximum_likelihood::BLOCK);
        let blocks = self.split(maximum_likelihood::BLOCK).zip(places);
        for (index, (block, places)) in blocks.enumerate() {
            maximum_likelihood::block(block.samples, self.snapshots, array, places).map_err(
                |(item, error)| BatchError {
                    item: index * maximum_likelihood::BLOCK + item,
                    error,
                },
            )?;
        }
        Ok(())
    }
}
