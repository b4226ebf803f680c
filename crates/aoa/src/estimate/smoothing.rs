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
        let (sources, both) = (places.len(), self.forward_backward);
        macro_rules! with_antennas {
            ($($m:literal)*) => {
                match subarray {
                    $($m => {
                        let found = estimate_several_smoothed::<N, $m>(
                            method, covariance, array, sources, both,
                        )?;
                        places.copy_from_slice(&found);
                    })*
                    _ => {
                        let found = estimate_several_smoothed::<N, N>(
                            method, covariance, array, sources, both,
                        )?;
                        places.copy_from_slice(&found);
                    }
                }
            };
        }
        // Larger ones than these leave nothing to average over in the arrays of up to eight.
        with_antennas!(2 3 4 5 6 7);
        Ok(())
    }
}
