//! Covariances, number of sources and calibration.

use aoa::{Array, Calibration, Complex64, Criterion};
use numpy::{
    AllowTypeChange, IxDyn, PyArray1, PyArrayDyn, PyArrayLikeDyn, PyArrayMethods,
    PyUntypedArrayMethods,
};
use pyo3::IntoPyObjectExt;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use super::samples::{Samples, for_antennas, value_error};

/// Compute the sample covariance of the antennas without removal of the mean.
///
/// Parameters
/// ----------
/// snapshots : ndarray
///     Complex samples, `(antennas, snapshots)` or `(batch, antennas, snapshots)`.
///
/// Returns
/// -------
/// ndarray
///     Complex128, `(antennas, antennas)` or `(batch, antennas, antennas)`.
///
/// Examples
/// --------
/// >>> import numpy as np
/// >>> from access_av import aoa
/// >>> aoa.covariance(np.ones((2, 5), complex)).real.tolist()
/// [[1.0, 1.0], [1.0, 1.0]]
#[pyfunction]
pub fn covariance<'py>(
    snapshots: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyArrayDyn<Complex64>>> {
    let samples = Samples::of(snapshots)?;
    let shape = samples.shape([samples.antennas; 2]);
    let py = snapshots.py();
    let entries = for_antennas!(samples.antennas, N => {
        let matrices = samples.map::<N, _>(py, |item| Ok(item.covariance()?.matrix()));
        matrices.map(|it| it.into_flattened().into_flattened())
    })?;
    PyArray1::from_vec(py, entries).reshape(IxDyn(&shape))
}

/// Compute the forward–backward average of a covariance: ``(R + J conj(R) J) / 2``, where ``J``
/// reverses the antennas.
///
/// Parameters
/// ----------
/// covariance : array_like
///     Complex, `(antennas, antennas)` or `(batch, antennas, antennas)`.
///
/// Returns
/// -------
/// ndarray
///     Complex128, of the same shape.
///
/// Examples
/// --------
/// >>> import numpy as np
/// >>> from access_av import aoa
/// >>> aoa.forward_backward(np.diag([1, 3])).real.tolist()
/// [[2.0, 0.0], [0.0, 2.0]]
#[pyfunction]
pub fn forward_backward<'py>(
    covariance: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyArrayDyn<Complex64>>> {
    let py = covariance.py();
    let covariance: PyArrayLikeDyn<'_, Complex64, AllowTypeChange> = covariance.extract()?;
    let shape = covariance.shape().to_vec();
    let (2 | 3, [.., rows, columns]) = (shape.len(), shape.as_slice()) else {
        return Err(not_square(&shape));
    };
    if rows != columns {
        return Err(not_square(&shape));
    }
    let entries: Vec<Complex64> = covariance.as_array().iter().copied().collect();
    let average = entries.chunks((rows * columns).max(1)).flat_map(|matrix| {
        // J conj(R) J is the conjugate of R in reverse order.
        matrix
            .iter()
            .zip(matrix.iter().rev())
            .map(|(a, b)| (a + b.conj()) * 0.5)
    });
    PyArray1::from_iter(py, average).reshape(IxDyn(&shape))
}

fn not_square(shape: &[usize]) -> PyErr {
    PyValueError::new_err(format!(
        "covariance must have the shape (antennas, antennas) or (batch, antennas, antennas), \
         not {shape:?}"
    ))
}

/// Estimate the number of sources from the eigenvalues of the covariance (Wax and Kailath 1985).
///
/// Parameters
/// ----------
/// snapshots : ndarray
///     Complex samples, `(antennas, snapshots)` or `(batch, antennas, snapshots)`.
/// criterion : {'mdl', 'aic'}
///     Minimum description length, or Akaike's criterion, which detects weaker sources but may
///     report a source that does not exist.
///
/// Returns
/// -------
/// int or ndarray
///     Number of sources, 0 to antennas - 1.
///
/// Examples
/// --------
/// >>> import numpy as np
/// >>> from access_av import aoa
/// >>> rng = np.random.default_rng(1)
/// >>> noise = rng.normal(size=(4, 100, 2)) @ [1, 1j]
/// >>> aoa.estimate_sources(noise)
/// 0
/// >>> aoa.estimate_sources(noise + 3 * rng.normal(size=100))
/// 1
#[pyfunction]
#[pyo3(signature = (snapshots, *, criterion="mdl"))]
pub fn estimate_sources<'py>(
    snapshots: &Bound<'py, PyAny>,
    criterion: &str,
) -> PyResult<Bound<'py, PyAny>> {
    let py = snapshots.py();
    let samples = Samples::of(snapshots)?;
    let criterion = match criterion {
        "mdl" => Criterion::Mdl,
        "aic" => Criterion::Aic,
        other => {
            return Err(PyValueError::new_err(format!(
                "criterion must be 'mdl' or 'aic', not '{other}'"
            )));
        }
    };
    let counts: Vec<i64> = for_antennas!(samples.antennas, N => samples.map::<N, _>(py, |item| {
        aoa::source_count(criterion, &item.covariance()?).map(|sources| sources as i64)
    }))?;
    match (samples.batch, counts.as_slice()) {
        (None, [only]) => only.into_bound_py_any(py),
        _ => PyArray1::from_vec(py, counts).into_bound_py_any(py),
    }
}

/// Estimate the channel gains from samples of one source in a known direction.
///
/// Parameters
/// ----------
/// snapshots : ndarray
///     Complex samples of the source, `(antennas, snapshots)`.
/// angle_rad : float
///     Angle of the source from the array's axis in rad, 0 to pi.
/// spacing_wavelengths : float
///     Distance between adjacent antennas in wavelengths.
///
/// Returns
/// -------
/// ndarray
///     Complex gains, one per channel; channel 0 has phase 0, the mean power gain is 1.
///
/// Examples
/// --------
/// >>> import numpy as np
/// >>> from access_av import aoa
/// >>> gains = np.array([1, 1j, -1, 1])
/// >>> burst = np.outer(gains, np.ones(10))  # a source at broadside
/// >>> bool(np.allclose(aoa.calibrate(burst, np.pi / 2), gains))
/// True
#[pyfunction]
#[pyo3(signature = (snapshots, angle_rad, *, spacing_wavelengths=0.5))]
pub fn calibrate<'py>(
    snapshots: &Bound<'py, PyAny>,
    angle_rad: f64,
    spacing_wavelengths: f64,
) -> PyResult<Bound<'py, PyArray1<Complex64>>> {
    let samples = Samples::of(snapshots)?;
    if samples.batch.is_some() {
        return Err(PyValueError::new_err(
            "a reference burst has the shape (antennas, snapshots)",
        ));
    }
    let py = snapshots.py();
    let gains = for_antennas!(samples.antennas, N => {
        let array = Array::<N>::new(spacing_wavelengths).map_err(value_error)?;
        let gains = samples.map::<N, _>(py, |item| {
            let covariance = item.covariance()?;
            let found = Calibration::from_reference_covariance(&covariance, &array, angle_rad)?;
            Ok(*found.gains())
        });
        gains.map(Vec::into_flattened)
    })?;
    Ok(PyArray1::from_vec(py, gains))
}
