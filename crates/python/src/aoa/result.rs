//! What an estimator returns to Python.

use aoa::{Reason, Verdict};
use numpy::{Element, IxDyn, PyArray1, PyArrayMethods};
use pyo3::IntoPyObjectExt;
use pyo3::prelude::*;

/// Estimates in the shape that was asked for.
pub(super) enum Estimates<T> {
    /// A single estimate.
    One(T),
    /// One per item and source, in this shape.
    Many { values: Vec<T>, shape: Vec<usize> },
}

impl<T> Estimates<T> {
    /// One where one was asked for.
    pub(super) fn new(values: Vec<T>, shape: Vec<usize>) -> Self
    where
        T: Copy,
    {
        match (shape.is_empty(), values.as_slice()) {
            (true, [only]) => Self::One(*only),
            _ => Self::Many { values, shape },
        }
    }

    /// Each of them changed.
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

    /// The axes, and these after them.
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

    /// A field of flags, a single one Python's own `bool`.
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

    /// Reasons not to rely on an estimate, empty where there is none.
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

/// A reason in words; empty without.
pub fn name_of(doubt: Option<Reason>) -> String {
    doubt.map_or_else(String::new, |reason| reason.to_string())
}

/// `Name(field=value, ...)`.
pub(super) fn repr_of(name: &str, fields: &[(&str, Bound<'_, PyAny>)]) -> PyResult<String> {
    let fields = fields
        .iter()
        .map(|(field, value)| Ok(format!("{field}={}", value.repr()?)));
    Ok(format!(
        "{name}({})",
        fields.collect::<PyResult<Vec<_>>>()?.join(", ")
    ))
}

/// Angles of arrival, with what is known about each.
///
/// Every field is a number where one estimate was asked for. For a batch, or several sources, it is
/// an array with one axis for the batch and, last, one for the sources, by ascending angle.
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

    /// Standard deviation of `angle_rad`: of noise and, where the model does not fit, of the misfit.
    #[getter]
    fn sigma_rad<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.estimates.field(py, |estimate| estimate.sigma_rad)
    }

    /// Electrical angle ``2 pi (d / lambda) cos(angle)`` in rad, in (-pi, pi].
    #[getter]
    fn phase_rad<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.estimates.field(py, |estimate| estimate.phase_rad)
    }

    /// Standard deviation of `phase_rad`; unlike `sigma_rad` it does not depend on the direction.
    #[getter]
    fn phase_sigma_rad<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.estimates
            .field(py, |estimate| estimate.phase_sigma_rad)
    }

    /// Standard deviation of `phase_rad` that noise alone makes.
    #[getter]
    fn phase_noise_sigma_rad<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.estimates
            .field(py, |estimate| estimate.phase_noise_sigma_rad)
    }

    /// Estimated SNR per antenna and snapshot. Whatever the sources leave counts as noise.
    #[getter]
    fn snr_db<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.estimates.field(py, |estimate| estimate.snr_db)
    }

    /// Probability that plane waves in white noise fit as badly as this or worse; of all sources together.
    #[getter]
    fn p_value<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.estimates.field(py, |estimate| estimate.fit.p_value())
    }

    /// Whether the estimate may be relied on: it is resolved, and the model fits.
    #[getter]
    fn reliable<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.estimates.flag(py, aoa::AngleEstimate::is_reliable)
    }

    /// Why it may not be relied on: the verdict's reason, or what does not fit. Empty where it may.
    #[getter]
    fn doubt<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.estimates.doubts(py, aoa::AngleEstimate::doubt)
    }

    /// Whether noise and geometry leave no doubt, if the model fits.
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
