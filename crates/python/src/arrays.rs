//! NumPy's interface.

use numpy::PyArray1;
use pyo3::prelude::*;

/// Looks it up before a long computation. Else its first use does, after the computation and by
/// Python code, which would be the first to hear that the computation was interrupted: the lookup
/// panics of it.
///
/// # Errors
/// NumPy's import.
pub fn look_up(py: Python<'_>) -> PyResult<()> {
    py.import("numpy")?;
    PyArray1::<f64>::zeros(py, 0, false);
    Ok(())
}
