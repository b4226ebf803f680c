//! Conversion of the channel of an SSB to arrays.

use nr_ssb::ChannelCovariance;
use nr_ssb::grid::SUBCARRIERS;
use num_complex::{Complex32, Complex64};
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;

/// Channel on the subcarriers per antenna; in Python complex64 of shape `(antennas, 240)`.
pub struct Channel(pub Vec<[Complex32; SUBCARRIERS]>);

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

/// Responses of the antennas per symbol; in Python complex128 of shape `(antennas, symbols)`.
pub struct Blocks(pub Vec<Vec<Complex64>>);

impl<'py> IntoPyObject<'py> for &Blocks {
    type Target = PyArray2<Complex64>;
    type Output = Bound<'py, Self::Target>;
    type Error = PyErr;

    fn into_pyobject(self, py: Python<'py>) -> PyResult<Self::Output> {
        let antennas = self.0.first().map_or(0, Vec::len);
        let by_antenna = (0..antennas).flat_map(|n| self.0.iter().map(move |block| block[n]));
        PyArray1::from_iter(py, by_antenna).reshape([antennas, self.0.len()])
    }
}

impl<'py> IntoPyObject<'py> for &Channel {
    type Target = PyArray2<Complex32>;
    type Output = Bound<'py, Self::Target>;
    type Error = PyErr;

    fn into_pyobject(self, py: Python<'py>) -> PyResult<Self::Output> {
        let flat = PyArray1::from_slice(py, self.0.as_flattened());
        flat.reshape([self.0.len(), SUBCARRIERS])
    }
}
