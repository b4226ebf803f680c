//! Scenarios and platforms: reading, overriding, writing out.

use access_av::platform::Platform as CorePlatform;
use access_av::scenario::{Scenario as CoreScenario, ScenarioError as CoreError};
use pyo3::create_exception;
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyList, PyString, PyTuple};
use toml::{Table, Value};

create_exception!(
    access_av._core,
    ScenarioError,
    PyValueError,
    "An unusable scenario or platform; the message names file, key and what is allowed."
);

/// The Python error for a core error.
#[allow(clippy::needless_pass_by_value)] // the shape that `map_err` wants
pub fn scenario_error(error: CoreError) -> PyErr {
    ScenarioError::new_err(error.to_string())
}

/// A Python class for a checked TOML file of which some are shipped by name, with what is its own.
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
                <$core>::load(name_or_path).map(Self).map_err(scenario_error)
            }

            #[doc = concat!("Read a ", $what, " from TOML; `origin` is the file that errors name.")]
            #[staticmethod]
            #[pyo3(signature = (text, origin = "<string>"))]
            fn from_toml(text: &str, origin: &str) -> PyResult<Self> {
                <$core>::from_toml(text, origin).map(Self).map_err(scenario_error)
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
                self.0.with_overrides(borrowed).map(Self).map_err(scenario_error)
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

            fn __repr__(&self) -> String {
                format!("{}({:?})", stringify!($class), self.0.name)
            }

            $($own)*
        }
    };
}

toml_file! {
    /// A scenario, checked.
    Scenario(CoreScenario), "scenario",

    /// What the scenario is for.
    #[getter]
    fn description(&self) -> &str {
        &self.0.description
    }

    /// The scenario with the wake-up times written out that it leaves to the platform, which is
    /// the one it names unless another is given.
    #[pyo3(signature = (platform = None))]
    fn resolved(&self, platform: Option<&Platform>) -> PyResult<Self> {
        let resolved = match platform {
            Some(platform) => platform.0.resolve(&self.0),
            None => CorePlatform::load(&self.0.platform.name)
                .and_then(|platform| platform.resolve(&self.0)),
        };
        resolved.map(Self).map_err(scenario_error)
    }
}

toml_file! {
    /// A platform, checked.
    Platform(CorePlatform), "platform",
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
    // In Python, bool is an int: it has to come first.
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
