//! Azimuth and elevation with arrays of any shape.

use aoa::{ArbitraryArray, Complex64, Direction, DirectionFinder, bound};
use numpy::{
    AllowTypeChange, IxDyn, PyArray1, PyArrayDyn, PyArrayLike1, PyArrayLike2, PyArrayLikeDyn,
    PyArrayMethods, PyUntypedArrayMethods,
};
use onboard::manifold::ArrayManifold;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use super::calibration_of;
use super::result::{Estimates, repr_of};
use super::samples::{Samples, for_antennas, value_error};

/// Azimuth and elevation with their uncertainty.
///
/// Every field is a number for a single estimate. For a batch or several sources, a field is an
/// array whose last axis is the sources by ascending azimuth, after an axis for the batch.
#[pyclass(frozen, module = "access_av.aoa")]
pub struct DirectionEstimate {
    estimates: Estimates<aoa::DirectionEstimate>,
}

impl DirectionEstimate {
    fn matrices<'py>(
        &self,
        py: Python<'py>,
        field: impl Fn(&aoa::DirectionEstimate) -> [[f64; 2]; 2],
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let entries = self.estimates.as_slice().iter().flat_map(field).flatten();
        PyArray1::from_iter(py, entries).reshape(IxDyn(&self.estimates.shape(&[2, 2])))
    }
}

#[pymethods]
impl DirectionEstimate {
    /// Azimuth from the x axis in rad, counter-clockwise, in (-pi, pi].
    #[getter]
    fn azimuth_rad<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.estimates.field(py, |it| it.direction.azimuth_rad)
    }

    /// Elevation from the horizontal in rad.
    #[getter]
    fn elevation_rad<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.estimates.field(py, |it| it.direction.elevation_rad)
    }

    /// Standard deviation of `azimuth_rad` in rad due to noise and, if the model does not fit, the
    /// misfit.
    #[getter]
    fn azimuth_sigma_rad<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.estimates
            .field(py, aoa::DirectionEstimate::azimuth_sigma_rad)
    }

    /// Standard deviation of `elevation_rad` in rad; 0 if the elevation is fixed.
    #[getter]
    fn elevation_sigma_rad<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.estimates
            .field(py, aoa::DirectionEstimate::elevation_sigma_rad)
    }

    /// Covariance of azimuth and elevation in rad^2, shape `(..., 2, 2)`.
    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        self.matrices(py, |it| it.covariance)
    }

    /// Covariance of azimuth and elevation due to noise only, in rad^2.
    #[getter]
    fn noise_covariance<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        self.matrices(py, |it| it.noise_covariance)
    }

    /// Estimated SNR per antenna and snapshot in dB.
    #[getter]
    fn snr_db<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.estimates.field(py, |it| it.snr_db)
    }

    /// Probability of a fit that is equal or worse if the samples are plane waves in white noise,
    /// for all sources together.
    #[getter]
    fn p_value<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.estimates.field(py, |it| it.fit.p_value())
    }

    /// Whether the estimate is reliable: it is resolved, and the model fits.
    #[getter]
    fn reliable<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.estimates.flag(py, aoa::DirectionEstimate::is_reliable)
    }

    /// Reason why the estimate is unreliable: from the verdict or the misfit. Empty for a reliable
    /// estimate.
    #[getter]
    fn doubt<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.estimates.doubts(py, aoa::DirectionEstimate::doubt)
    }

    /// Whether the estimate is resolved with respect to noise and geometry, provided that the model
    /// fits.
    #[getter]
    fn resolved<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.estimates.flag(py, aoa::DirectionEstimate::is_resolved)
    }

    /// "resolved", or "unresolved: " and the reason.
    #[getter]
    fn verdict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.estimates.verdicts(py, |it| it.verdict)
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let fields = [
            ("azimuth_rad", self.azimuth_rad(py)?),
            ("elevation_rad", self.elevation_rad(py)?),
            ("snr_db", self.snr_db(py)?),
            ("verdict", self.verdict(py)?),
            ("reliable", self.reliable(py)?),
        ];
        repr_of("DirectionEstimate", &fields)
    }
}

