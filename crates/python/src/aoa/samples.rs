//! Samples as NumPy hands them over.

use aoa::{Batch, Real};
use num_complex::Complex;
use numpy::{
    Element, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArray, PyUntypedArrayMethods,
};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// Evaluates `$body`, a result, with the constant `$N` equal to `$antennas`.
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

/// Something done to samples of any precision and any number of antennas.
pub(super) trait Visitor {
    type Output;
    fn visit<T: Real, const N: usize>(self, batch: Batch<'_, T, N>) -> PyResult<Self::Output>;
}

/// Samples `(antennas, snapshots)` or `(batch, antennas, snapshots)`, row-major.
pub(super) struct Samples<'py> {
    array: Array<'py>,
    /// `None` if the caller gave a single item.
    pub(super) batch: Option<usize>,
    pub(super) antennas: usize,
    pub(super) snapshots: usize,
}

enum Array<'py> {
    Double(PyReadonlyArrayDyn<'py, Complex<f64>>),
    Single(PyReadonlyArrayDyn<'py, Complex<f32>>),
}

impl<'py> Samples<'py> {
    /// Takes a view; only an array that is not row-major is copied.
    pub(super) fn of(object: &Bound<'py, PyAny>) -> PyResult<Self> {
        if let Ok(array) = object.cast::<PyArrayDyn<Complex<f64>>>() {
            Self::view(array, Array::Double)
        } else if let Ok(array) = object.cast::<PyArrayDyn<Complex<f32>>>() {
            Self::view(array, Array::Single)
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
        wrap: impl Fn(PyReadonlyArrayDyn<'py, T>) -> Array<'py>,
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

    /// The batch axis, if any, and these axes.
    pub(super) fn shape(&self, axes: impl IntoIterator<Item = usize>) -> Vec<usize> {
        self.batch.into_iter().chain(axes).collect()
    }

    /// Hands the samples over with their types known.
    #[inline]
    pub(super) fn visit<V: Visitor>(&self, visitor: V) -> PyResult<V::Output> {
        match &self.array {
            Array::Double(array) => self.visit_typed(array, visitor),
            Array::Single(array) => self.visit_typed(array, visitor),
        }
    }

    #[inline]
    fn visit_typed<T: Real + Element, V: Visitor>(
        &self,
        array: &PyReadonlyArrayDyn<'py, Complex<T>>,
        visitor: V,
    ) -> PyResult<V::Output>
    where
        Complex<T>: Element,
    {
        let samples = array
            .as_slice()
            .map_err(|error| PyValueError::new_err(error.to_string()))?;
        for_antennas!(self.antennas, N => {
            visitor.visit(Batch::<T, N>::new(samples, self.snapshots).map_err(value_error)?)
        })
    }
}

/// An error of the core as Python's.
pub(super) fn value_error(error: impl std::fmt::Display) -> PyErr {
    PyValueError::new_err(error.to_string())
}

pub(super) fn antennas_error(antennas: usize) -> PyErr {
    PyValueError::new_err(format!("2 to 16 antennas are allowed, not {antennas}"))
}
