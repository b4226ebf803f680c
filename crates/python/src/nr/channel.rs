//! Channels of an SSB as an array.

use nr_ssb::grid::SUBCARRIERS;
use num_complex::Complex32;
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;

/// Per antenna the channel on the subcarriers; in Python complex64 of shape `(antennas, 240)`.
pub struct Channel(pub Vec<[Complex32; SUBCARRIERS]>);

impl<'py> IntoPyObject<'py> for &Channel {
    type Target = PyArray2<Complex32>;
    type Output = Bound<'py, Self::Target>;
    type Error = PyErr;

    fn into_pyobject(self, py: Python<'py>) -> PyResult<Self::Output> {
        let flat = PyArray1::from_slice(py, self.0.as_flattened());
        flat.reshape([self.0.len(), SUBCARRIERS])
    }
}
