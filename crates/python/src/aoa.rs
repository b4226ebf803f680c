//! Bindings of the crate `aoa` as `access_av._core.aoa`, which `access_av.aoa` re-exports.

mod azimuth_elevation;
mod bounds;
mod result;
mod samples;
mod spectra;
mod statistics;

use std::panic::resume_unwind;
use std::sync::{Mutex, PoisonError};
use std::thread;

use aoa::{Array, Batch, Calibration, Complex64, Method, Real, Smoothing};
use num_complex::Complex;
use numpy::{AllowTypeChange, PyArrayLike1};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

pub use azimuth_elevation::{
    DirectionEstimate, MeasuredManifold, direction, direction_crb_rad, direction_spectrum,
};
pub use bounds::crb_rad;
pub use result::AngleEstimate;
use result::Estimates;
pub use result::name_of;
use samples::{SampleArray, Samples, for_antennas, slice, value_error};
pub use spectra::spectrum;
pub use statistics::{calibrate, covariance, estimate_sources, forward_backward};

use crate::threads::at_most_one_per_core;

/// Arguments of an estimator other than the samples.
struct Request<'a, 'py> {
    method: Method,
    spacing_wavelengths: f64,
    sources: usize,
    smoothing: Smoothing,
    calibration: Option<&'a Bound<'py, PyAny>>,
    threads: usize,
}