/// Measured or computed response of an array as a function of direction, including element patterns
/// and mutual coupling.
///
/// Parameters
/// ----------
/// responses : array_like
///     Complex responses, `(azimuths, antennas)` or `(elevations, azimuths, antennas)`, at the
///     azimuths ``2 pi i / azimuths``; at least four azimuths. Cubic interpolation requires that a
///     response changes by less than 1 rad between entries.
/// elevations_rad : array_like
///     Elevations in ascending order with equal steps; outside, the outermost elevation applies.
///
/// Raises
/// ------
/// ValueError
///     Wrong shape; responses that are zero or not finite; elevations that are not ascending in
///     equal steps.
///
/// Examples
/// --------
/// >>> import numpy as np
/// >>> from access_av import aoa
/// >>> turns = np.arange(72) / 72 * 2 * np.pi
/// >>> towards = np.stack([np.cos(turns), np.sin(turns)])
/// >>> corner = np.array([[0, 0], [0.4, 0], [0, 0.4]])
/// >>> table = aoa.MeasuredManifold(np.exp(2j * np.pi * corner @ towards).T)
/// >>> table
/// MeasuredManifold(antennas=3, azimuths=72, elevations=1)
/// >>> snapshots = np.outer(np.exp(2j * np.pi * corner @ [0, 1]), [1, 1j])
/// >>> found = aoa.direction(snapshots, table, elevations_rad=(0, 0))
/// >>> round(float(np.degrees(found.azimuth_rad)), 3)
/// 90.0
#[pyclass(frozen, module = "access_av.aoa")]
pub struct MeasuredManifold {
    /// Responses, row-major (elevation, azimuth, antenna).
    responses: Vec<Complex64>,
    elevations_rad: Vec<f64>,
    antennas: usize,
}

#[pymethods]
impl MeasuredManifold {
    #[new]
    #[pyo3(signature = (responses, elevations_rad=None))]
    fn new(
        responses: &Bound<'_, PyAny>,
        elevations_rad: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let wrong = || {
            PyValueError::new_err(
                "responses must be complex with the shape (azimuths, antennas) or (elevations, azimuths, \
                 antennas), and elevations_rad must contain one angle for each elevation",
            )
        };
        let elevations_rad = match elevations_rad {
            Some(given) => finite(given, "elevations_rad")?,
            None => vec![0.0],
        };
        let responses: PyArrayLikeDyn<'_, Complex64, AllowTypeChange> =
            responses.extract().map_err(|_| wrong())?;
        let (rows, antennas) = match *responses.shape() {
            [_, antennas] => (1, antennas),
            [elevations, _, antennas] => (elevations, antennas),
            _ => return Err(wrong()),
        };
        if rows != elevations_rad.len() {
            return Err(wrong());
        }
        let manifold = Self {
            responses: responses.as_array().iter().copied().collect(),
            elevations_rad,
            antennas,
        };
        // Report invalid values at creation instead of first use.
        for_antennas!(antennas, N => manifold.core::<N>(None).map(|_| ()))?;
        Ok(manifold)
    }

    fn __repr__(&self) -> String {
        format!(
            "MeasuredManifold(antennas={}, azimuths={}, elevations={})",
            self.antennas,
            self.azimuths(),
            self.elevations_rad.len(),
        )
    }
}

impl MeasuredManifold {
    fn azimuths(&self) -> usize {
        self.responses.len() / (self.antennas * self.elevations_rad.len()).max(1)
    }

    /// Returns the manifold with additional channel gains.
    fn core<const N: usize>(
        &self,
        gains: Option<&[Complex64; N]>,
    ) -> PyResult<aoa::MeasuredManifold<N>> {
        let mut responses = self.responses.as_chunks::<N>().0.to_vec();
        if let Some(gains) = gains {
            for (element, gain) in responses
                .as_flattened_mut()
                .iter_mut()
                .zip(gains.iter().cycle())
            {
                *element *= gain;
            }
        }
        aoa::MeasuredManifold::new(self.azimuths(), &self.elevations_rad, responses)
            .map_err(value_error)
    }
}

/// Array description of the user.
enum Shape<'py> {
    Places(Vec<[f64; 3]>),
    Measured(PyRef<'py, MeasuredManifold>),
}

impl<'py> Shape<'py> {
    fn of(given: &Bound<'py, PyAny>) -> PyResult<Self> {
        match given.cast::<MeasuredManifold>() {
            Ok(table) => Ok(Self::Measured(table.borrow())),
            Err(_) => places_of(given).map(Self::Places),
        }
    }

    fn antennas(&self) -> usize {
        match self {
            Self::Places(places) => places.len(),
            Self::Measured(table) => table.antennas,
        }
    }

