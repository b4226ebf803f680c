//! Search with persistent FFT plans and buffers.

use std::sync::{Mutex, PoisonError};

use num_complex::Complex64;
use pyo3::prelude::*;
use recording::scan::{SsbSearch, SsbSearchConfig};

use super::{Cell, array_setup, complex_samples, rows, scan_error, subcarrier_spacing};

/// Search for the SSBs of one frequency, prepared once for many recordings.
///
/// FFT plans and buffers are kept between calls, and row-major complex64 samples are not copied.
/// Other threads run meanwhile. A searcher serves one thread at a time; others wait.
///
/// Parameters
/// ----------
/// sample_rate_hz : float
///     Any common sample rate of at least 3.84 Msps.
/// centre_frequency_hz : float
///     Absolute frequency at 0 Hz in the samples.
/// ssb_freq_hz : float
///     Absolute centre frequency of the SSB in Hz.
/// scs_khz : int
///     Subcarrier spacing, 15, 30, 120 or 240.
/// antennas : int
///     Number of antennas, 1 to 16; angles require at least 2.
/// spacing_wavelengths : float
///     Distance between adjacent antennas in wavelengths.
/// places_wavelengths : list of (float, float), optional
///     Antenna positions in a horizontal plane in wavelengths, for an array that is not linear.
/// calibration : array_like, optional
///     Complex gain of each channel, by which its samples are divided.
///
/// Raises
/// ------
/// RecordingError
///     An unsupported rate, band or array.
///
/// Examples
/// --------
/// >>> from access_av import nr
/// >>> searcher = nr.Searcher(
/// ...     7.68e6, centre_frequency_hz=3.7008e9, ssb_freq_hz=3.7008e9, scs_khz=30, antennas=1
/// ... )
/// >>> for sfn in (7, 8):
/// ...     burst = nr.build_burst(42, ssb_indices=[1], sfn=sfn, ssb_freq_hz=3.7008e9)
/// ...     [cell] = searcher.search(burst)
/// ...     print(cell.pci, cell.ssb_index, cell.sfn)
/// 42 1 7
/// 42 1 8
#[pyclass(frozen, module = "access_av._core.nr")]
pub struct Searcher(Mutex<SsbSearch>);

#[pymethods]
impl Searcher {
    #[new]
    #[allow(clippy::too_many_arguments)]
    #[pyo3(signature = (sample_rate_hz, *, centre_frequency_hz, ssb_freq_hz, scs_khz, antennas, spacing_wavelengths = 0.5, places_wavelengths = None, calibration = None))]
    fn new(
        sample_rate_hz: f64,
        centre_frequency_hz: f64,
        ssb_freq_hz: f64,
        scs_khz: u32,
        antennas: usize,
        spacing_wavelengths: f64,
        places_wavelengths: Option<Vec<[f64; 2]>>,
        calibration: Option<Vec<Complex64>>,
    ) -> PyResult<Self> {
        let config = SsbSearchConfig {
            array: array_setup(spacing_wavelengths, places_wavelengths, calibration),
            ..SsbSearchConfig::new(
                sample_rate_hz,
                centre_frequency_hz,
                ssb_freq_hz,
                subcarrier_spacing(scs_khz)?,
                antennas,
            )
        };
        SsbSearch::new(config)
            .map(|search| Self(Mutex::new(search)))
            .map_err(scan_error)
    }

    /// Find every SSB in samples.
    ///
    /// Parameters
    /// ----------
    /// samples : ndarray
    ///     Complex samples, `(samples,)` or `(antennas, samples)`.
    ///
    /// Returns
    /// -------
    /// list of Cell
    ///     The SSBs in order of time.
    ///
    /// Raises
    /// ------
    /// RecordingError
    ///     A different number of antennas; less than one SSB; samples that are not finite.
    fn search(&self, py: Python<'_>, samples: &Bound<'_, PyAny>) -> PyResult<Vec<Py<Cell>>> {
        let samples = complex_samples(samples)?;
        let antennas = rows(&samples)?;
        let found: Vec<Cell> = py
            .detach(|| {
                let mut search = self.0.lock().unwrap_or_else(PoisonError::into_inner);
                Ok(search.search(&antennas)?.iter().map(Cell::from).collect())
            })
            .map_err(scan_error)?;
        found.into_iter().map(|cell| Py::new(py, cell)).collect()
    }

    /// DC offset and tones that were removed in the last search, strongest first: pairs of
    /// frequency in Hz and power in dBFS.
    #[getter]
    fn tones(&self, py: Python<'_>) -> Vec<(f64, f64)> {
        py.detach(|| {
            let search = self.0.lock().unwrap_or_else(PoisonError::into_inner);
            let centre_hz = search.config().centre_frequency_hz;
            let tones = search.tones().iter();
            tones
                .map(|tone| (centre_hz + tone.frequency_hz, tone.power_dbfs))
                .collect()
        })
    }

    fn __repr__(&self, py: Python<'_>) -> String {
        py.detach(|| {
            let search = self.0.lock().unwrap_or_else(PoisonError::into_inner);
            let config = search.config();
            format!(
                "Searcher(ssb_freq_hz={:.0}, scs_khz={}, antennas={})",
                config.ssb_freq_hz,
                config.spacing.khz(),
                config.antennas,
            )
        })
    }
}