/// Defines a Python function that estimates with one method, which may depend on an option.
macro_rules! estimator {
    ($(#[$doc:meta])* $name:ident($($option:ident: $type:ty = $default:tt)?) $method:expr) => {
        $(#[$doc])*
        #[pyfunction]
        #[pyo3(signature = (snapshots, *, spacing_wavelengths=0.5, sources=1, $($option=$default,)? forward_backward=false, subarray=None, calibration=None, threads=1))]
        #[allow(clippy::too_many_arguments)]
        pub fn $name(
            snapshots: &Bound<'_, PyAny>,
            spacing_wavelengths: f64,
            sources: usize,
            $($option: $type,)?
            forward_backward: bool,
            subarray: Option<usize>,
            calibration: Option<&Bound<'_, PyAny>>,
            threads: usize,
        ) -> PyResult<AngleEstimate> {
            let smoothing = Smoothing {
                forward_backward,
                subarray,
            };
            estimate(
                snapshots,
                &Request {
                    method: $method,
                    spacing_wavelengths,
                    sources,
                    smoothing,
                    calibration,
                    threads,
                },
            )
        }
    };
}

estimator!(
    /// Estimate directions of arrival by MUSIC.
    ///
    /// The peaks of the pseudo-spectrum are refined to machine precision; there is no grid setting.
    ///
    /// Parameters
    /// ----------
    /// snapshots : ndarray
    ///     Complex samples, `(antennas, snapshots)` or `(batch, antennas, snapshots)`; 2 to 16
    ///     antennas, complex64 or complex128, any strides. The mean is not removed.
    /// spacing_wavelengths : float
    ///     Distance between adjacent antennas in wavelengths.
    /// sources : int
    ///     Number of sources, 1 to antennas - 1.
    /// forward_backward : bool
    ///     Average the covariance forward and backward, which separates two coherent sources.
    /// subarray : int, optional
    ///     Number of antennas of the subarrays for spatial smoothing, which separates up to
    ///     ``antennas - subarray + 1`` coherent sources.
    /// calibration : array_like, optional
    ///     Complex gain of each channel, see `calibrate`. Every channel is divided by its gain.
    /// threads : int
    ///     Number of threads for a batch, limited to one per core.
    ///
    /// Returns
    /// -------
    /// AngleEstimate
    ///     Angles from the array's axis, standard deviations, SNRs and verdicts.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     Wrong shape or type; samples that are NaN, infinite or all zero; too many sources.
    ///
    /// Examples
    /// --------
    /// >>> import numpy as np
    /// >>> from access_av import aoa
    /// >>> rng = np.random.default_rng(1)
    /// >>> noise = rng.normal(size=(4, 20, 2)) @ [1, 1j] / np.sqrt(2)
    /// >>> steering = np.exp(1j * np.pi * np.cos(np.radians(70)) * np.arange(4))
    /// >>> found = aoa.music(10 * steering[:, None] + noise)
    /// >>> bool(abs(found.angle_rad - np.radians(70)) < 3 * found.sigma_rad)
    /// True
    /// >>> found.verdict
    /// 'resolved'
    music() Method::Music
);
estimator!(
    /// Estimate directions of arrival by Root-MUSIC, the roots of the MUSIC polynomial.
    ///
    /// Parameters, result and errors: see `music`.
    ///
    /// Examples
    /// --------
    /// >>> import numpy as np
    /// >>> from access_av import aoa
    /// >>> angles = np.radians([60, 100])
    /// >>> steering = np.exp(1j * np.pi * np.cos(angles) * np.arange(4)[:, None])
    /// >>> rng = np.random.default_rng(1)
    /// >>> signals = rng.normal(size=(2, 50, 2)) @ [1, 1j]
    /// >>> noise = 0.01 * (rng.normal(size=(4, 50, 2)) @ [1, 1j])
    /// >>> found = aoa.root_music(steering @ signals + noise, sources=2)
    /// >>> np.degrees(found.angle_rad).round().tolist()
    /// [60.0, 100.0]
    root_music() Method::RootMusic
);
estimator!(
    /// Estimate directions of arrival by ESPRIT.
    ///
    /// Parameters, result and errors: see `music`. Additional parameter:
    ///
    /// Parameters
    /// ----------
    /// total_least_squares : bool
    ///     Whether to solve the rotation between the subarrays by total instead of ordinary least
    ///     squares.
    ///
    /// Examples
    /// --------
    /// >>> import numpy as np
    /// >>> from access_av import aoa
    /// >>> steering = np.exp(1j * np.pi * np.cos(np.radians(120)) * np.arange(4))
    /// >>> found = aoa.esprit(np.outer(steering, np.ones(20)))
    /// >>> round(float(np.degrees(found.angle_rad)), 6)
    /// 120.0
    esprit(total_least_squares: bool = true) if total_least_squares {
        Method::EspritTls
    } else {
        Method::EspritLs
    }
);
estimator!(
    /// Estimate directions of arrival by maximum likelihood. The method is optimal, and the fastest
    /// for one source. For several sources, which may be coherent, it is the most accurate and the
    /// slowest (alternating projection).
    ///
    /// Parameters, result and errors: see `music`.
    ///
    /// Examples
    /// --------
    /// >>> import numpy as np
    /// >>> from access_av import aoa
    /// >>> steering = np.exp(1j * np.pi * np.cos(np.radians([30, 90])) * np.arange(4)[:, None])
    /// >>> batch = np.repeat(steering.T[:, :, None], 20, axis=2)
    /// >>> found = aoa.maximum_likelihood(batch)
    /// >>> np.degrees(found.angle_rad).round(6).tolist()
    /// [30.0, 90.0]
    maximum_likelihood() Method::MaximumLikelihood
);

/// Estimate directions of arrival from despread pilots by maximum likelihood.
///
/// Parameters
/// ----------
/// blocks : ndarray
///     Complex blocks, `(antennas, blocks)` or `(batch, antennas, blocks)`. A block is a coherent
///     part of the signal (an OFDM symbol). For each antenna, it is the sum of the received samples
///     times the conjugated pilots, divided by the square root of the pilots' energy. Carrier
///     offset and channel phase between blocks do not matter.
/// noise_variance : float or array_like, optional
///     Noise variance of a block; one value per antenna if they differ, infinite for a dead
///     channel [default: estimated from at least two blocks].
/// spacing_wavelengths, calibration
///     See `music`.
///
/// Returns
/// -------
/// AngleEstimate
///     Angles with the SNR per antenna and block.
///
/// Raises
/// ------
/// ValueError
///     Wrong shape or type; blocks that are NaN, infinite or all zero; a variance that is not
///     positive.
///
/// Examples
/// --------
/// >>> import numpy as np
/// >>> from access_av import aoa
/// >>> steering = np.exp(1j * np.pi * np.cos(np.radians(70)) * np.arange(4))
/// >>> blocks = np.outer(steering, [9, 9j, -9])
/// >>> found = aoa.maximum_likelihood_pilots(blocks, noise_variance=1.0)
/// >>> round(float(np.degrees(found.angle_rad)), 6), round(found.phase_sigma_rad, 3)
/// (70.0, 0.02)
#[pyfunction]
#[pyo3(signature = (blocks, *, noise_variance=None, spacing_wavelengths=0.5, calibration=None))]
pub fn maximum_likelihood_pilots(
    blocks: &Bound<'_, PyAny>,
    noise_variance: Option<&Bound<'_, PyAny>>,
    spacing_wavelengths: f64,
    calibration: Option<&Bound<'_, PyAny>>,
) -> PyResult<AngleEstimate> {
    let samples = Samples::of(blocks)?;
    let noise = noise_variance.map(noise_of).transpose()?;
    let values = for_antennas!(samples.antennas, N => {
        let array = calibrated_array::<N>(spacing_wavelengths, calibration)?;
        let noise = noise.map(Noise::per_antenna::<N>).transpose()?;
        samples.map::<N, _>(blocks.py(), |item| {
            let blocks = item.snapshots();
            match &noise {
                Some(Noise::Unequal(each)) => {
                    aoa::maximum_likelihood_pilots_unequal(&blocks, each, &array)
                }
                Some(Noise::Equal(each)) => {
                    aoa::maximum_likelihood_pilots(&blocks, Some(*each), &array)
                }
                None => aoa::maximum_likelihood_pilots(&blocks, None, &array),
            }
        })
    })?;
    let estimates = Estimates::new(values, samples.shape([]));
    Ok(AngleEstimate { estimates })
}

/// Noise variance, common to all antennas or one per antenna.
enum Noise<E> {
    Equal(f64),
    Unequal(E),
}

fn noise_of(variance: &Bound<'_, PyAny>) -> PyResult<Noise<Vec<f64>>> {
    if let Ok(one) = variance.extract::<f64>() {
        return Ok(Noise::Equal(one));
    }
    let each: PyArrayLike1<'_, f64, AllowTypeChange> = variance.extract().map_err(|_| {
        PyValueError::new_err("noise_variance must be one number or one number per antenna")
    })?;
    Ok(Noise::Unequal(each.as_array().to_vec()))
}

