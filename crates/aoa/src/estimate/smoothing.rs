//! Spatial smoothing with a subarray size that is known at run time.

use super::choice::Method;
use super::several::estimate_several_smoothed;
use crate::array::linear::Array;
use crate::covariance::sample::Covariance;
use crate::error::Error;
use crate::result::angle::AngleEstimate;

/// Averaging of the covariance, which separates correlated sources.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Smoothing {
    /// Whether to apply [`Covariance::forward_backward`].
    pub forward_backward: bool,
    /// Number of antennas of the subarrays, see [`Covariance::spatially_smoothed`]; `None` for no
    /// smoothing.
    pub subarray: Option<usize>,
}

impl Smoothing {
    /// Estimates as many sources as `places` has entries.
    pub(super) fn estimate<const N: usize>(
        self,
        method: Method,
        covariance: &Covariance<N>,
        array: &Array<N>,
        places: &mut [AngleEstimate],
    ) -> Result<(), Error> {
        let subarray = self.subarray.unwrap_or(N);
        if !(2..=N).contains(&subarray) {
            return Err(Error::Subarray {
                subarray,
                antennas: N,
            });
        }
        macro_rules! over {
            ($($m:literal)*) => {
                match subarray {
                    // The condition removes subarrays that are larger than the array at compile
                    // time.
                    $($m if const { $m < N } => self.over::<N, $m>(method, covariance, array, places),)*
                    _ => self.over::<N, N>(method, covariance, array, places),
                }
            };
        }
        over!(2 3 4 5 6 7 8 9 10 11 12 13 14 15)
    }

    fn over<const N: usize, const M: usize>(
        self,
        method: Method,
        covariance: &Covariance<N>,
        array: &Array<N>,
        places: &mut [AngleEstimate],
    ) -> Result<(), Error> {
        let (sources, both) = (places.len(), self.forward_backward);
        let found = estimate_several_smoothed::<N, M>(method, covariance, array, sources, both)?;
        places.copy_from_slice(&found);
        Ok(())
    }
}
