//! How many threads a caller gets.

use std::num::NonZero;
use std::thread::available_parallelism;

use pyo3::PyResult;
use pyo3::exceptions::PyValueError;

/// More threads than any machine has cores for.
const MOST_THREADS: usize = 1024;

/// As many as asked for, but no more than there are cores: a further one gains nothing, and takes
/// memory that may not be there.
///
/// # Errors
/// `ValueError` where none are asked for, or too many.
pub fn at_most_one_per_core(threads: usize) -> PyResult<usize> {
    if !(1..=MOST_THREADS).contains(&threads) {
        let message = format!("`threads` is {threads}; it must be between 1 and {MOST_THREADS}");
        return Err(PyValueError::new_err(message));
    }
    Ok(threads.min(available_parallelism().map_or(1, NonZero::get)))
}
