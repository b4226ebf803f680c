//! SSBs: search in samples and recordings, and generation. `access_av._core.nr`.

mod burst;
mod channel;
mod observables;
mod receiver;
mod searcher;

pub use burst::build_burst;
pub use observables::Observables;
pub use receiver::Receiver;
pub use searcher::Searcher;

use std::f64::consts::FRAC_PI_2;

use channel::{Covariance, Values};
use nr_ssb::grid::SUBCARRIERS;
use nr_ssb::receiver::TrackedSsb;
use nr_ssb::search::DetectedSsb;
use nr_ssb::{Lmax, SubcarrierSpacing};
use num_complex::{Complex32, Complex64};
use numpy::{PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use onboard::receive::SSB_SAMPLES;
use onboard::settings::ArrayShape;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use recording::scan::{
    ArraySetup, FoundAngle, IqSource, SampleBlock, Scan as CoreScan, ScanError, ScanSettings,
    ScannedSsb, View,
};

use crate::aoa::name_of;
use crate::message::brief;
use crate::recording::{Recording, RecordingError};

/// One received SSB of a cell.
///
/// Attributes
/// ----------
/// pci : int
///     Physical cell identity, 0 to 1007.
/// ssb_index : int
///     Index of the SSB in its burst, which identifies the beam.
/// ssb_index_is_guess : bool
///     Whether `ssb_index` comes from the DM-RS and the more probable `lmax` because the PBCH was not decoded.
/// lmax : int or None
///     Number of SSB indices of the cell, 4, 8 or 64; None if neither frequency nor PBCH determine
///     it.
/// half_frame : int or None
///     1 in the second half of a frame; None without a decoded PBCH.
/// sfn : int or None
///     System frame number; None unless the CRC of the PBCH is correct.
/// mib_bits : str or None
///     The 24 bits of the master information block as `0` and `1` in order of transmission.
/// cfo_hz : float
///     Carrier frequency offset in Hz.
/// snr_db : float
///     SNR per resource element in dB, mean over the antennas.
/// sample_start : float
///     First sample of the SSB including its cyclic prefix, at the recording's sample rate.
/// sample_count : float
///     Length of the SSB at the recording's sample rate.
/// ssb_freq_hz, scs_khz : float, int
///     Centre frequency of the SSB in Hz and its subcarrier spacing in kHz.
/// rsrp_dbfs, rsrq_db, sinr_db : list of float
///     SS-RSRP, SS-RSRQ and SS-SINR of each antenna (TS 38.215).
/// angle_rad, sigma_rad : float or None
///     Angle of arrival from the array's axis and its standard deviation in rad; requires at least
///     2 antennas. For an array that is not linear, the standard deviation is that of
///     `azimuth_rad`.
/// phase_rad, phase_sigma_rad : float or None
///     Electrical angle of a linear array and its standard deviation in rad.
/// azimuth_rad : float or None
///     Azimuth in rad, counter-clockwise from broadside of a linear array numbered from right to
///     left: pi / 2 - `angle_rad`. For other arrays, the azimuth from their x axis.
/// elevation_rad, elevation_sigma_rad : float or None
///     Elevation above the horizontal and its standard deviation in rad, for an array that is not
///     linear.
/// verdict : str or None
///     `resolved`, or the reason of an unresolved angle with respect to noise and geometry.
/// doubt : str or None
///     Reason why the angle is unreliable, from the verdict or the fit; empty for a reliable angle.
/// p_value : float or None
///     Probability of a fit that is equal or worse if the signal is a plane wave in white noise.
/// channel : ndarray
///     complex64, `(antennas, 240)`: received channel on the SSB's subcarriers without delay and
///     frequency offset. A tone of amplitude one has the value 256.
/// channel_covariance : ndarray
///     complex64, `(240, 240)`: correlation of the noise of `channel` between subcarriers of one
///     antenna due to smoothing, as covariance divided by `noise_variance`. The result of
///     ``aoa.whiten(cell.channel, cell.channel_covariance)`` can be used as snapshots.
/// blocks : ndarray
///     complex128, `(antennas, 4)`: calibrated despread pilots of each symbol with unit noise
///     variance that is independent between blocks, unlike the noise of `channel`:
///     ``aoa.maximum_likelihood_pilots(cell.blocks, noise_variance=1.0)``. Empty for one antenna.
/// noise_variance : list of float
///     Noise variance on a resource element for each antenna, in the squared scale of `channel`.
/// observables : Observables or None
///     Delay, carrier phase, range rate and power, from a `Receiver`; None from a search.
#[pyclass(frozen, get_all, module = "access_av._core.nr")]
pub struct Cell {
    pci: u16,
    ssb_index: u8,
    ssb_index_is_guess: bool,
    lmax: Option<u8>,
    half_frame: Option<u8>,
    sfn: Option<u16>,
    mib_bits: Option<String>,
    cfo_hz: f64,
    snr_db: f64,
    sample_start: f64,
    sample_count: f64,
    ssb_freq_hz: f64,
    scs_khz: u32,
    rsrp_dbfs: Vec<f64>,
    rsrq_db: Vec<f64>,
    sinr_db: Vec<f64>,
    angle_rad: Option<f64>,
    sigma_rad: Option<f64>,
    phase_rad: Option<f64>,
    phase_sigma_rad: Option<f64>,
    azimuth_rad: Option<f64>,
    elevation_rad: Option<f64>,
    elevation_sigma_rad: Option<f64>,
    verdict: Option<String>,
    doubt: Option<String>,
    p_value: Option<f64>,
    channel: Values<Complex32>,
    channel_covariance: Covariance,
    blocks: Values<Complex64>,
    noise_variance: Vec<f64>,
    observables: Option<Observables>,
}

/// Creates a cell without an angle from an SSB of a search or a receiver, whose fields have equal
/// names.
macro_rules! cell {
    ($ssb:expr, $measurements:expr, $($given:tt)*) => {{
        let (ssb, measured) = ($ssb, $measurements);
        Cell {
            pci: ssb.pci.get(),
            ssb_index: ssb.ssb_index,
            ssb_index_is_guess: ssb.payload.is_none(),
            lmax: ssb.lmax.map(Lmax::count),
            half_frame: ssb.half_frame.map(u8::from),
            sfn: ssb.payload.map(|payload| payload.sfn()),
            mib_bits: ssb.payload.map(|payload| payload.mib.bit_string()),
            cfo_hz: ssb.cfo_hz,
            snr_db: ssb.snr_db,
            rsrp_dbfs: measured.iter().map(|it| it.ss_rsrp_dbfs).collect(),
            rsrq_db: measured.iter().map(|it| it.ss_rsrq_db).collect(),
            sinr_db: measured.iter().map(|it| it.ss_sinr_db).collect(),
            angle_rad: None,
            sigma_rad: None,
            phase_rad: None,
            phase_sigma_rad: None,
            azimuth_rad: None,
            elevation_rad: None,
            elevation_sigma_rad: None,
            verdict: None,
            doubt: None,
            p_value: None,
            $($given)*
        }
    }};
}

impl Cell {
    /// Returns the SSB of a receiver as a cell; the ratio converts samples to the input rate.
    fn of_tracked(
        ssb: &TrackedSsb,
        ssb_freq_hz: f64,
        spacing: SubcarrierSpacing,
        samples_per_base: f64,
        view: Option<View>,
    ) -> Self {
        let angle = view.as_ref().map(|view| view.angle);
        let cell = cell!(ssb, &ssb.measurements,
            sample_start: ssb.sample_start,
            sample_count: SSB_SAMPLES as f64 * samples_per_base,
            ssb_freq_hz,
            scs_khz: spacing.khz(),
            channel: channel(&ssb.channel),
            channel_covariance: Covariance(Some(ssb.channel_covariance.clone())),
            blocks: blocks(&view.map_or_else(Vec::new, |view| view.blocks)),
            noise_variance: ssb.noise_variance.clone(),
            observables: Observables::of(ssb),
        );
        cell.with_angle(angle.as_ref())
    }

    fn with_angle(mut self, angle: Option<&FoundAngle>) -> Self {
        let (verdict, doubt, fit) = match angle {
            None => return self,
            Some(FoundAngle::FromRow(found)) => {
                self.angle_rad = Some(found.angle_rad);
                self.sigma_rad = Some(found.sigma_rad);
                self.phase_rad = Some(found.phase_rad);
                self.phase_sigma_rad = Some(found.phase_sigma_rad);
                self.azimuth_rad = Some(FRAC_PI_2 - found.angle_rad);
                (found.verdict, found.doubt(), found.fit)
            }
            Some(FoundAngle::Direction(found)) => {
                self.sigma_rad = Some(found.azimuth_sigma_rad());
                self.azimuth_rad = Some(found.direction.azimuth_rad);
                self.elevation_rad = Some(found.direction.elevation_rad);
                self.elevation_sigma_rad = Some(found.elevation_sigma_rad());
                (found.verdict, found.doubt(), found.fit)
            }
        };
        self.verdict = Some(verdict.to_string());
        self.doubt = Some(name_of(doubt));
        self.p_value = Some(fit.p_value());
        self
    }
}

impl From<&ScannedSsb> for Cell {
    fn from(found: &ScannedSsb) -> Self {
        let ssb: &DetectedSsb = &found.ssb;
        let cell = cell!(ssb, ssb.measurements(),
            sample_start: found.sample_start,
            sample_count: found.sample_count,
            ssb_freq_hz: found.ssb_freq_hz,
            scs_khz: found.spacing.khz(),
            channel: channel(&found.channel),
            channel_covariance: Covariance(found.channel_covariance.clone()),
            blocks: blocks(&found.blocks),
            noise_variance: found.noise_variance.clone(),
            observables: None,
        );
        cell.with_angle(found.angle.as_ref())
    }
}

/// Returns the channel on the subcarriers of each antenna, with the shape `(antennas, 240)`.
fn channel(antennas: &[[Complex32; SUBCARRIERS]]) -> Values<Complex32> {
    let values = antennas.as_flattened().iter().copied();
    Values::new(values, &[antennas.len(), SUBCARRIERS])
}

/// Returns the responses of the antennas per symbol, with the shape `(antennas, symbols)`.
fn blocks(symbols: &[Vec<Complex64>]) -> Values<Complex64> {
    let antennas = symbols.first().map_or(0, Vec::len);
    let by_antenna = (0..antennas).flat_map(|n| symbols.iter().map(move |block| block[n]));
    Values::new(by_antenna, &[antennas, symbols.len()])
}

/// Creates the array from the user's arguments.
fn array_setup(
    spacing_wavelengths: f64,
    places_wavelengths: Option<Vec<[f64; 2]>>,
    calibration: Option<Vec<Complex64>>,
) -> ArraySetup {
    ArraySetup {
        shape: places_wavelengths.map_or_else(ArrayShape::default, |places_wavelengths| {
            ArrayShape::Planar { places_wavelengths }
        }),
        spacing_wavelengths,
        calibration,
    }
}

#[pymethods]
impl Cell {
    fn __repr__(&self) -> String {
        format!(
            "Cell(pci={}, ssb_index={}{}, sfn={}, snr_db={:.1}, sample_start={:.2})",
            self.pci,
            self.ssb_index,
            if self.ssb_index_is_guess {
                " (guess)"
            } else {
                ""
            },
            self.sfn
                .map_or_else(|| "None".to_owned(), |sfn| sfn.to_string()),
            self.snr_db,
            self.sample_start,
        )
    }
}

/// Result of a scan of a recording.
///
/// Attributes
/// ----------
/// cells : list of Cell
///     SSBs in order of time.
/// faults : list of str
///     Faults of the channels: clipped, silent or exchanged channels; DC offset and tones, which
///     were removed.
/// looked : list of str
///     Scope of the search: subcarrier spacings, frequencies, and the searched part of the
///     recording.
#[pyclass(frozen, get_all, module = "access_av._core.nr")]
pub struct Scan {
    cells: Vec<Py<Cell>>,
    faults: Vec<String>,
    looked: Vec<String>,
}

#[pymethods]
impl Scan {
    #[new]
    const fn new(cells: Vec<Py<Cell>>, faults: Vec<String>, looked: Vec<String>) -> Self {
        Self {
            cells,
            faults,
            looked,
        }
    }
}

impl Scan {
    fn of(py: Python<'_>, scan: &CoreScan) -> PyResult<Self> {
        Ok(Self {
            cells: scan
                .ssbs
                .iter()
                .map(|ssb| Py::new(py, Cell::from(ssb)))
                .collect::<Result<_, _>>()?,
            faults: scan.faults.iter().map(ToString::to_string).collect(),
            looked: scan.searched.iter().map(ToString::to_string).collect(),
        })
    }
}

/// Find every SSB of a recording.
///
/// Parameters
/// ----------
/// recording : Recording
///     Recording with any common sample rate of at least 3.84 Msps.
/// centre_frequency_hz : float, optional
///     Centre frequency in Hz instead of the one in the recording.
/// ssb_freq_hz : float, optional
///     Absolute centre frequency of the SSB in Hz [default: search of the synchronization raster].
/// scs_khz : int, optional
///     Subcarrier spacing, 15 or 30, above 24.25 GHz 120 or 240 [default: both are searched].
/// cfo_ppm : float, optional
///     Maximum frequency offset of the oscillators if `ssb_freq_hz` is given, up to five
///     subcarriers [default: half a subcarrier].
/// spacing_wavelengths : float
///     Distance between adjacent antennas in wavelengths.
/// places_wavelengths : list of (float, float), optional
///     Antenna positions in a horizontal plane in wavelengths, for an array that is not linear. The
///     azimuth is then measured from the x axis.
/// calibration : array_like, optional
///     Complex gain of each channel, by which its samples are divided.
///
/// Raises
/// ------
/// RecordingError
///     A rate, band or length that cannot be searched; samples that are not finite.
#[pyfunction]
#[allow(clippy::too_many_arguments)]
#[pyo3(signature = (recording, *, centre_frequency_hz = None, ssb_freq_hz = None, scs_khz = None, cfo_ppm = None, spacing_wavelengths = 0.5, places_wavelengths = None, calibration = None))]
pub fn scan(
    py: Python<'_>,
    recording: &Recording,
    centre_frequency_hz: Option<f64>,
    ssb_freq_hz: Option<f64>,
    scs_khz: Option<u32>,
    cfo_ppm: Option<f64>,
    spacing_wavelengths: f64,
    places_wavelengths: Option<Vec<[f64; 2]>>,
    calibration: Option<Vec<Complex64>>,
) -> PyResult<Scan> {
    let settings = ScanSettings {
        ssb_freq_hz,
        spacing: scs_khz.map(subcarrier_spacing).transpose()?,
        cfo_ppm,
        centre_frequency_hz,
        array: array_setup(spacing_wavelengths, places_wavelengths, calibration),
    };
    let found = recording
        .with(py, |core| recording::scan::scan_recording(core, &settings))
        .map_err(scan_error)?;
    Scan::of(py, &found)
}

/// Find every SSB in samples. FFT plans are created in each call; a `Searcher` keeps them.
///
/// Parameters
/// ----------
/// samples : ndarray
///     Complex samples, `(samples,)` or `(antennas, samples)`.
/// sample_rate_hz : float
///     Any common sample rate of at least 3.84 Msps.
/// centre_frequency_hz : float
///     Absolute frequency at 0 Hz in the samples.
/// ssb_freq_hz, scs_khz, cfo_ppm, spacing_wavelengths, places_wavelengths, calibration
///     See `scan`.
///
/// Returns
/// -------
/// Scan
///     Result of the scan; `access_av.nr.search` returns its list of cells.
///
/// Examples
/// --------
/// >>> from access_av import nr
/// >>> burst = nr.build_burst(42, ssb_indices=[1], sfn=7, ssb_freq_hz=3.7008e9)
/// >>> [cell] = nr.search(burst, 7.68e6, centre_frequency_hz=3.7008e9, ssb_freq_hz=3.7008e9)
/// >>> cell.pci, cell.ssb_index, cell.sfn
/// (42, 1, 7)
#[pyfunction]
#[pyo3(signature = (samples, sample_rate_hz, *, centre_frequency_hz, ssb_freq_hz = None, scs_khz = None, cfo_ppm = None, spacing_wavelengths = 0.5, places_wavelengths = None, calibration = None))]
#[allow(clippy::too_many_arguments)]
pub fn search(
    py: Python<'_>,
    samples: &Bound<'_, PyAny>,
    sample_rate_hz: f64,
    centre_frequency_hz: f64,
    ssb_freq_hz: Option<f64>,
    scs_khz: Option<u32>,
    cfo_ppm: Option<f64>,
    spacing_wavelengths: f64,
    places_wavelengths: Option<Vec<[f64; 2]>>,
    calibration: Option<Vec<Complex64>>,
) -> PyResult<Scan> {
    let samples = complex_samples(samples)?;
    let settings = ScanSettings {
        ssb_freq_hz,
        spacing: scs_khz.map(subcarrier_spacing).transpose()?,
        cfo_ppm,
        centre_frequency_hz: None,
        array: array_setup(spacing_wavelengths, places_wavelengths, calibration),
    };
    let mut block = SampleBlock {
        antennas: rows(&samples)?,
        sample_rate_hz,
        centre_frequency_hz: Some(centre_frequency_hz),
    };
    let source: &mut (dyn IqSource + Send) = &mut block;
    let found = py
        .detach(|| recording::scan::scan(source, &settings))
        .map_err(scan_error)?;
    Scan::of(py, &found)
}

fn subcarrier_spacing(khz: u32) -> PyResult<SubcarrierSpacing> {
    SubcarrierSpacing::from_khz(khz).ok_or_else(|| {
        PyValueError::new_err(format!("scs_khz is {khz}; allowed: 15, 30, 120, 240"))
    })
}

#[allow(clippy::needless_pass_by_value)] // the shape that `map_err` wants
fn scan_error(error: ScanError) -> PyErr {
    RecordingError::new_err(brief(error))
}

/// Converts one or two axes to row-major complex64, without a copy if possible.
pub fn complex_samples<'py>(
    samples: &Bound<'py, PyAny>,
) -> PyResult<PyReadonlyArrayDyn<'py, Complex32>> {
    let py = samples.py();
    let keywords = PyDict::new(py);
    keywords.set_item("dtype", "complex64")?;
    let numpy = py.import("numpy")?;
    let array = numpy.call_method("ascontiguousarray", (samples,), Some(&keywords))?;
    let array = array.cast_into::<PyArrayDyn<Complex32>>()?.try_readonly()?;
    if !(1..=2).contains(&array.ndim()) {
        return Err(PyValueError::new_err(format!(
            "samples must have the shape (samples,) or (antennas, samples), not {:?}",
            array.shape()
        )));
    }
    Ok(array)
}

/// Returns the samples of each antenna.
pub fn rows<'a>(samples: &'a PyReadonlyArrayDyn<'_, Complex32>) -> PyResult<Vec<&'a [Complex32]>> {
    let length = samples.shape().last().copied().unwrap_or(0);
    Ok(samples.as_slice()?.chunks_exact(length.max(1)).collect())
}
