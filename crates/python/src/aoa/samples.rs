//! Conversion of samples from NumPy arrays.

use aoa::{Batch, Complex64, Covariance, Real};
use num_complex::Complex;
use numpy::{
    Element, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArray, PyUntypedArrayMethods,
};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// Evaluates `$body`, a `Result`, with the constant `$N` equal to `$antennas`.
macro_rules! for_antennas {
    ($antennas:expr, $N:ident => $body:expr) => {
        for_antennas!($antennas, $N => $body; 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16)
    };
    ($antennas:expr, $N:ident => $body:expr; $($n:literal)*) => {
        match $antennas {
            $($n => {
                const $N: usize = $n;
                $body
            })*
            other => Err($crate::aoa::samples::antennas_error(other)),
        }
    };
}
pub(super) use for_antennas;

/// Samples `(antennas, snapshots)` or `(batch, antennas, snapshots)`, row-major.
pub(super) struct Samples<'py> {
    pub(super) array: SampleArray<'py>,
    /// Number of items; `None` for a single item without a batch axis.
    pub(super) batch: Option<usize>,
    pub(super) antennas: usize,
    pub(super) snapshots: usize,
}

pub(super) enum SampleArray<'py> {
    Double(PyReadonlyArrayDyn<'py, Complex<f64>>),
    Single(PyReadonlyArrayDyn<'py, Complex<f32>>),
}

impl<'py> Samples<'py> {
    /// Creates a view; an array that is not row-major is copied.
    pub(super) fn of(object: &Bound<'py, PyAny>) -> PyResult<Self> {
        if let Ok(array) = object.cast::<PyArrayDyn<Complex<f64>>>() {
            Self::view(array, SampleArray::Double)
        } else if let Ok(array) = object.cast::<PyArrayDyn<Complex<f32>>>() {
            Self::view(array, SampleArray::Single)
        } else {
            let given = match object.cast::<PyUntypedArray>() {
                Ok(array) => format!("dtype {}", array.dtype()),
                Err(_) => object.get_type().to_string(),
            };
            Err(PyValueError::new_err(format!(
                "snapshots must be an ndarray of complex64 or complex128, not {given}"
            )))
        }
    }

    fn view<T: Element>(
        array: &Bound<'py, PyArrayDyn<T>>,
        wrap: impl Fn(PyReadonlyArrayDyn<'py, T>) -> SampleArray<'py>,
    ) -> PyResult<Self> {
        let (batch, antennas, snapshots) = match *array.shape() {
            [antennas, snapshots] => (None, antennas, snapshots),
            [batch, antennas, snapshots] => (Some(batch), antennas, snapshots),
            ref shape => {
                return Err(PyValueError::new_err(format!(
                    "snapshots must have the shape (antennas, snapshots) or \
                     (batch, antennas, snapshots), not {shape:?}"
                )));
            }
        };
        let array = if array.is_c_contiguous() && array.is_aligned() {
            array.try_readonly()?
        } else {
            let copy = array.call_method1("copy", ("C",))?;
            copy.cast_into::<PyArrayDyn<T>>()?.try_readonly()?
        };
        Ok(Self {
            array: wrap(array),
            batch,
            antennas,
            snapshots,
        })
    }

    /// Whether all samples have equal modulus up to rounding, as from a receiver that outputs
    /// phases only.
    pub(super) fn are_phases(&self) -> PyResult<bool> {
        Ok(match &self.array {
            SampleArray::Double(array) => have_one_modulus(slice(array)?, 1e-12),
            SampleArray::Single(array) => have_one_modulus(slice(array)?, 1e-6),
        })
    }

    /// Returns the batch axis, if any, followed by the given axes.
    pub(super) fn shape(&self, axes: impl IntoIterator<Item = usize>) -> Vec<usize> {
        self.batch.into_iter().chain(axes).collect()
    }

    /// Applies a function to each item without the interpreter lock.
    pub(super) fn map<const N: usize, O: Send>(
        &self,
        py: Python<'_>,
        each: impl Fn(Item<'_, N>) -> Result<O, aoa::Error> + Sync,
    ) -> PyResult<Vec<O>> {
        match &self.array {
            SampleArray::Double(array) => self.map_typed(py, slice(array)?, each, Item::Double),
            SampleArray::Single(array) => self.map_typed(py, slice(array)?, each, Item::Single),
        }
    }

    fn map_typed<'a, T: Real, const N: usize, O: Send>(
        &self,
        py: Python<'_>,
        samples: &'a [Complex<T>],
        each: impl Fn(Item<'a, N>) -> Result<O, aoa::Error> + Sync,
        wrap: impl Fn([&'a [Complex<T>]; N]) -> Item<'a, N> + Sync,
    ) -> PyResult<Vec<O>> {
        let snapshots = self.snapshots;
        Batch::<T, N>::new(samples, snapshots).map_err(value_error)?;
        let outcomes = py.detach(|| {
            let items = samples.chunks_exact(N * snapshots).map(|item| {
                let mut channels = item.chunks_exact(snapshots);
                each(wrap(std::array::from_fn(|_| {
                    channels.next().unwrap_or_default()
                })))
            });
            items.collect::<Result<_, _>>()
        });
        outcomes.map_err(value_error)
    }
}

/// Channels of one item.
#[derive(Clone, Copy)]
pub(super) enum Item<'a, const N: usize> {
    Double([&'a [Complex<f64>]; N]),
    Single([&'a [Complex<f32>]; N]),
}

impl<const N: usize> Item<'_, N> {
    pub(super) fn covariance(&self) -> Result<Covariance<N>, aoa::Error> {
        match self {
            Self::Double(channels) => Covariance::from_channels(*channels),
            Self::Single(channels) => Covariance::from_channels(*channels),
        }
    }

    /// Returns the snapshots in order of time.
    pub(super) fn snapshots(&self) -> Vec<[Complex64; N]> {
        let wide = |it: Complex<f32>| Complex64::new(it.re.into(), it.im.into());
        let count = match self {
            Self::Double(channels) => channels[0].len(),
            Self::Single(channels) => channels[0].len(),
        };
        let snapshot = |t: usize| match self {
            Self::Double(channels) => channels.map(|channel| channel[t]),
            Self::Single(channels) => channels.map(|channel| wide(channel[t])),
        };
        (0..count).map(snapshot).collect()
    }
}

/// Whether the relative differences of all sample powers are within the tolerance.
fn have_one_modulus<T: Real>(samples: &[Complex<T>], tolerance: f64) -> bool {
    let power = |sample: &Complex<T>| {
        let (re, im): (f64, f64) = (sample.re.into(), sample.im.into());
        re * re + im * im
    };
    let first = samples.first().map_or(0.0, power);
    let agrees = |sample| (power(sample) - first).abs() <= tolerance * first;
    samples.len() > 1 && samples.iter().all(agrees)
}

/// Returns row-major samples as a slice.
pub(super) fn slice<'a, T: Element>(array: &'a PyReadonlyArrayDyn<'_, T>) -> PyResult<&'a [T]> {
    array
        .as_slice()
        .map_err(|error| PyValueError::new_err(error.to_string()))
}

/// Converts an error of the core to a `ValueError`.
pub(super) fn value_error(error: impl std::fmt::Display) -> PyErr {
    PyValueError::new_err(error.to_string())
}

pub(super) fn antennas_error(antennas: usize) -> PyErr {
    PyValueError::new_err(format!("2 to 16 antennas are allowed, not {antennas}"))
}
