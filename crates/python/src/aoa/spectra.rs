//! Spectra as a function of direction.

use aoa::{Array, PseudoSpectrum};
use numpy::{AllowTypeChange, IxDyn, PyArray1, PyArrayDyn, PyArrayLike1, PyArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use super::calibrated_array;
use super::samples::{Samples, for_antennas, value_error};

/// Compute a spectrum over the angle of arrival.
///
/// Parameters
/// ----------
/// snapshots : ndarray
///     Complex samples, `(antennas, snapshots)` or `(batch, antennas, snapshots)`.
/// angles_rad : array_like
///     Angles from the array's axis in rad, 0 to pi.
/// method : {'bartlett', 'capon', 'music'}
///     Beamformer power ``a^H R a / N^2``; power with minimum interference ``1 / (a^H R^-1 a)``; or
///     ``N / (a^H En En^H a)``, which is not a power and is infinite at exact sources.
/// sources : int
///     Number of sources for MUSIC, 1 to antennas - 1.
/// spacing_wavelengths, forward_backward, calibration
///     See `music`.
///
/// Returns
/// -------
/// ndarray
///     `(angles,)` or `(batch, angles)`.
///
/// Examples
/// --------
/// >>> import numpy as np
/// >>> from access_av import aoa
/// >>> steering = np.exp(1j * np.pi * np.cos(np.radians(60)) * np.arange(4))
/// >>> angles = np.radians([30, 60, 90])
/// >>> aoa.spectrum(np.outer(steering, np.ones(9)), angles).round(3).tolist()
/// [0.118, 1.0, 0.0]
#[pyfunction]
#[pyo3(signature = (snapshots, angles_rad, *, method="bartlett", sources=1, spacing_wavelengths=0.5, forward_backward=false, calibration=None))]
#[allow(clippy::too_many_arguments)]
pub fn spectrum<'py>(
    snapshots: &Bound<'py, PyAny>,
    angles_rad: &Bound<'py, PyAny>,
    method: &str,
    sources: usize,
    spacing_wavelengths: f64,
    forward_backward: bool,
    calibration: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let kind = kind_of(method, sources)?;
    let angles_rad: PyArrayLike1<'_, f64, AllowTypeChange> = angles_rad
        .extract()
        .map_err(|_| PyValueError::new_err("angles_rad must be one axis of numbers"))?;
    let angles_rad = angles_rad.as_array().to_vec();
    let samples = Samples::of(snapshots)?;
    let shape = samples.shape([angles_rad.len()]);
    let py = snapshots.py();
    let values: Vec<Vec<f64>> = for_antennas!(samples.antennas, N => {
        let array = calibrated_array::<N>(spacing_wavelengths, calibration)?;
        let ideal = Array::<N>::new(spacing_wavelengths).map_err(value_error)?;
        samples.map::<N, _>(py, |item| {
            let mut covariance = item.covariance()?.calibrated(&array);
            if forward_backward {
                covariance = covariance.forward_backward();
            }
            kind.at(&covariance, &ideal, &angles_rad)
        })
    })?;
    PyArray1::from_vec(py, values.concat()).reshape(IxDyn(&shape))
}

/// Returns the kind of spectrum with this name.
pub(super) fn kind_of(method: &str, sources: usize) -> PyResult<PseudoSpectrum> {
    match method {
        "bartlett" => Ok(PseudoSpectrum::Bartlett),
        "capon" => Ok(PseudoSpectrum::Capon),
        "music" => Ok(PseudoSpectrum::Music { sources }),
        other => Err(PyValueError::new_err(format!(
            "method must be 'bartlett', 'capon' or 'music', not '{other}'"
        ))),
    }
}
