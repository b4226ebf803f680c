//! Initialisation of NumPy's C interface.

use numpy::PyArray1;
use pyo3::prelude::*;

/// Looks up NumPy's interface before a long computation. Otherwise the first use after the
/// computation runs Python code, where a pending KeyboardInterrupt makes the lookup panic.
///
/// # Errors
/// Error of NumPy's import.
pub fn look_up(py: Python<'_>) -> PyResult<()> {
    py.import("numpy")?;
    PyArray1::<f64>::zeros(py, 0, false);
    Ok(())
}
