//! Sites, vehicles, scenarios and platforms: reading, overriding and writing.

use std::collections::HashMap;
use std::hash::{DefaultHasher, Hash, Hasher};

use onboard::energy::EnergyModel;
use onboard::plausible::{self, Warning};
use onboard::settings::{
    Check, Extent, Platform as CorePlatform, SettingsError as CoreError, Site as CoreSite,
    TomlFile, Vehicle as CoreVehicle,
};
use onboard::wake_up;
use pyo3::create_exception;
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyList, PyString, PyTuple};
use recording::Files;
use simulate::scenario::{Plant as CorePlant, Scenario as CoreScenario};
use toml::{Table, Value};

use crate::message::brief;

create_exception!(
    access_av._core,
    SettingsError,
    PyValueError,
    "An unusable site, vehicle, scenario or platform; the message names file, key and what is \
     allowed."
);

/// Converts an error of the core to the Python error.
#[allow(clippy::needless_pass_by_value)] // the shape that `map_err` wants
pub fn settings_error(error: CoreError) -> PyErr {
    SettingsError::new_err(brief(error))
}

/// Warning of a valid but implausible value.
#[pyclass(frozen, eq, hash, module = "access_av._core")]
#[derive(PartialEq, Eq, Hash)]
pub struct SettingsWarning(Warning);

#[pymethods]
impl SettingsWarning {
    /// Path of the key.
    #[getter]
    fn key(&self) -> &str {
        &self.0.key
    }

    /// Value of the key.
    #[getter]
    fn value(&self) -> &str {
        &self.0.value
    }

    /// Physical reason why the value is implausible.
    #[getter]
    fn why(&self) -> &str {
        &self.0.why
    }

    /// Suggested correction.
    #[getter]
    fn write(&self) -> &str {
        &self.0.write
    }

    fn __str__(&self) -> String {
        self.0.to_string()
    }

    fn __repr__(&self) -> String {
        format!("SettingsWarning({:?})", self.0.to_string())
    }
}

fn wrapped(warnings: Vec<Warning>) -> Vec<SettingsWarning> {
    warnings.into_iter().map(SettingsWarning).collect()
}

/// Defines a Python class for a validated TOML file, with shipped files by name and class-specific
/// methods.
macro_rules! toml_file {
    ($(#[$doc:meta])* $class:ident($core:ty), $what:literal, $($own:tt)*) => {
        $(#[$doc])*
        #[pyclass(frozen, eq, module = "access_av._core")]
        #[derive(PartialEq)]
        pub struct $class(pub $core);

        #[pymethods]
        impl $class {
            #[doc = concat!("Load a shipped ", $what, " by its name, or else a ", $what,
                " file by its path.")]
            #[staticmethod]
            fn load(name_or_path: &str) -> PyResult<Self> {
                recording::load::<$core>(name_or_path).map(Self).map_err(settings_error)
            }

            #[doc = concat!("Read a ", $what, " from TOML; `origin` is the file that errors name.")]
            #[staticmethod]
            #[pyo3(signature = (text, origin = "<string>"))]
            fn from_toml(text: &str, origin: &str) -> PyResult<Self> {
                <$core>::from_toml(text, origin, &Files).map(Self).map_err(settings_error)
            }

            #[doc = concat!("Names of the shipped ", $what, "s.")]
            #[staticmethod]
            fn names() -> Vec<&'static str> {
                <$core>::names().collect()
            }

            #[doc = concat!("JSON Schema of a ", $what, " file.")]
            #[staticmethod]
            fn schema_json() -> String {
                <$core>::schema_json()
            }

            #[doc = concat!("This ", $what, " with single keys set, by their dotted paths.")]
            fn with_overrides(&self, overrides: &Bound<'_, PyDict>) -> PyResult<Self> {
                let pairs = pairs(overrides)?;
                let borrowed = pairs.iter().map(|(path, value)| (path.as_str(), value.clone()));
                self.0.with_overrides(borrowed, &Files).map(Self).map_err(settings_error)
            }

            #[doc = concat!("The ", $what, " as TOML, every default written out.")]
            fn to_toml(&self) -> String {
                self.0.to_toml()
            }

            #[doc = concat!("The ", $what, " as JSON, every default written out.")]
            fn to_json(&self) -> String {
                self.0.to_json()
            }

            /// Short name.
            #[getter]
            fn name(&self) -> &str {
                &self.0.name
            }

            /// Description of the file's purpose.
            #[getter]
            fn description(&self) -> &str {
                &self.0.description
            }

            fn __repr__(&self) -> String {
                format!("{}({:?})", stringify!($class), self.0.name)
            }

            fn __hash__(&self) -> u64 {
                let mut hasher = DefaultHasher::new();
                self.0.to_toml().hash(&mut hasher);
                hasher.finish()
            }

            /// Copies and pickles use the TOML text.
            fn __reduce__<'py>(
                slf: &Bound<'py, Self>,
            ) -> PyResult<(Bound<'py, PyAny>, (String, String))> {
                let core = &slf.get().0;
                let from_toml = slf.get_type().getattr("from_toml")?;
                Ok((from_toml, (core.to_toml(), core.name.clone())))
            }

            $($own)*
        }
    };
}

