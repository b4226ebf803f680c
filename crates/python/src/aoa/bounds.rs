//! Cramér–Rao bounds.

use aoa::{Array, bound};
use numpy::{AllowTypeChange, IxDyn, PyArray1, PyArrayLikeDyn, PyArrayMethods};
use pyo3::IntoPyObjectExt;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use super::samples::{for_antennas, value_error};

/// Compute the Cramér–Rao bound: the minimum standard deviation of an unbiased estimator in rad.
///
/// Parameters
/// ----------
/// angle_rad : array_like
///     Angle from the array's axis in rad.
/// snr_db : array_like
///     SNR per antenna and snapshot in dB, broadcast against `angle_rad`.
/// antennas, snapshots : int
///     2 to 16 antennas, at least one snapshot.
/// spacing_wavelengths : float
///     Distance between adjacent antennas in wavelengths.
/// model : {'stochastic', 'deterministic', 'known'}
///     Knowledge of the waveform: Gaussian; deterministic and unknown; known up to a complex gain.
/// quantity : {'angle', 'phase'}
///     Bounded quantity: the angle, or the electrical angle ``2 pi (d / lambda) cos(angle)``.
/// joint : bool
///     Whether the last axis contains simultaneous, uncorrelated sources. Otherwise, each
///     element is a single source.
///
/// Returns
/// -------
/// float or ndarray
///     Standard deviations in rad, in the broadcast shape of `angle_rad` and `snr_db`.
///
/// Raises
/// ------
/// ValueError
///     Values that are not finite; coinciding sources; more sources than antennas - 1.
///
/// Examples
/// --------
/// >>> import numpy as np
/// >>> from access_av import aoa
/// >>> f"{np.degrees(aoa.crb_rad(np.radians(90), 10)):.3f}"
/// '0.413'
/// >>> aoa.crb_rad(np.radians([60, 90]), [[0], [10], [20]]).shape
/// (3, 2)
#[pyfunction]
#[pyo3(signature = (angle_rad, snr_db, *, antennas=4, snapshots=20, spacing_wavelengths=0.5, model="stochastic", quantity="angle", joint=false))]
#[allow(clippy::too_many_arguments)]
pub fn crb_rad<'py>(
    py: Python<'py>,
    angle_rad: &Bound<'py, PyAny>,
    snr_db: &Bound<'py, PyAny>,
    antennas: usize,
    snapshots: usize,
    spacing_wavelengths: f64,
    model: &str,
    quantity: &str,
    joint: bool,
) -> PyResult<Bound<'py, PyAny>> {
    let model = match model {
        "stochastic" => Model::Stochastic,
        "deterministic" => Model::Deterministic,
        "known" => Model::Known,
        other => {
            return Err(PyValueError::new_err(format!(
                "model must be 'stochastic', 'deterministic' or 'known', not '{other}'"
            )));
        }
    };
    let of_angle = match quantity {
        "angle" => true,
        "phase" => false,
        other => {
            return Err(PyValueError::new_err(format!(
                "quantity must be 'angle' or 'phase', not '{other}'"
            )));
        }
    };
    let (angles, snrs): (Values<'_>, Values<'_>) = py
        .import("numpy")?
        .call_method1("broadcast_arrays", (angle_rad, snr_db))?
        .extract()?;
    let shape = angles.as_array().shape().to_vec();
    let angles: Vec<f64> = angles.as_array().iter().copied().collect();
    let snrs: Vec<f64> = snrs
        .as_array()
        .iter()
        .map(|db| 10.0_f64.powf(db / 10.0))
        .collect();
    if snapshots == 0 || angles.iter().chain(&snrs).any(|value| !value.is_finite()) {
        return Err(PyValueError::new_err(
            "angles and SNRs must be finite, snapshots at least 1",
        ));
    }
    let sources = if joint {
        shape.last().copied().unwrap_or(1).max(1)
    } else {
        1
    };
    let setting = Setting {
        spacing_wavelengths,
        snapshots,
        model,
        of_angle,
    };
    let mut sigmas = Vec::with_capacity(angles.len());
    for (angles, snrs) in angles.chunks(sources).zip(snrs.chunks(sources)) {
        for_antennas!(antennas, N => setting.bound::<N>(angles, snrs, &mut sigmas))?;
    }
    match (shape.as_slice(), sigmas.as_slice()) {
        ([], [only]) => only.into_bound_py_any(py),
        _ => Ok(PyArray1::from_vec(py, sigmas)
            .reshape(IxDyn(&shape))?
            .into_any()),
    }
}

type Values<'py> = PyArrayLikeDyn<'py, f64, AllowTypeChange>;

#[derive(Clone, Copy)]
enum Model {
    Stochastic,
    Deterministic,
    Known,
}

struct Setting {
    spacing_wavelengths: f64,
    snapshots: usize,
    model: Model,
    of_angle: bool,
}

impl Setting {
    /// Appends the bounds of simultaneous sources to `sigmas`.
    fn bound<const N: usize>(
        &self,
        angles_rad: &[f64],
        snrs: &[f64],
        sigmas: &mut Vec<f64>,
    ) -> PyResult<()> {
        let array = Array::<N>::new(self.spacing_wavelengths).map_err(value_error)?;
        let first = sigmas.len();
        if let (&[_], &[snr]) = (angles_rad, snrs) {
            sigmas.push(match self.model {
                Model::Stochastic => bound::stochastic::<N>(snr, self.snapshots),
                Model::Deterministic => bound::deterministic::<N>(snr, self.snapshots),
                Model::Known => bound::known_signal::<N>(snr * self.snapshots as f64),
            });
        } else {
            let phases: Vec<f64> = angles_rad
                .iter()
                .map(|angle| array.phase_from_angle(*angle))
                .collect();
            let several = match self.model {
                Model::Stochastic => bound::stochastic_several::<N>,
                Model::Deterministic => bound::deterministic_several::<N>,
                Model::Known => bound::known_signal_several::<N>,
            };
            let bounds = several(&phases, snrs, self.snapshots).map_err(value_error)?;
            sigmas.extend_from_slice(&bounds);
        }
        if self.of_angle {
            for (sigma, &angle) in sigmas[first..].iter_mut().zip(angles_rad) {
                *sigma = bound::angle_sigma_rad(*sigma, angle, &array);
            }
        }
        Ok(())
    }
}
