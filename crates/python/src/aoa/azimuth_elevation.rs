//! Azimuth and elevation with arrays of any shape.

use aoa::{ArbitraryArray, Batch, Direction, DirectionFinder, PseudoSpectrum, Real, bound};
use numpy::{
    AllowTypeChange, Element, IxDyn, PyArray1, PyArrayDyn, PyArrayLike1, PyArrayLike2,
    PyArrayMethods,
};
use pyo3::IntoPyObjectExt;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use super::calibration_of;
use super::samples::{Samples, Visitor, for_antennas, value_error};

/// Azimuth and elevation, with what is known about each.
///
/// Every field is a number for a single item and an array for a batch.
#[pyclass(frozen, module = "access_av.aoa")]
pub struct DirectionEstimate {
    values: Vec<aoa::DirectionEstimate>,
    /// `None` for a single item.
    batch: Option<usize>,
}

impl DirectionEstimate {
    fn field<'py, T>(
        &self,
        py: Python<'py>,
        field: impl Fn(&aoa::DirectionEstimate) -> T,
    ) -> PyResult<Bound<'py, PyAny>>
    where
        T: Element + IntoPyObject<'py>,
    {
        match (self.batch, self.values.as_slice()) {
            (None, [only]) => field(only).into_bound_py_any(py),
            _ => Ok(PyArray1::from_iter(py, self.values.iter().map(field)).into_any()),
        }
    }
}

#[pymethods]
impl DirectionEstimate {
    /// Azimuth from the x axis in rad, counter-clockwise, in (-pi, pi].
    #[getter]
    fn azimuth_rad<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.field(py, |it| it.direction.azimuth_rad)
    }

    /// Elevation from the horizontal in rad.
    #[getter]
    fn elevation_rad<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.field(py, |it| it.direction.elevation_rad)
    }

    /// Standard deviation of `azimuth_rad`, from the Cramér–Rao bound at the estimated SNR.
    #[getter]
    fn azimuth_sigma_rad<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.field(py, aoa::DirectionEstimate::azimuth_sigma_rad)
    }

    /// Standard deviation of `elevation_rad`; 0 where the elevation was given.
    #[getter]
    fn elevation_sigma_rad<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.field(py, aoa::DirectionEstimate::elevation_sigma_rad)
    }

    /// Covariance of azimuth and elevation in rad^2: `(2, 2)` or `(batch, 2, 2)`.
    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let entries = self.values.iter().flat_map(|it| it.covariance).flatten();
        let shape: Vec<usize> = self.batch.into_iter().chain([2, 2]).collect();
        PyArray1::from_iter(py, entries).reshape(IxDyn(&shape))
    }

    /// Estimated SNR per antenna and snapshot.
    #[getter]
    fn snr_db<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.field(py, |it| it.snr_db)
    }

    /// Whether the estimate may be relied on.
    #[getter]
    fn resolved<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        match (self.batch, self.values.as_slice()) {
            (None, [only]) => only.is_resolved().into_bound_py_any(py),
            _ => self.field(py, aoa::DirectionEstimate::is_resolved),
        }
    }

    /// "resolved", or "unresolved: " and the reason.
    #[getter]
    fn verdict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let names = self.values.iter().map(|it| it.verdict.to_string());
        match (self.batch, self.values.as_slice()) {
            (None, [only]) => only.verdict.to_string().into_bound_py_any(py),
            // An empty batch has a type too.
            (_, []) => py
                .import("numpy")?
                .call_method1("array", (Vec::<String>::new(), "U")),
            _ => {
                let names: Vec<String> = names.collect();
                py.import("numpy")?.call_method1("array", (names,))
            }
        }
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        Ok(format!(
            "DirectionEstimate(azimuth_rad={}, elevation_rad={}, snr_db={}, verdict={})",
            self.azimuth_rad(py)?.repr()?,
            self.elevation_rad(py)?.repr()?,
            self.snr_db(py)?.repr()?,
            self.verdict(py)?.repr()?,
        ))
    }
}

