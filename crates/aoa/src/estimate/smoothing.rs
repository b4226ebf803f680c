//! Averaging over subarrays whose size is known at run time.

use super::choice::Method;
use super::several::estimate_several_smoothed;
use crate::array::linear::Array;
use crate::covariance::sample::Covariance;
use crate::error::Error;
use crate::result::angle::AngleEstimate;

/// What a covariance is averaged over, so that correlated sources become several.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Smoothing {
    /// Over the array's symmetry, see [`Covariance::forward_backward`].
    pub forward_backward: bool,
    /// Over the subarrays of so many antennas, see [`Covariance::spatially_smoothed`].
    pub subarray: Option<usize>,
}

impl Smoothing {
    /// As many sources as there are places.
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
                    // What no array of this size has need not be compiled.
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