/// Name, both ends in metres, horizontal error in metres, and share of the time in percent.
type NamedStretch = (String, f64, f64, f64, f64);

toml_file! {
    /// Site: validated nominal model of the plant.
    Site(CoreSite), "site",

    /// Return warnings about implausible values for any vehicle. With a vehicle, warnings about the
    /// vehicle are included, and the keys begin with `site` and `vehicle`. Raises `SettingsError`
    /// if the vehicle's platform lacks a required capability.
    #[pyo3(signature = (vehicle = None))]
    fn warnings(&self, vehicle: Option<&Vehicle>) -> PyResult<Vec<SettingsWarning>> {
        let Some(vehicle) = vehicle else {
            return Ok(wrapped(plausible::of_site(&self.0)));
        };
        let mut found = plausible::of_site_and_vehicle(&self.0, &vehicle.0);
        found.extend(platform_warnings(&vehicle.0).map_err(settings_error)?);
        Ok(wrapped(found))
    }
}

toml_file! {
    /// Vehicle: validated nominal model of the vehicle and its settings.
    Vehicle(CoreVehicle), "vehicle",

    /// Protection level in metres above which the state is not `ok`; `None` without integrity
    /// monitoring.
    #[getter]
    fn alert_limit_m(&self) -> Option<f64> {
        self.0.integrity_monitor().map(|it| it.alert_limit_m)
    }

    /// Return the vehicle with explicit wake-up settings in place of the platform's defaults. The
    /// default platform is the one that the vehicle names.
    #[pyo3(signature = (platform = None))]
    fn resolved(&self, platform: Option<&Platform>) -> PyResult<Self> {
        resolve(&self.0, platform).map(Self).map_err(settings_error)
    }

    /// Return warnings about implausible values. Raises `SettingsError` if the platform does not
    /// exist or lacks a required capability.
    fn warnings(&self) -> PyResult<Vec<SettingsWarning>> {
        let mut found = plausible::of_vehicle(&self.0);
        found.extend(platform_warnings(&self.0).map_err(settings_error)?);
        Ok(wrapped(found))
    }
}

