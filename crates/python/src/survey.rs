//! Calibration of site and vehicle from recorded drives.

use std::path::PathBuf;

use numpy::{PyArray1, PyArrayMethods, PyReadonlyArray1};
use onboard::gaussian::Innovation;
use onboard::observation::SsbDetection;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use recording::replay::{InnovationRecord, as_stated, innovations};
use recording::{AngleLog, OdometryChoice, OdometryLog, read_angle_log, read_odometry};

use crate::drive::replay_error;
use crate::recording::recording_error;
use crate::settings::{Site, Vehicle};

/// Recorded drive with odometry and angles for repeated processing.
///
/// Parameters
/// ----------
/// odometry : path-like
///     CSV or MCAP file; see `locate`.
/// angles : path-like
///     CSV log of angles; see `locate`.
/// track_width_m : float, optional
///     Distance between left and right wheel in metres, for odometry of single wheels.
///
/// Raises
/// ------
/// RecordingError
///     An unusable file.
#[pyclass(frozen, module = "access_av._core")]
pub struct LoggedDrive {
    odometry: OdometryLog,
    angles: AngleLog,
}

#[pymethods]
impl LoggedDrive {
    #[new]
    #[pyo3(signature = (odometry, angles, track_width_m = None))]
    #[allow(clippy::needless_pass_by_value)] // what extraction yields
    fn new(
        py: Python<'_>,
        odometry: PathBuf,
        angles: PathBuf,
        track_width_m: Option<f64>,
    ) -> PyResult<Self> {
        crate::arrays::look_up(py)?;
        py.detach(|| {
            let mut log = read_angle_log(&angles).map_err(recording_error)?;
            let angles = &mut log.angles;
            angles.sort_by(|a, b| a.measured.time_s.total_cmp(&b.measured.time_s));
            let choice = OdometryChoice {
                track_width_m,
                ..OdometryChoice::default()
            };
            Ok(Self {
                odometry: read_odometry(&odometry, &choice).map_err(recording_error)?,
                angles: log,
            })
        })
    }

    /// Number of angles.
    fn __len__(&self) -> usize {
        self.angles.angles.len()
    }

    /// PCI and SSB index of each angle, in order of time.
    #[getter]
    fn heads(&self) -> Vec<(u16, u8)> {
        let ssbs = self.angles.angles.iter().map(|it| &it.ssb);
        ssbs.map(|&SsbDetection { pci, ssb_index, .. }| (pci, ssb_index))
            .collect()
    }

    /// Process the drive and return the innovation of each angle.
    ///
    /// Parameters
    /// ----------
    /// site, vehicle : Site, Vehicle
    ///     Nominal models; the vehicle's start is the start of this drive.
    /// used : array of bool, shape (n,), optional
    ///     Mask of the angles to use [default: those that pass the tracker's gate].
    ///
    /// Returns
    /// -------
    /// residual_rad, variance_rad2 : array of float, shape (n, 2)
    ///     Innovations of each electrical angle and their variances: for a multipath bias that is
    ///     retained, and for one that is drawn again, each weighted with its probability; an
    ///     infinite variance is no information. NaN for an angle that was not processed.
    /// used : array of bool, shape (n,)
    ///     Mask of the used angles.
    ///
    /// Raises
    /// ------
    /// SettingsError
    ///     A vehicle without a start.
    #[pyo3(signature = (site, vehicle, used = None))]
    #[allow(clippy::needless_pass_by_value)] // what extraction yields
    fn innovations<'py>(
        &self,
        py: Python<'py>,
        site: &Site,
        vehicle: &Vehicle,
        used: Option<PyReadonlyArray1<'_, bool>>,
    ) -> PyResult<Bound<'py, PyTuple>> {
        let angles = &self.angles.angles;
        let used = used.map(|used| used.as_array().to_vec());
        if used.as_ref().is_some_and(|used| used.len() != angles.len()) {
            let text = format!("`used` must have shape ({},)", angles.len());
            return Err(PyValueError::new_err(text));
        }
        let met = py
            .detach(|| {
                let (site, vehicle) = as_stated(&site.0, &vehicle.0);
                innovations(&site, &vehicle, &self.odometry, angles, used.as_deref())
            })
            .map_err(replay_error)?;
        let number = |value: fn(&Innovation) -> f64| {
            let both = move |it: &Option<InnovationRecord>| {
                it.map_or([f64::NAN; 2], |it| {
                    it.evidence.given_bias.map(|it| value(&it))
                })
            };
            PyArray1::from_iter(py, met.iter().flat_map(both)).reshape([met.len(), 2])
        };
        let used = met.iter().map(|it| it.is_some_and(|it| it.used));
        (
            number(|it| it.residual)?,
            number(|it| it.variance)?,
            PyArray1::from_iter(py, used),
        )
            .into_pyobject(py)
    }
}
