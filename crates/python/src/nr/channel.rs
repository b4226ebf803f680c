//! Conversion of arrays of an SSB to NumPy.

use nr_ssb::ChannelCovariance;
use nr_ssb::grid::SUBCARRIERS;
use num_complex::Complex32;
use numpy::{Element, IxDyn, PyArray1, PyArray2, PyArrayDyn, PyArrayMethods};
use pyo3::prelude::*;

/// Values in row-major order; in Python an array of this shape.
#[derive(Clone)]
pub struct Values<T> {
    values: Vec<T>,
    shape: Vec<usize>,
}

impl<T> Values<T> {
    /// Creates an array; the number of values is the product of the shape.
    pub fn new(values: impl IntoIterator<Item = T>, shape: &[usize]) -> Self {
        Self {
            values: values.into_iter().collect(),
            shape: shape.to_vec(),
        }
    }
}

impl<'py, T: Element> IntoPyObject<'py> for &Values<T> {
    type Target = PyArrayDyn<T>;
    type Output = Bound<'py, Self::Target>;
    type Error = PyErr;

    fn into_pyobject(self, py: Python<'py>) -> PyResult<Self::Output> {
        PyArray1::from_slice(py, &self.values).reshape(IxDyn(&self.shape))
    }
}

/// Covariance of the channel's noise; in Python complex64 of shape `(240, 240)`.
pub struct Covariance(pub Option<ChannelCovariance>);

impl<'py> IntoPyObject<'py> for &Covariance {
    type Target = PyArray2<Complex32>;
    type Output = Bound<'py, Self::Target>;
    type Error = PyErr;

    fn into_pyobject(self, py: Python<'py>) -> PyResult<Self::Output> {
        let rows = self.0.as_ref().map(ChannelCovariance::rows);
        let rows = rows.unwrap_or_default();
        PyArray1::from_slice(py, rows.as_flattened()).reshape([rows.len(), SUBCARRIERS])
    }
}
