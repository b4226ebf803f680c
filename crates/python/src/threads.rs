//! Number of threads.

use std::num::NonZero;
use std::thread::available_parallelism;

use pyo3::PyResult;
use pyo3::exceptions::PyValueError;

/// Maximum number of threads, above the core count of any machine.
const MAX_THREADS: usize = 1024;

/// Limits the number of threads to one per core, because more threads do not increase the speed but
/// need memory.
///
/// # Errors
/// `ValueError` if `threads` is zero or too large.
pub fn at_most_one_per_core(threads: usize) -> PyResult<usize> {
    if !(1..=MAX_THREADS).contains(&threads) {
        let message = format!("`threads` is {threads}; it must be between 1 and {MAX_THREADS}");
        return Err(PyValueError::new_err(message));
    }
    Ok(threads.min(available_parallelism().map_or(1, NonZero::get)))
}
