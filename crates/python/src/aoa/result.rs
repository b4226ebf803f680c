//! What an estimator returns to Python.

use std::fmt::Write as _;

use aoa::Verdict;
use numpy::{Element, IxDyn, PyArray1, PyArrayMethods};
use pyo3::IntoPyObjectExt;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// Angles of arrival, with what is known about each.
///
/// Every field is a number where one estimate was asked for. For a batch, or several sources, it is
/// an array with one axis for the batch and, last, one for the sources, by ascending angle.
#[pyclass(frozen, module = "access_av.aoa")]
pub struct AngleEstimate {
    pub(super) estimates: Estimates,
}

pub(super) enum Estimates {
    /// A single estimate.
    One(aoa::AngleEstimate),
    /// One per item and source, in this shape.
    Many {
        values: Vec<aoa::AngleEstimate>,
        shape: Vec<usize>,
    },
}

impl AngleEstimate {
    fn field<'py, T>(
        &self,
        py: Python<'py>,
        field: impl Fn(&aoa::AngleEstimate) -> T,
    ) -> PyResult<Bound<'py, PyAny>>
    where
        T: Element + IntoPyObject<'py>,
    {
        match &self.estimates {
            Estimates::One(value) => field(value).into_bound_py_any(py),
            Estimates::Many { values, shape } => {
                let column = PyArray1::from_iter(py, values.iter().map(field));
                Ok(column.reshape(IxDyn(shape))?.into_any())
            }
        }
    }
}

#[pymethods]
impl AngleEstimate {
    /// Angle from the array's axis in rad, 0 to pi.
    #[getter]
    fn angle_rad<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.field(py, |estimate| estimate.angle_rad)
    }

    /// Standard deviation of `angle_rad`, from the Cramér–Rao bound at the estimated SNR.
    #[getter]
    fn sigma_rad<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.field(py, |estimate| estimate.sigma_rad)
    }

    /// Electrical angle ``2 pi (d / lambda) cos(angle)`` in rad, in (-pi, pi].
    #[getter]
    fn phase_rad<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.field(py, |estimate| estimate.phase_rad)
    }

    /// Standard deviation of `phase_rad`; unlike `sigma_rad` it does not depend on the direction.
    #[getter]
    fn phase_sigma_rad<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.field(py, |estimate| estimate.phase_sigma_rad)
    }

    /// Estimated SNR per antenna and snapshot.
    #[getter]
    fn snr_db<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.field(py, |estimate| estimate.snr_db)
    }

    /// Whether the estimate may be relied on.
    #[getter]
    fn resolved<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        match &self.estimates {
            Estimates::One(value) => value.is_resolved().into_bound_py_any(py),
            Estimates::Many { .. } => self.field(py, aoa::AngleEstimate::is_resolved),
        }
    }

    /// "resolved", or "unresolved: " and the reason.
    #[getter]
    fn verdict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        match &self.estimates {
            Estimates::One(value) => value.verdict.to_string().into_bound_py_any(py),
            Estimates::Many { values, shape } => {
                let names: Vec<String> = Verdict::ALL.iter().map(Verdict::to_string).collect();
                let codes = values.iter().map(|value| value.verdict.index());
                let codes = PyArray1::from_iter(py, codes).reshape(IxDyn(shape))?;
                let names = py.import("numpy")?.call_method1("array", (names,))?;
                names.call_method1("take", (codes,))
            }
        }
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let mut text = String::from("AngleEstimate(");
        for (name, value) in [
            ("angle_rad", self.angle_rad(py)?),
            ("sigma_rad", self.sigma_rad(py)?),
            ("phase_rad", self.phase_rad(py)?),
            ("snr_db", self.snr_db(py)?),
            ("verdict", self.verdict(py)?),
        ] {
            let separator = if name == "verdict" { "" } else { ", " };
            write!(text, "{name}={}{separator}", value.repr()?)
                .map_err(|error| PyValueError::new_err(error.to_string()))?;
        }
        text.push(')');
        Ok(text)
    }
}