toml_file! {
    /// Scenario: a site, a vehicle, the environment and the deviations of the truth, validated.
    Scenario(CoreScenario), "scenario",

    /// Nominal site.
    #[getter]
    fn site(&self) -> Site {
        Site(self.0.site.clone())
    }

    /// Nominal vehicle.
    #[getter]
    fn vehicle(&self) -> Vehicle {
        Vehicle(self.0.vehicle.clone())
    }

    /// Upper bounds of the size of a drive: duration in seconds, SSB bursts, SSBs of all radio
    /// heads, odometry samples, and memory of a run in bytes.
    #[getter]
    fn size(&self) -> PyResult<HashMap<&'static str, f64>> {
        let check = Check { file: &self.0.name };
        let size = self.0.size(check).map_err(settings_error)?;
        Ok(HashMap::from([
            ("duration_s", size.duration_s),
            ("bursts", size.bursts),
            ("ssbs", size.angles),
            ("odometry_samples", size.odometry_samples),
            ("bytes", size.bytes(1)),
        ]))
    }

    /// Return warnings about implausible values of scenario, site and vehicle. Raises
    /// `SettingsError` if the vehicle's platform lacks a required capability.
    fn warnings(&self) -> PyResult<Vec<SettingsWarning>> {
        let of_platform = platform_warnings(&self.0.vehicle)
            .map_err(|error| settings_error(error.with_path_prefix(&self.0.name, "vehicle")))?;
        let mut found = self.0.warnings().map_err(settings_error)?;
        found.extend(of_platform);
        Ok(wrapped(found))
    }

    /// Return the scenario with explicit wake-up settings in place of the platform's defaults. The
    /// default platform is the one that the vehicle names.
    #[pyo3(signature = (platform = None))]
    fn resolved(&self, platform: Option<&Platform>) -> PyResult<Self> {
        let mut resolved = self.0.clone();
        resolved.vehicle = resolve(&self.0.vehicle, platform).map_err(settings_error)?;
        Ok(Self(resolved))
    }
}

toml_file! {
    /// Plant: a site, a vehicle, the fleet and the required accuracy, validated.
    Plant(CorePlant), "plant",

    /// Maximum horizontal error in metres, and the fraction of time for which it is required in
    /// percent.
    #[getter]
    fn target(&self) -> (f64, f64) {
        (self.0.target.error_m(), self.0.target.percent())
    }

    /// Return the targets of positions and stretches: name, both ends as distances along the road in metres, horizontal error
    /// in metres, and share of the time in percent.
    #[getter]
    fn targets(&self) -> PyResult<Vec<NamedStretch>> {
        let check = Check { file: &self.0.name };
        let path = self.0.scenario(&self.0.channel).path(check);
        let road_m = path.map_err(settings_error)?.length_m();
        Ok(self.0.targets.iter().map(|it| {
            let [from_m, to_m] = it.ends_m(road_m);
            (it.name.clone(), from_m, to_m, it.target.error_m(), it.target.percent())
        }).collect())
    }

    /// Return the scenario of a trip with the nominal channel.
    fn scenario(&self) -> Scenario {
        Scenario(self.0.scenario(&self.0.channel))
    }

    /// Return the scenario of a trip with the poor channel.
    fn poor_scenario(&self) -> Scenario {
        Scenario(self.0.scenario(&self.0.poor_channel))
    }

    /// Return warnings about implausible values of site, vehicle, trip and prices. Raises
    /// `SettingsError` if the vehicle's platform lacks a required capability.
    fn warnings(&self) -> PyResult<Vec<SettingsWarning>> {
        let of_platform = platform_warnings(&self.0.vehicle)
            .map_err(|error| settings_error(error.with_path_prefix(&self.0.name, "vehicle")))?;
        let mut found = self.0.warnings().map_err(settings_error)?;
        found.extend(of_platform);
        Ok(wrapped(found))
    }
}

toml_file! {
    /// Platform: validated figures of the onboard computer.
    Platform(CorePlatform), "platform",

    /// Return the energy of a run in joules: `(aoa_estimates, listening, idle, boundary)`, for numbers
    /// of angle estimates and received SSB bursts and a duration in seconds, with the vehicle's
    /// method and power mode. `extent` is "value", or "low" or "high" for the end of every figure's
    /// range. `None` if the platform has no figure for the method.
    #[pyo3(signature = (vehicle, aoa_estimates, bursts_received, duration_s, extent = "value"))]
    fn energy_j(
        &self,
        vehicle: &Vehicle,
        aoa_estimates: usize,
        bursts_received: usize,
        duration_s: f64,
        extent: &str,
    ) -> PyResult<Option<(f64, f64, f64, String)>> {
        let model = EnergyModel::new(&vehicle.0, &self.0, extent_of(extent)?);
        Ok(model.map_err(settings_error)?.map(|model| {
            let energy = model.run_energy(aoa_estimates, bursts_received, duration_s);
            let boundary = model.boundary.to_string();
            (energy.aoa_estimates_j, energy.listening_j, energy.idle_j, boundary)
        }))
    }

    /// Return warnings about implausible values.
    fn warnings(&self) -> Vec<SettingsWarning> {
        wrapped(plausible::of_platform(&self.0))
    }

    /// Return the minimum time between two estimates in seconds for a vehicle's method and mode.
    fn base_wake_up_s(&self, vehicle: &Vehicle) -> PyResult<f64> {
        self.0.base_wake_up_s(&vehicle.0).map_err(settings_error)
    }

    /// Return the power of the board in watts with the given number of busy cores, by the index of
    /// the mode; `None` if the platform has no power model.
    fn busy_power_w(&self, mode: usize, cores: u32) -> PyResult<Option<f64>> {
        let modes = &self.0.modes;
        let mode = modes.get(mode).ok_or_else(|| {
            PyValueError::new_err(format!("`mode` is {mode}; there are {}", modes.len()))
        })?;
        Ok(self.0.busy_power_w(mode, cores))
    }
}

