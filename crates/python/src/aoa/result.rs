//! Result of an estimator.

use aoa::{Reason, Verdict};
use numpy::{Element, IxDyn, PyArray1, PyArrayMethods};
use pyo3::IntoPyObjectExt;
use pyo3::prelude::*;

/// Estimates in the requested shape.
pub(super) enum Estimates<T> {
    /// A single estimate.
    One(T),
    /// Estimates per item and source in the given shape.
    Many { values: Vec<T>, shape: Vec<usize> },
}

impl<T> Estimates<T> {
    /// Creates a single estimate or an array, depending on the shape.
    pub(super) fn new(values: Vec<T>, shape: Vec<usize>) -> Self
    where
        T: Copy,
    {
        match (shape.is_empty(), values.as_slice()) {
            (true, [only]) => Self::One(*only),
            _ => Self::Many { values, shape },
        }
    }

    /// Applies a function to each estimate.
    pub(super) fn map(self, change: impl Fn(T) -> T) -> Self {
        match self {
            Self::One(value) => Self::One(change(value)),
            Self::Many { values, shape } => Self::Many {
                values: values.into_iter().map(change).collect(),
                shape,
            },
        }
    }

    pub(super) fn as_slice(&self) -> &[T] {
        match self {
            Self::One(value) => std::slice::from_ref(value),
            Self::Many { values, .. } => values,
        }
    }

    /// Returns the shape with additional axes at the end.
    pub(super) fn shape(&self, axes: &[usize]) -> Vec<usize> {
        match self {
            Self::One(_) => axes.to_vec(),
            Self::Many { shape, .. } => shape.iter().chain(axes).copied().collect(),
        }
    }

    pub(super) fn field<'py, O: Element + IntoPyObject<'py>>(
        &self,
        py: Python<'py>,
        field: impl Fn(&T) -> O,
    ) -> PyResult<Bound<'py, PyAny>> {
        match self {
            Self::One(value) => field(value).into_bound_py_any(py),
            Self::Many { values, shape } => {
                let column = PyArray1::from_iter(py, values.iter().map(field));
                Ok(column.reshape(IxDyn(shape))?.into_any())
            }
        }
    }

    /// Returns a boolean field; a single value is a Python `bool`.
    pub(super) fn flag<'py>(
        &self,
        py: Python<'py>,
        flag: impl Fn(&T) -> bool,
    ) -> PyResult<Bound<'py, PyAny>> {
        match self {
            Self::One(value) => flag(value).into_bound_py_any(py),
            Self::Many { .. } => self.field(py, flag),
        }
    }

    pub(super) fn verdicts<'py>(
        &self,
        py: Python<'py>,
        verdict: impl Fn(&T) -> Verdict,
    ) -> PyResult<Bound<'py, PyAny>> {
        self.named(py, verdict, Verdict::to_string)
    }

    /// Returns the reasons for unreliable estimates; empty strings for reliable ones.
    pub(super) fn doubts<'py>(
        &self,
        py: Python<'py>,
        doubt: impl Fn(&T) -> Option<Reason>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let verdict = |value: &T| doubt(value).map_or(Verdict::Resolved, Verdict::Unresolved);
        self.named(py, verdict, |verdict| name_of(verdict.reason()))
    }

    fn named<'py>(
        &self,
        py: Python<'py>,
        verdict: impl Fn(&T) -> Verdict,
        name: impl Fn(&Verdict) -> String,
    ) -> PyResult<Bound<'py, PyAny>> {
        match self {
            Self::One(value) => name(&verdict(value)).into_bound_py_any(py),
            Self::Many { .. } => {
                let names: Vec<String> = Verdict::ALL.iter().map(name).collect();
                let codes = self.field(py, |value| verdict(value).index())?;
                let names = py.import("numpy")?.call_method1("array", (names,))?;
                names.call_method1("take", (codes,))
            }
        }
    }
}

/// Returns the text of a reason; empty for `None`.
pub fn name_of(doubt: Option<Reason>) -> String {
    doubt.map_or_else(String::new, |reason| reason.to_string())
}

/// Returns `Name(field=value, ...)`.
pub(super) fn repr_of(name: &str, fields: &[(&str, Bound<'_, PyAny>)]) -> PyResult<String> {
    let fields = fields
        .iter()
        .map(|(field, value)| Ok(format!("{field}={}", value.repr()?)));
    Ok(format!(
        "{name}({})",
        fields.collect::<PyResult<Vec<_>>>()?.join(", ")
    ))
}

/// Angles of arrival with their uncertainty.
///
/// Every field is a number for a single estimate. For a batch or several sources, a field is an
/// array whose last axis is the sources by ascending angle, after an axis for the batch.
#[pyclass(frozen, module = "access_av.aoa")]
pub struct AngleEstimate {
    pub(super) estimates: Estimates<aoa::AngleEstimate>,
}

#[pymethods]
impl AngleEstimate {
    /// Angle from the array's axis in rad, 0 to pi.
    #[getter]
    fn angle_rad<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.estimates.field(py, |estimate| estimate.angle_rad)
    }

    /// Standard deviation of `angle_rad` in rad due to noise and, if the model does not fit, the
    /// misfit.
    #[getter]
    fn sigma_rad<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.estimates.field(py, |estimate| estimate.sigma_rad)
    }

    /// Electrical angle ``2 pi (d / lambda) cos(angle)`` in rad, in (-pi, pi].
    #[getter]
    fn phase_rad<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.estimates.field(py, |estimate| estimate.phase_rad)
    }

    /// Standard deviation of `phase_rad` in rad, which does not depend on the direction, unlike
    /// `sigma_rad`.
    #[getter]
    fn phase_sigma_rad<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.estimates
            .field(py, |estimate| estimate.phase_sigma_rad)
    }

    /// Standard deviation of `phase_rad` due to noise only, in rad.
    #[getter]
    fn phase_noise_sigma_rad<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.estimates
            .field(py, |estimate| estimate.phase_noise_sigma_rad)
    }

    /// Estimated SNR per antenna and snapshot in dB. The whole residual counts as noise.
    #[getter]
    fn snr_db<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.estimates.field(py, |estimate| estimate.snr_db)
    }

    /// Probability of a fit that is equal or worse if the samples are plane waves in white noise,
    /// for all sources together.
    #[getter]
    fn p_value<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.estimates.field(py, |estimate| estimate.fit.p_value())
    }

    /// Whether the estimate is reliable: it is resolved, and the model fits.
    #[getter]
    fn reliable<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.estimates.flag(py, aoa::AngleEstimate::is_reliable)
    }

    /// Reason why the estimate is unreliable: from the verdict or the misfit. Empty for a reliable
    /// estimate.
    #[getter]
    fn doubt<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.estimates.doubts(py, aoa::AngleEstimate::doubt)
    }

    /// Whether the estimate is resolved with respect to noise and geometry, provided that the model
    /// fits.
    #[getter]
    fn resolved<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.estimates.flag(py, aoa::AngleEstimate::is_resolved)
    }

    /// "resolved", or "unresolved: " and the reason.
    #[getter]
    fn verdict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.estimates.verdicts(py, |estimate| estimate.verdict)
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let fields = [
            ("angle_rad", self.angle_rad(py)?),
            ("sigma_rad", self.sigma_rad(py)?),
            ("phase_rad", self.phase_rad(py)?),
            ("snr_db", self.snr_db(py)?),
            ("verdict", self.verdict(py)?),
            ("reliable", self.reliable(py)?),
        ];
        repr_of("AngleEstimate", &fields)
    }
}