/// Azimuth and elevation of one source by maximum likelihood, with antennas in any places.
///
/// Parameters
/// ----------
/// snapshots : ndarray
///     Complex samples, `(antennas, snapshots)` or `(batch, antennas, snapshots)`.
/// places_wavelengths : array_like
///     Where the antennas are, in wavelengths: `(antennas, 3)`, or `(antennas, 2)` in a plane.
/// elevations_rad : (float, float)
///     Elevations to look at. A horizontal array does not tell above from below, and sees no elevation
///     at the horizon; with twice the same elevation only the azimuth is estimated.
/// calibration : array_like, optional
///     Complex gain of each channel.
///
/// Returns
/// -------
/// DirectionEstimate
///     Azimuths and elevations, standard deviations, SNRs, verdicts.
///
/// Raises
/// ------
/// ValueError
///     Wrong shape or type; NaN, infinite or only zero samples; elements in one place or in a row.
///
/// Examples
/// --------
/// >>> import numpy as np
/// >>> from access_av import aoa
/// >>> turns = np.arange(5) / 5 * 2 * np.pi
/// >>> circle = 0.425 * np.stack([np.cos(turns), np.sin(turns)], axis=1)
/// >>> towards = np.array([np.cos(2.0), np.sin(2.0)]) * np.cos(0.5)
/// >>> response = np.exp(2j * np.pi * circle @ towards)
/// >>> found = aoa.direction(np.outer(response, [1, 1j, -1]), circle)
/// >>> round(found.azimuth_rad, 6), round(found.elevation_rad, 6)
/// (2.0, 0.5)
#[pyfunction]
#[pyo3(signature = (snapshots, places_wavelengths, *, elevations_rad=(0.0, std::f64::consts::FRAC_PI_2), calibration=None))]
pub fn direction(
    snapshots: &Bound<'_, PyAny>,
    places_wavelengths: &Bound<'_, PyAny>,
    elevations_rad: (f64, f64),
    calibration: Option<&Bound<'_, PyAny>>,
) -> PyResult<DirectionEstimate> {
    let samples = Samples::of(snapshots)?;
    let values = samples.visit(Finder {
        places: places_of(places_wavelengths)?,
        elevations_rad: elevations_rad.into(),
        calibration,
        py: snapshots.py(),
    })?;
    let batch = samples.batch;
    Ok(DirectionEstimate { values, batch })
}

/// Spectrum over azimuth and elevation, with antennas in any places.
///
/// Parameters
/// ----------
/// snapshots, places_wavelengths, calibration
///     As for `direction`.
/// azimuths_rad, elevations_rad : array_like
///     Where to look.
/// method, sources
///     As for `spectrum`.
///
/// Returns
/// -------
/// ndarray
///     `(elevations, azimuths)` or `(batch, elevations, azimuths)`.
///
/// Examples
/// --------
/// >>> import numpy as np
/// >>> from access_av import aoa
/// >>> corner = [[0, 0], [0.5, 0], [0, 0.5]]
/// >>> look = aoa.direction_spectrum(np.ones((3, 5), complex), corner, [0, 1, 2], [0, np.pi / 2])
/// >>> look.shape, float(look[1, 0].round(6))
/// ((2, 3), 1.0)
#[pyfunction]
#[pyo3(signature = (snapshots, places_wavelengths, azimuths_rad, elevations_rad, *, method="bartlett", sources=1, calibration=None))]
pub fn direction_spectrum<'py>(
    snapshots: &Bound<'py, PyAny>,
    places_wavelengths: &Bound<'py, PyAny>,
    azimuths_rad: &Bound<'py, PyAny>,
    elevations_rad: &Bound<'py, PyAny>,
    method: &str,
    sources: usize,
    calibration: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let kind = super::spectra::kind_of(method, sources)?;
    let azimuths = finite(azimuths_rad, "azimuths_rad")?;
    let elevations = finite(elevations_rad, "elevations_rad")?;
    let samples = Samples::of(snapshots)?;
    let shape = samples.shape([elevations.len(), azimuths.len()]);
    let across = |elevation: f64| {
        azimuths
            .iter()
            .map(move |az| Direction::new(*az, elevation))
    };
    let directions = elevations.iter().flat_map(|it| across(*it)).collect();
    let values = samples.visit(Looker {
        kind,
        directions,
        places: places_of(places_wavelengths)?,
        calibration,
        py: snapshots.py(),
    })?;
    PyArray1::from_vec(snapshots.py(), values).reshape(IxDyn(&shape))
}