fn extent_of(name: &str) -> PyResult<Extent> {
    match name {
        "low" => Ok(Extent::Low),
        "value" => Ok(Extent::Value),
        "high" => Ok(Extent::High),
        _ => Err(PyValueError::new_err(format!(
            "`extent` is {name:?}; allowed are \"low\", \"value\" and \"high\""
        ))),
    }
}

fn resolve(vehicle: &CoreVehicle, platform: Option<&Platform>) -> Result<CoreVehicle, CoreError> {
    match platform {
        Some(platform) => wake_up::resolve(vehicle, &platform.0),
        None => wake_up::resolve(vehicle, &platform_of(vehicle)?),
    }
}

fn platform_of(vehicle: &CoreVehicle) -> Result<CorePlatform, CoreError> {
    recording::load(&vehicle.platform.name)
        .map_err(|error| error.with_path_prefix(&vehicle.name, "platform.name"))
}

/// Returns warnings about the platform that a vehicle names; an error if it lacks a required
/// capability.
fn platform_warnings(vehicle: &CoreVehicle) -> Result<Vec<Warning>, CoreError> {
    let platform = platform_of(vehicle)?;
    platform.mode(&vehicle.platform, &vehicle.name)?;
    wake_up::resolve(vehicle, &platform)?;
    let found = plausible::of_platform(&platform).into_iter();
    Ok(found
        .map(|it| it.with_path_prefix(&platform.name))
        .collect())
}

fn pairs(overrides: &Bound<'_, PyDict>) -> PyResult<Vec<(String, Value)>> {
    overrides
        .iter()
        .map(|(path, value)| {
            let path: String = path.extract()?;
            let value = to_toml(&value, &path)?;
            Ok((path, value))
        })
        .collect()
}

fn to_toml(value: &Bound<'_, PyAny>, path: &str) -> PyResult<Value> {
    let each = |items: Vec<Bound<'_, PyAny>>| {
        items
            .iter()
            .map(|item| to_toml(item, path))
            .collect::<PyResult<Vec<_>>>()
    };
    // In Python, bool is a subclass of int and must be checked first.
    if value.is_instance_of::<PyBool>() {
        Ok(Value::Boolean(value.extract()?))
    } else if value.is_instance_of::<PyInt>() {
        Ok(Value::Integer(value.extract()?))
    } else if value.is_instance_of::<PyFloat>() {
        Ok(Value::Float(value.extract()?))
    } else if value.is_instance_of::<PyString>() {
        Ok(Value::String(value.extract()?))
    } else if value.is_instance_of::<PyList>() || value.is_instance_of::<PyTuple>() {
        Ok(Value::Array(each(value.extract()?)?))
    } else if let Ok(table) = value.cast::<PyDict>() {
        let mut items = Table::new();
        for (key, item) in table.iter() {
            items.insert(key.extract()?, to_toml(&item, path)?);
        }
        Ok(Value::Table(items))
    } else if let Ok(number) = value.extract::<f64>() {
        // NumPy scalars.
        Ok(Value::Float(number))
    } else {
        Err(PyTypeError::new_err(format!(
            "`{path}`: a {} cannot be a setting; allowed are bool, int, float, str, list and dict",
            value.get_type().name()?
        )))
    }
}