    fn manifold<const N: usize>(
        &self,
        calibration: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<ArrayManifold<N>> {
        let count = self.antennas();
        let gains = calibration.map(calibration_of::<N>).transpose()?;
        match self {
            _ if count != N => Err(PyValueError::new_err(format!(
                "places_wavelengths must have one row per antenna: {N}, not {count}"
            ))),
            Self::Measured(table) => {
                let gains = gains.as_ref().map(aoa::Calibration::gains);
                table.core::<N>(gains).map(ArrayManifold::Measured)
            }
            Self::Places(places) => {
                let places = std::array::from_fn(|n| places[n]);
                let array = ArbitraryArray::new(places).map_err(value_error)?;
                Ok(ArrayManifold::Places(match gains {
                    Some(gains) => array.with_calibration(gains),
                    None => array,
                }))
            }
        }
    }
}

/// Estimate azimuth and elevation by maximum likelihood with an array of any shape.
///
/// Parameters
/// ----------
/// snapshots : ndarray
///     Complex samples, `(antennas, snapshots)` or `(batch, antennas, snapshots)`.
/// places_wavelengths : array_like or MeasuredManifold
///     Antenna positions in wavelengths, `(antennas, 3)`, or `(antennas, 2)` for a planar array; or
///     the responses as a function of direction.
/// elevations_rad : (float, float)
///     Range of elevations in rad. A horizontal planar array cannot distinguish directions above
///     and below, and cannot measure the elevation at the horizon. With equal values, only the
///     azimuth is estimated.
/// sources : int
///     Number of sources, which may be coherent. Maximum: half of the antennas, or antennas - 1 if
///     only the azimuth is estimated.
/// noise_variance : float, optional
///     Known noise variance per antenna and snapshot, for one source. A single snapshot then
///     suffices, like the blocks of `maximum_likelihood_pilots`.
/// calibration : array_like, optional
///     Complex gain of each channel.
///
/// Returns
/// -------
/// DirectionEstimate
///     Azimuths and elevations, standard deviations, SNRs and verdicts.
///
/// Raises
/// ------
/// ValueError
///     Wrong shape or type; samples that are NaN, infinite or all zero; elements that coincide or
///     are collinear.
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
#[pyo3(signature = (snapshots, places_wavelengths, *, elevations_rad=(0.0, std::f64::consts::FRAC_PI_2), sources=1, noise_variance=None, calibration=None))]
pub fn direction(
    snapshots: &Bound<'_, PyAny>,
    places_wavelengths: &Bound<'_, PyAny>,
    elevations_rad: (f64, f64),
    sources: usize,
    noise_variance: Option<f64>,
    calibration: Option<&Bound<'_, PyAny>>,
) -> PyResult<DirectionEstimate> {
    if noise_variance.is_some() && sources != 1 {
        return Err(PyValueError::new_err(
            "noise_variance requires one source; remove it for several sources",
        ));
    }
    let samples = Samples::of(snapshots)?;
    let shape = Shape::of(places_wavelengths)?;
    let values = for_antennas!(samples.antennas, N => {
        let finder = DirectionFinder::new(shape.manifold::<N>(calibration)?, elevations_rad.into());
        let finder = finder.map_err(value_error)?;
        let found = samples.map::<N, _>(snapshots.py(), |item| match noise_variance {
            Some(_) => Ok(vec![finder.estimate_pilots(&item.snapshots(), noise_variance)?]),
            None => finder.estimate_several(&item.covariance()?, sources),
        });
        found.map(|it| it.concat())
    })?;
    let estimates = Estimates::new(values, samples.shape((sources > 1).then_some(sources)));
    Ok(DirectionEstimate { estimates })
}

/// Compute a spectrum over azimuth and elevation with an array of any shape.
///
/// Parameters
/// ----------
/// snapshots, places_wavelengths, calibration
///     See `direction`.
/// azimuths_rad, elevations_rad : array_like
///     Directions of the spectrum in rad.
/// method, sources
///     See `spectrum`.
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
    let directions: Vec<_> = elevations.iter().flat_map(|it| across(*it)).collect();
    let array = Shape::of(places_wavelengths)?;
    let values = for_antennas!(samples.antennas, N => {
        let array = array.manifold::<N>(calibration)?;
        samples.map::<N, _>(snapshots.py(), |item| {
            kind.over_directions(&item.covariance()?, &array, &directions)
        })
    })?;
    PyArray1::from_vec(snapshots.py(), values.concat()).reshape(IxDyn(&shape))
}

/// Compute the Cramér–Rao bound of azimuth and elevation for one Gaussian source of unknown power:
/// the minimum standard deviations of an unbiased estimator in rad.
///
/// Parameters
/// ----------
/// places_wavelengths : array_like
///     See `direction`.
/// azimuth_rad, elevation_rad : float
///     Direction of the source in rad.
/// snr_db : float
///     SNR per antenna and snapshot in dB.
/// snapshots : int
///     Number of snapshots, at least one.
///
/// Returns
/// -------
/// (float, float)
///     Standard deviations of azimuth and elevation in rad; infinite for an unobservable angle.
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
    let shape = Shape::of(places_wavelengths)?;
    let direction = Direction::new(azimuth_rad, elevation_rad);
    let snr = 10.0_f64.powf(snr_db / 10.0);
    let [[azimuth, _], [_, elevation]] = for_antennas!(shape.antennas(), N => {
        let array = shape.manifold::<N>(None);
        array.map(|array| bound::azimuth_elevation(&array, direction, snr, snapshots))
    })?;
    Ok((azimuth.sqrt(), elevation.sqrt()))
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