impl Noise<Vec<f64>> {
    fn per_antenna<const N: usize>(self) -> PyResult<Noise<[f64; N]>> {
        match self {
            Self::Equal(variance) => Ok(Noise::Equal(variance)),
            Self::Unequal(each) => each
                .try_into()
                .map(Noise::Unequal)
                .map_err(|each: Vec<f64>| {
                    let count = each.len();
                    PyValueError::new_err(format!(
                        "noise_variance must have one number per antenna: {N}, not {count}"
                    ))
                }),
        }
    }
}

#[inline]
fn estimate(snapshots: &Bound<'_, PyAny>, request: &Request<'_, '_>) -> PyResult<AngleEstimate> {
    let (samples, py) = (Samples::of(snapshots)?, snapshots.py());
    let estimates = for_antennas!(samples.antennas, N => match &samples.array {
        SampleArray::Double(array) => request.run::<f64, N>(py, &samples, slice(array)?),
        SampleArray::Single(array) => request.run::<f32, N>(py, &samples, slice(array)?),
    })?;
    let estimates = if samples.are_phases()? {
        estimates.map(aoa::AngleEstimate::of_phases)
    } else {
        estimates
    };
    Ok(AngleEstimate { estimates })
}

impl Request<'_, '_> {
    #[inline]
    fn run<T: Real, const N: usize>(
        &self,
        py: Python<'_>,
        samples: &Samples<'_>,
        values: &[Complex<T>],
    ) -> PyResult<Estimates<aoa::AngleEstimate>> {
        let batch = Batch::<T, N>::new(values, samples.snapshots).map_err(value_error)?;
        let Request {
            method,
            sources,
            smoothing,
            threads,
            ..
        } = *self;
        let array = calibrated_array::<N>(self.spacing_wavelengths, self.calibration)?;
        let maximum = method.maximum_sources::<N>();
        if !(1..=maximum).contains(&sources) {
            let error = aoa::Error::TooManySources {
                requested: sources,
                maximum,
            };
            return Err(value_error(error));
        }
        let run = |batch: Batch<'_, T, N>, estimates: &mut [aoa::AngleEstimate]| {
            batch.estimate(method, &array, smoothing, sources, estimates)
        };
        if samples.batch.is_none() && sources == 1 {
            let mut estimate = [aoa::AngleEstimate::default()];
            run(batch, &mut estimate).map_err(|error| value_error(error.error))?;
            let [only] = estimate;
            return Ok(Estimates::One(only));
        }
        let threads = at_most_one_per_core(threads)?;
        let mut values = vec![aoa::AngleEstimate::default(); batch.len() * sources];
        let share = batch.len().div_ceil(threads).max(1);
        let parts = batch.split(share).zip(values.chunks_mut(share * sources));
        let parts = Mutex::new(parts.enumerate());
        let next_part = || parts.lock().unwrap_or_else(PoisonError::into_inner).next();
        let work = || {
            while let Some((index, (part, places))) = next_part() {
                run(part, places).map_err(|error| error.shifted(index * share))?;
            }
            Ok(())
        };
        let outcomes = py.detach(|| {
            thread::scope(|scope| {
                // If a thread cannot be created, the existing threads process its share.
                let helpers: Vec<_> = (share..batch.len())
                    .step_by(share)
                    .filter_map(|_| thread::Builder::new().spawn_scoped(scope, work).ok())
                    .collect();
                let mut outcomes = vec![work()];
                for helper in helpers {
                    outcomes.push(helper.join().unwrap_or_else(|it| resume_unwind(it)));
                }
                outcomes
            })
        });
        let errors = outcomes.into_iter().filter_map(Result::err);
        if let Some(first) = errors.min_by_key(|error: &aoa::BatchError| error.item) {
            return Err(match samples.batch {
                Some(_) => value_error(first),
                None => value_error(first.error),
            });
        }
        let axes = (sources > 1).then_some(sources);
        Ok(Estimates::Many {
            values,
            shape: samples.shape(axes),
        })
    }
}

/// Creates the array from the user's arguments.
fn calibrated_array<const N: usize>(
    spacing_wavelengths: f64,
    calibration: Option<&Bound<'_, PyAny>>,
) -> PyResult<Array<N>> {
    let array = Array::<N>::new(spacing_wavelengths).map_err(value_error)?;
    Ok(match calibration {
        Some(gains) => array.with_calibration(calibration_of(gains)?),
        None => array,
    })
}

/// Creates the calibration from the user's channel gains.
fn calibration_of<const N: usize>(gains: &Bound<'_, PyAny>) -> PyResult<Calibration<N>> {
    let gains: PyArrayLike1<'_, Complex64, AllowTypeChange> = gains
        .extract()
        .map_err(|_| PyValueError::new_err("calibration must be one complex gain per antenna"))?;
    let gains = gains.as_array();
    if gains.len() != N {
        let count = gains.len();
        return Err(PyValueError::new_err(format!(
            "calibration must have one gain per antenna: {N}, not {count}"
        )));
    }
    Calibration::new(std::array::from_fn(|n| gains[n])).map_err(value_error)
}
