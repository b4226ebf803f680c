//! Channels: drops of TR 38.901 and files of ray-traced paths.

use std::path::Path;

use numpy::PyReadonlyArray1;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use simulate::channel::Paths;
use simulate::channel::tr38901::{Environment, LinkGeometry, draw_drops};
use simulate::scenario::ChannelModel;

use crate::settings::SettingsError;
use crate::table::Table;

/// Draw one independent link of a TR 38.901 model at each horizontal distance, as columns of equal
/// length. The default height of the radio head is the model's.
#[pyfunction]
#[pyo3(signature = (model, level_m, *, head_height_m = None, array_height_m, carrier_mhz, seed))]
#[allow(clippy::needless_pass_by_value)] // as Python passes them
pub fn channel_drops(
    py: Python<'_>,
    model: &str,
    level_m: PyReadonlyArray1<'_, f64>,
    head_height_m: Option<f64>,
    array_height_m: f64,
    carrier_mhz: f64,
    seed: u64,
) -> PyResult<Py<PyDict>> {
    let named = ChannelModel::named(model);
    let environment = named.and_then(|it| Environment::of(it, 1e-3 * carrier_mhz, None));
    let environment = environment.ok_or_else(|| {
        PyValueError::new_err(format!(
            "the model `{model}` has no drops; allowed are umi, inf-sl, inf-dl, inf-sh, inf-dh"
        ))
    })?;
    let head_height_m = head_height_m.unwrap_or_else(|| {
        let [head_height_m, _] = environment.heights_m(array_height_m, array_height_m);
        head_height_m
    });
    let level_m = level_m.as_slice()?;
    let numbers = [head_height_m, array_height_m, carrier_mhz];
    let mut all = level_m.iter().chain(&numbers);
    if !all.all(|it| it.is_finite() && *it >= 0.0) || carrier_mhz <= 0.0 {
        return Err(PyValueError::new_err(
            "distances, heights and the carrier must be finite and not negative",
        ));
    }
    let places: Vec<LinkGeometry> = level_m
        .iter()
        .map(|&level_m| LinkGeometry {
            level_m,
            head_m: head_height_m,
            array_m: array_height_m,
        })
        .collect();
    let drops = py.detach(|| draw_drops(&environment, &places, seed));
    let table = Table::new(py, drops.iter())
        .column("line_of_sight", |drop| drop.line_of_sight)?
        .column("path_loss_db", |drop| drop.path_loss_db)?
        .column("shadowing_db", |drop| drop.shadowing_db)?
        .column("rician_k_db", |drop| drop.k_db)?
        .column("delay_spread_s", |drop| drop.delay_spread_s)?
        .column("azimuth_spread_deg", |drop| drop.azimuth_spread_deg)?
        .column("zenith_spread_deg", |drop| drop.zenith_spread_deg)?
        .column("paths_delay_spread_s", |drop| drop.paths_delay_spread_s)?
        .column("paths_azimuth_spread_deg", |drop| {
            drop.paths_azimuth_spread_deg
        })?;
    Ok(table.finish())
}

/// Check that the simulator can use a file of ray-traced paths.
#[pyfunction]
pub fn check_paths(file: &str) -> PyResult<()> {
    match Paths::read(Path::new(file)) {
        Ok(_) => Ok(()),
        Err(error) => Err(SettingsError::new_err(format!("{file}: {error}"))),
    }
}
