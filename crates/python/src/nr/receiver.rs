//! Search and tracking of SSBs in a stream of samples.

use std::sync::{Mutex, PoisonError};

use nr_ssb::receiver::{ReceivedBeam, Receiver as Core, ReceiverConfig, ReceiverError};
use num_complex::{Complex32, Complex64};
use pyo3::prelude::*;
use recording::scan::{ArrayView, array_view};

use super::{Cell, array_setup, complex_samples, rows, scan_error, subcarrier_spacing};
use crate::recording::RecordingError;

/// Receive the SSBs of one frequency in a stream of samples, in blocks of any length.
///
/// Cells are searched continuously until one is found, and then once per `search_every_s`. Between
/// searches, the found beams are tracked, which takes a small part of a search's time. Other
/// threads run meanwhile. A receiver serves one thread at a time; others wait.
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
///     Number of antennas, 1 to 16.
/// period_s : float
///     Period of the burst sets in seconds, 0.005 to 0.16.
/// search_every_s : float
///     Interval in seconds between searches for new cells and beams.
/// cfo_ppm : float, optional
///     Maximum frequency error of receiver and cell together [default: 20]. All offsets within it
///     are searched until a cell is found; with 20 ppm this takes less than 0.2 s at a period of 20
///     ms.
/// spacing_wavelengths, places_wavelengths, calibration
///     Array for the angles with at least two antennas; see `scan`.
///
/// Raises
/// ------
/// RecordingError
///     An unsupported rate, band, number of antennas, array or setting; a `cfo_ppm` above the 15
///     subcarriers that can be searched.
///
/// Examples
/// --------
/// >>> import numpy as np
/// >>> from access_av import nr
/// >>> receiver = nr.Receiver(
/// ...     7.68e6, centre_frequency_hz=3.7008e9, ssb_freq_hz=3.7008e9, scs_khz=30, antennas=2
/// ... )
/// >>> cells = []
/// >>> for sfn in (6, 8, 10):
/// ...     burst = nr.build_burst(42, ssb_indices=[1], sfn=sfn, ssb_freq_hz=3.7008e9)
/// ...     period = np.concatenate([burst, np.zeros(3 * burst.size, np.complex64)])
/// ...     cells += receiver.push(np.outer([1, 1j], period))
/// >>> cells += receiver.finish()
/// >>> [(cell.pci, cell.ssb_index, cell.sfn, cell.channel.shape) for cell in cells]
/// [(42, 1, 6, (2, 240)), (42, 1, 8, (2, 240)), (42, 1, 10, (2, 240))]
/// >>> round(float(np.degrees(np.angle(cells[2].channel[1] / cells[2].channel[0]).mean())), 2)
/// 90.0
/// >>> round(float(np.degrees(cells[2].phase_rad)), 2), cells[2].doubt
/// (90.0, '')
#[pyclass(frozen, module = "access_av._core.nr")]
pub struct Receiver {
    core: Mutex<Core>,
    view: Option<Box<dyn ArrayView>>,
}

#[pymethods]
impl Receiver {
    #[new]
    #[pyo3(signature = (sample_rate_hz, *, centre_frequency_hz, ssb_freq_hz, scs_khz, antennas, period_s = 0.02, search_every_s = 1.0, cfo_ppm = None, spacing_wavelengths = 0.5, places_wavelengths = None, calibration = None))]
    #[allow(clippy::too_many_arguments)] // Python's keywords
    fn new(
        sample_rate_hz: f64,
        centre_frequency_hz: f64,
        ssb_freq_hz: f64,
        scs_khz: u32,
        antennas: usize,
        period_s: f64,
        search_every_s: f64,
        cfo_ppm: Option<f64>,
        spacing_wavelengths: f64,
        places_wavelengths: Option<Vec<[f64; 2]>>,
        calibration: Option<Vec<Complex64>>,
    ) -> PyResult<Self> {
        let setup = array_setup(spacing_wavelengths, places_wavelengths, calibration);
        let usual = ReceiverConfig::new(ssb_freq_hz, subcarrier_spacing(scs_khz)?, antennas);
        let config = ReceiverConfig {
            period_s,
            search_every_s,
            oscillator_ppm: cfo_ppm.unwrap_or(usual.oscillator_ppm),
            ..usual
        };
        let core =
            Core::new(config, sample_rate_hz, centre_frequency_hz).map_err(receiver_error)?;
        Ok(Self {
            core: Mutex::new(core),
            view: array_view(antennas, &setup).map_err(|it| scan_error(it.into()))?,
        })
    }