/// Cramér–Rao bound of azimuth and elevation: standard deviations in rad that no unbiased estimator
/// beats, for one Gaussian source of unknown power.
///
/// Parameters
/// ----------
/// places_wavelengths : array_like
///     As for `direction`.
/// azimuth_rad, elevation_rad : float
///     The direction.
/// snr_db : float
///     SNR per antenna and snapshot.
/// snapshots : int
///     At least one.
///
/// Returns
/// -------
/// (float, float)
///     Of the azimuth and of the elevation; infinite where the array shows none.
///
/// Examples
/// --------
/// >>> from access_av import aoa
/// >>> corner = [[0, 0], [0.5, 0], [0, 0.5]]
/// >>> [round(it, 3) for it in aoa.direction_crb_rad(corner, 0.3, 0.8, 20)]
/// [0.009, 0.011]
#[pyfunction]
#[pyo3(signature = (places_wavelengths, azimuth_rad, elevation_rad, snr_db, *, snapshots=20))]
pub fn direction_crb_rad(
    places_wavelengths: &Bound<'_, PyAny>,
    azimuth_rad: f64,
    elevation_rad: f64,
    snr_db: f64,
    snapshots: usize,
) -> PyResult<(f64, f64)> {
    if snapshots == 0
        || ![azimuth_rad, elevation_rad, snr_db]
            .iter()
            .all(|it| it.is_finite())
    {
        return Err(PyValueError::new_err(
            "direction and SNR must be finite, snapshots at least 1",
        ));
    }
    let places = places_of(places_wavelengths)?;
    let direction = Direction::new(azimuth_rad, elevation_rad);
    let snr = 10.0_f64.powf(snr_db / 10.0);
    let [[azimuth, _], [_, elevation]] = for_antennas!(places.len(), N => {
        array_of::<N>(&places, None)
            .map(|array| bound::azimuth_elevation(&array, direction, snr, snapshots))
    })?;
    Ok((azimuth.sqrt(), elevation.sqrt()))
}

struct Finder<'a, 'py> {
    places: Vec<[f64; 3]>,
    elevations_rad: [f64; 2],
    calibration: Option<&'a Bound<'py, PyAny>>,
    py: Python<'py>,
}

impl Visitor for Finder<'_, '_> {
    type Output = Vec<aoa::DirectionEstimate>;

    fn visit<T: Real, const N: usize>(self, batch: Batch<'_, T, N>) -> PyResult<Self::Output> {
        let array = array_of::<N>(&self.places, self.calibration)?;
        let finder = DirectionFinder::new(array, self.elevations_rad).map_err(value_error)?;
        let found = self.py.detach(|| {
            let each = batch.covariances().map(|it| finder.estimate(&it?));
            each.collect::<Result<Vec<_>, aoa::Error>>()
        });
        found.map_err(value_error)
    }
}

struct Looker<'a, 'py> {
    kind: PseudoSpectrum,
    directions: Vec<Direction>,
    places: Vec<[f64; 3]>,
    calibration: Option<&'a Bound<'py, PyAny>>,
    py: Python<'py>,
}

impl Visitor for Looker<'_, '_> {
    type Output = Vec<f64>;

    fn visit<T: Real, const N: usize>(self, batch: Batch<'_, T, N>) -> PyResult<Vec<f64>> {
        let array = array_of::<N>(&self.places, self.calibration)?;
        let (kind, directions) = (self.kind, &self.directions);
        let spectra = self.py.detach(|| {
            let mut values = Vec::with_capacity(batch.len() * directions.len());
            for covariance in batch.covariances() {
                values.extend(kind.over_directions(&covariance?, &array, directions)?);
            }
            Ok(values)
        });
        spectra.map_err(|error: aoa::Error| value_error(error))
    }
}

fn array_of<const N: usize>(
    places: &[[f64; 3]],
    calibration: Option<&Bound<'_, PyAny>>,
) -> PyResult<ArbitraryArray<N>> {
    let count = places.len();
    let places: [[f64; 3]; N] = places.try_into().map_err(|_| {
        PyValueError::new_err(format!(
            "places_wavelengths must have one row per antenna: {N}, not {count}"
        ))
    })?;
    let array = ArbitraryArray::new(places).map_err(value_error)?;
    Ok(match calibration {
        Some(gains) => array.with_calibration(calibration_of(gains)?),
        None => array,
    })
}

fn places_of(places: &Bound<'_, PyAny>) -> PyResult<Vec<[f64; 3]>> {
    let wrong = || {
        PyValueError::new_err("places_wavelengths must be numbers of the shape (antennas, 2 or 3)")
    };
    let places: PyArrayLike2<'_, f64, AllowTypeChange> = places.extract().map_err(|_| wrong())?;
    let rows = places.as_array();
    let rows = rows.rows().into_iter().map(|row| match *row.to_vec() {
        [x, y] => Ok([x, y, 0.0]),
        [x, y, z] => Ok([x, y, z]),
        _ => Err(wrong()),
    });
    rows.collect()
}

fn finite(values: &Bound<'_, PyAny>, name: &str) -> PyResult<Vec<f64>> {
    let wrong = || PyValueError::new_err(format!("{name} must be one axis of finite numbers"));
    let values: PyArrayLike1<'_, f64, AllowTypeChange> = values.extract().map_err(|_| wrong())?;
    let values = values.as_array().to_vec();
    if values.iter().all(|it| it.is_finite()) {
        Ok(values)
    } else {
        Err(wrong())
    }
}
