//! Posterior Cramér–Rao bound along a route and over its site.

use numpy::{PyArray1, PyArray2, PyReadonlyArray1};
use onboard::geometry::Point;
use onboard::link_budget::LinkBudget;
use onboard::radio_head::RadioHead;
use onboard::walls::Walls;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use simulate::bound::Bound as CoreBound;

use crate::settings::{Scenario, settings_error};
use crate::table::Table;

/// Posterior Cramér–Rao bound of the localization error in a scenario.
#[pyclass(frozen, name = "Bound", module = "access_av._core")]
pub struct ErrorBound {
    bound: CoreBound,
    budget: LinkBudget,
    heads: Vec<RadioHead>,
    walls: Walls,
    height_m: f64,
}

#[pymethods]
impl ErrorBound {
    #[new]
    fn new(py: Python<'_>, scenario: &Scenario) -> PyResult<Self> {
        crate::arrays::look_up(py)?;
        Ok(Self {
            bound: CoreBound::new(&scenario.0).map_err(settings_error)?,
            budget: LinkBudget::new(&scenario.0.site, &scenario.0.vehicle),
            heads: scenario
                .0
                .site
                .radio_heads
                .iter()
                .map(RadioHead::from)
                .collect(),
            walls: Walls::new(&scenario.0.site),
            height_m: scenario.0.vehicle.array.position_m[2],
        })
    }

    /// Return the bound at each SSB of the drive, with every SSB used, as columns of equal length.
    fn along_route(&self, py: Python<'_>) -> PyResult<Py<PyDict>> {
        let points = py.detach(|| self.bound.along_route());
        let table = Table::new(py, points.iter())
            .column("time_s", |point| point.time_s)?
            .column("along_m", |point| point.along_m)?
            .column("x_m", |point| point.pose.x_m)?
            .column("y_m", |point| point.pose.y_m)?
            .column("bound_m", |point| point.position_rms_m)?
            .column("along_std_m", |point| point.along_std_m)?
            .column("across_std_m", |point| point.across_std_m)?
            .column("heading_std_rad", |point| point.heading_std_rad)?
            .column("odometer_scale_std", |point| point.scale_std)?;
        Ok(table.finish())
    }

    /// Return the bound of the RMS position error in metres at each position for `looks`
    /// independent angles of every radio head. The heading is known with the standard deviation
    /// `heading_std_rad`, and the position has a flat prior. NaN if the radio heads leave a
    /// direction unobservable.
    #[allow(clippy::needless_pass_by_value)] // as Python passes them
    fn at<'py>(
        &self,
        py: Python<'py>,
        x_m: PyReadonlyArray1<'py, f64>,
        y_m: PyReadonlyArray1<'py, f64>,
        looks: f64,
        heading_std_rad: f64,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let places = places(&x_m, &y_m)?;
        if !(looks > 0.0 && looks.is_finite()) {
            return Err(PyValueError::new_err(format!(
                "`looks` is {looks}; it must be above 0"
            )));
        }
        if !(heading_std_rad >= 0.0 && heading_std_rad.is_finite()) {
            return Err(PyValueError::new_err(format!(
                "`heading_std_rad` is {heading_std_rad}; it must be at least 0"
            )));
        }
        let bound_m: Vec<f64> = py.detach(|| {
            let at = |place| self.bound.at(place, looks, heading_std_rad);
            places
                .into_iter()
                .map(|place| at(place).unwrap_or(f64::NAN))
                .collect()
        });
        Ok(PyArray1::from_vec(py, bound_m))
    }

    /// Return the SNR per antenna and sample in dB according to the link budget for each radio head
    /// and position, shape (radio heads, positions). Minus infinity for a radio head that walls
    /// block.
    #[allow(clippy::needless_pass_by_value)] // as Python passes them
    fn snr_db<'py>(
        &self,
        py: Python<'py>,
        x_m: PyReadonlyArray1<'py, f64>,
        y_m: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let places = places(&x_m, &y_m)?;
        let rows: Vec<Vec<f64>> = self
            .heads
            .iter()
            .map(|head| {
                let snr_db = |place: &Point| {
                    let distance_m = head.distance_m(*place, self.height_m);
                    let seen = self.walls.seen(head, *place);
                    seen.map_or(f64::NEG_INFINITY, |head| {
                        self.budget.snr_db(&head, distance_m)
                    })
                };
                places.iter().map(snr_db).collect()
            })
            .collect();
        Ok(PyArray2::from_vec2(py, &rows)?)
    }
}

fn places(
    x_m: &PyReadonlyArray1<'_, f64>,
    y_m: &PyReadonlyArray1<'_, f64>,
) -> PyResult<Vec<Point>> {
    let (x_m, y_m) = (x_m.as_slice()?, y_m.as_slice()?);
    if x_m.len() != y_m.len() {
        return Err(PyValueError::new_err(format!(
            "`x_m` has {} values and `y_m` {}; they must have equal lengths",
            x_m.len(),
            y_m.len()
        )));
    }
    let places = x_m.iter().zip(y_m);
    Ok(places.map(|(&x_m, &y_m)| Point { x_m, y_m }).collect())
}
