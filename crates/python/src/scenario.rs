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

/// A scenario, checked.
#[pyclass(frozen, eq, module = "access_av._core")]
#[derive(PartialEq)]
pub struct Scenario(pub CoreScenario);

#[pymethods]
impl Scenario {
    /// Load a shipped scenario by its name, or else a scenario file by its path.
    #[staticmethod]
    fn load(name_or_path: &str) -> PyResult<Self> {
        CoreScenario::load(name_or_path)
            .map(Self)
            .map_err(scenario_error)
    }

    /// Read a scenario from TOML; `origin` is the file that errors name.
    #[staticmethod]
    #[pyo3(signature = (text, origin = "<string>"))]
    fn from_toml(text: &str, origin: &str) -> PyResult<Self> {
        CoreScenario::from_toml(text, origin)
            .map(Self)
            .map_err(scenario_error)
    }

    /// Names of the shipped scenarios.
    #[staticmethod]
    fn names() -> Vec<&'static str> {
        CoreScenario::names().collect()
    }

    /// JSON Schema of a scenario file.
    #[staticmethod]
    fn schema_json() -> String {
        CoreScenario::schema_json()
    }

    /// This scenario with single keys set, such as `{"channel.rician_k_db": 10.0}`.
    fn with_overrides(&self, overrides: &Bound<'_, PyDict>) -> PyResult<Self> {
        let pairs = pairs(overrides)?;
        let borrowed = pairs
            .iter()
            .map(|(path, value)| (path.as_str(), value.clone()));
        self.0
            .with_overrides(borrowed)
            .map(Self)
            .map_err(scenario_error)
    }

    /// The scenario as TOML, every default written out.
    fn to_toml(&self) -> String {
        self.0.to_toml()
    }

    /// The scenario as JSON, every default written out.
    fn to_json(&self) -> String {
        self.0.to_json()
    }

    /// Short name.
    #[getter]
    fn name(&self) -> &str {
        &self.0.name
    }

    /// What the scenario is for.
    #[getter]
    fn description(&self) -> &str {
        &self.0.description
    }

    fn __repr__(&self) -> String {
        format!("Scenario({:?})", self.0.name)
    }
}

/// A platform, checked.
#[pyclass(frozen, eq, module = "access_av._core")]
#[derive(PartialEq)]
pub struct Platform(pub CorePlatform);

#[pymethods]
impl Platform {
    /// Load a shipped platform by its name, or else a platform file by its path.
    #[staticmethod]
    fn load(name_or_path: &str) -> PyResult<Self> {
        CorePlatform::load(name_or_path)
            .map(Self)
            .map_err(scenario_error)
    }

    /// Read a platform from TOML; `origin` is the file that errors name.
    #[staticmethod]
    #[pyo3(signature = (text, origin = "<string>"))]
    fn from_toml(text: &str, origin: &str) -> PyResult<Self> {
        CorePlatform::from_toml(text, origin)
            .map(Self)
            .map_err(scenario_error)
    }

    /// Names of the shipped platforms.
    #[staticmethod]
    fn names() -> Vec<&'static str> {
        CorePlatform::names().collect()
    }

    /// JSON Schema of a platform file.
    #[staticmethod]
    fn schema_json() -> String {
        CorePlatform::schema_json()
    }

    /// This platform with single keys set, such as `{"modes[0].cores": 4}`.
    fn with_overrides(&self, overrides: &Bound<'_, PyDict>) -> PyResult<Self> {
        let pairs = pairs(overrides)?;
        let borrowed = pairs
            .iter()
            .map(|(path, value)| (path.as_str(), value.clone()));
        self.0
            .with_overrides(borrowed)
            .map(Self)
            .map_err(scenario_error)
    }

    /// The platform as TOML, every default written out.
    fn to_toml(&self) -> String {
        self.0.to_toml()
    }

    /// The platform as JSON, every default written out.
    fn to_json(&self) -> String {
        self.0.to_json()
    }

    /// Short name.
    #[getter]
    fn name(&self) -> &str {
        &self.0.name
    }

    fn __repr__(&self) -> String {
        format!("Platform({:?})", self.0.name)
    }
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
