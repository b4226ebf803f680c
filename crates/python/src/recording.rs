//! `Recording` and its error.

use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};

use num_complex::Complex32;
use numpy::{PyArray2, PyArrayMethods};
use pyo3::create_exception;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use recording::{Recording as CoreRecording, RecordingError as CoreError};

use crate::message::brief;

create_exception!(
    access_av._core,
    RecordingError,
    PyValueError,
    "An unusable recording; the message names file, key and what is allowed."
);

/// Converts an error of the core to the Python error.
#[allow(clippy::needless_pass_by_value)] // the shape that `map_err` wants
pub fn recording_error(error: CoreError) -> PyErr {
    RecordingError::new_err(brief(error))
}

/// Recording of one or more antennas, read in blocks; by one thread at a time, others wait.
///
/// Examples
/// --------
/// >>> import tempfile, numpy as np
/// >>> from pathlib import Path
/// >>> path = Path(tempfile.mkdtemp()) / "antenna0.cf32"
/// >>> np.arange(4, dtype=np.complex64).tofile(path)
/// >>> recording = Recording.open_raw([path], sample_rate_hz=7.68e6)
/// >>> recording.read(1, 2)
/// array([[1.+0.j, 2.+0.j]], dtype=complex64)
#[pyclass(frozen, module = "access_av._core")]
pub struct Recording(Mutex<CoreRecording>);

impl From<CoreRecording> for Recording {
    fn from(core: CoreRecording) -> Self {
        Self(Mutex::new(core))
    }
}

impl Recording {
    /// Calls `ask` with the core's recording without the interpreter lock.
    pub fn with<T: Send>(
        &self,
        py: Python<'_>,
        ask: impl FnOnce(&mut CoreRecording) -> T + Send,
    ) -> T {
        py.detach(|| ask(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner)))
    }
}

#[pymethods]
impl Recording {
    /// Open a SigMF recording by its name, its `.sigmf-meta` or `.sigmf-data` file, an archive
    /// (`.sigmf`) or a collection (`.sigmf-collection`) of one recording.
    ///
    /// Parameters
    /// ----------
    /// path : path-like
    ///     Recording with the datatype `cf32_le` or `ci16_le` and any number of interleaved
    ///     channels.
    /// verify : bool
    ///     Whether to compare the data's SHA-512 with the metadata's, which reads all data once.
    ///
    /// Raises
    /// ------
    /// RecordingError
    ///     A missing file of the pair; unusable metadata; data that ends within a sample or has
    ///     another type.
    #[staticmethod]
    #[pyo3(signature = (path, *, verify = true))]
    fn open(py: Python<'_>, path: PathBuf, verify: bool) -> PyResult<Self> {
        py.detach(|| {
            if verify {
                CoreRecording::open(path)
            } else {
                CoreRecording::open_unverified(path)
            }
        })
        .map(Self::from)
        .map_err(recording_error)
    }

    /// Open raw `cf32_le` files, one per antenna.
    #[staticmethod]
    #[pyo3(signature = (paths, *, sample_rate_hz, centre_frequency_hz = None))]
    #[allow(clippy::needless_pass_by_value)] // what extraction yields
    fn open_raw(
        paths: Vec<PathBuf>,
        sample_rate_hz: f64,
        centre_frequency_hz: Option<f64>,
    ) -> PyResult<Self> {
        CoreRecording::open_raw(&paths, sample_rate_hz, centre_frequency_hz)
            .map(Self::from)
            .map_err(recording_error)
    }

    /// Sample rate in Hz.
    #[getter]
    fn sample_rate_hz(&self, py: Python<'_>) -> f64 {
        self.with(py, |core| core.sample_rate_hz())
    }

    /// Centre frequency of the first capture that has one, in Hz.
    #[getter]
    fn centre_frequency_hz(&self, py: Python<'_>) -> Option<f64> {
        self.with(py, |core| core.centre_frequency_hz())
    }

    /// Number of channels.
    #[getter]
    fn channels(&self, py: Python<'_>) -> usize {
        self.with(py, |core| core.channels())
    }

    /// Number of samples per channel.
    #[getter]
    fn length(&self, py: Python<'_>) -> u64 {
        self.with(py, |core| core.length())
    }

    /// Format of the samples in the file.
    #[getter]
    fn datatype(&self, py: Python<'_>) -> &'static str {
        self.with(py, |core| core.datatype().name())
    }

    /// Suspicious properties that do not prevent reading.
    #[getter]
    fn warnings(&self, py: Python<'_>) -> Vec<String> {
        self.with(py, |core| {
            core.warnings().iter().map(ToString::to_string).collect()
        })
    }

    /// Return the metadata as JSON, including annotations and extension keys.
    fn metadata_json(&self, py: Python<'_>) -> PyResult<String> {
        self.with(py, |core| serde_json::to_string(core.metadata()))
            .map_err(|error| RecordingError::new_err(brief(error)))
    }

    /// Read `count` samples of every channel from sample `start`.
    ///
    /// Returns
    /// -------
    /// ndarray
    ///     complex64 samples, shape (channels, count); the full scale of integers is one.
    ///
    /// Raises
    /// ------
    /// RecordingError
    ///     Samples beyond the end; a sample that is not finite.
    fn read<'py>(
        &self,
        py: Python<'py>,
        start: u64,
        count: usize,
    ) -> PyResult<Bound<'py, PyArray2<Complex32>>> {
        let mut channels = Vec::new();
        self.with(py, |core| core.read(start, count, &mut channels))
            .map_err(recording_error)?;
        let array = PyArray2::zeros(py, [channels.len(), count], false);
        let mut writable = array.readwrite();
        for (mut row, samples) in writable.as_array_mut().outer_iter_mut().zip(&channels) {
            row.iter_mut()
                .zip(samples)
                .for_each(|(to, from)| *to = *from);
        }
        drop(writable);
        Ok(array)
    }

    fn __len__(&self, py: Python<'_>) -> usize {
        self.length(py) as usize
    }

    fn __repr__(&self, py: Python<'_>) -> String {
        self.with(py, |core| {
            format!(
                "Recording({:?}, {} channels, {} samples, {} Hz)",
                core.data_file().display().to_string(),
                core.channels(),
                core.length(),
                core.sample_rate_hz(),
            )
        })
    }
}