    /// Process the next samples.
    ///
    /// Parameters
    /// ----------
    /// samples : ndarray
    ///     Complex samples, `(samples,)` or `(antennas, samples)`.
    ///
    /// Returns
    /// -------
    /// list of Cell
    ///     SSBs that are complete with these samples. The search delays SSBs by 6 ms.
    ///     `sample_start` counts from the first sample of the stream.
    ///
    /// Raises
    /// ------
    /// RecordingError
    ///     A different number of antennas; samples that are not finite.
    fn push(&self, py: Python<'_>, samples: &Bound<'_, PyAny>) -> PyResult<Vec<Py<Cell>>> {
        let samples = complex_samples(samples)?;
        let antennas = rows(&samples)?;
        self.process(py, |receiver, take| {
            check_finite(&antennas)?;
            receiver.push(&antennas, take).map_err(receiver_error)
        })
    }

    /// End the stream and return the delayed SSBs. All cells are removed.
    ///
    /// Returns
    /// -------
    /// list of Cell
    ///     Delayed SSBs; see `push`.
    fn finish(&self, py: Python<'_>) -> PyResult<Vec<Py<Cell>>> {
        self.process(py, |receiver, take| {
            receiver.finish(take).map_err(receiver_error)?;
            receiver.reset();
            Ok(())
        })
    }

    /// DC offset and tones that are currently removed, strongest first: pairs of frequency in Hz
    /// and power in dBFS.
    #[getter]
    fn tones(&self, py: Python<'_>) -> Vec<(f64, f64)> {
        py.detach(|| {
            let receiver = self.core.lock().unwrap_or_else(PoisonError::into_inner);
            let receiver = receiver.windows();
            let ssb_freq_hz = receiver.config().search.ssb_freq_hz.unwrap_or_default();
            let tones = receiver.tones();
            tones
                .map(|tone| (ssb_freq_hz + tone.frequency_hz, tone.power_dbfs))
                .collect()
        })
    }

    fn __repr__(&self, py: Python<'_>) -> String {
        py.detach(|| {
            let receiver = self.core.lock().unwrap_or_else(PoisonError::into_inner);
            let search = &receiver.windows().config().search;
            format!(
                "Receiver(ssb_freq_hz={:.0}, scs_khz={}, antennas={})",
                search.ssb_freq_hz.unwrap_or_default(),
                search.spacing.khz(),
                search.antennas,
            )
        })
    }
}

impl Receiver {
    /// Calls the receiver and returns the received SSBs.
    fn process(
        &self,
        py: Python<'_>,
        call: impl FnOnce(&mut Core, &mut dyn FnMut(ReceivedBeam<'_>)) -> PyResult<()> + Send,
    ) -> PyResult<Vec<Py<Cell>>> {
        let cells = py.detach(|| {
            let mut receiver = self.core.lock().unwrap_or_else(PoisonError::into_inner);
            let search = &receiver.windows().config().search;
            let (ssb_freq_hz, spacing) = (search.ssb_freq_hz.unwrap_or_default(), search.spacing);
            let base = receiver.input_per_output();
            let mut cells = Vec::new();
            call(&mut receiver, &mut |mut beam| {
                let ssb = beam.tracked_ssb();
                let view = self.view.as_ref();
                let view = view.and_then(|it| it.of_blocks(&ssb.blocks, &ssb.noise_variance));
                cells.push(Cell::of_tracked(&ssb, ssb_freq_hz, spacing, base, view));
            })?;
            PyResult::Ok(cells)
        })?;
        cells.into_iter().map(|cell| Py::new(py, cell)).collect()
    }
}

fn check_finite(antennas: &[&[Complex32]]) -> PyResult<()> {
    for (channel, samples) in antennas.iter().enumerate() {
        if let Some(sample) = samples.iter().position(|x| !x.is_finite()) {
            let text = format!("sample {sample} of channel {channel} is not finite");
            return Err(RecordingError::new_err(text));
        }
    }
    Ok(())
}

#[allow(clippy::needless_pass_by_value)] // the shape that `map_err` wants
fn receiver_error(error: ReceiverError) -> PyErr {
    RecordingError::new_err(error.to_string())
}
