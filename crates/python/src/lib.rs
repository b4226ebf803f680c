//! `access_av._core`: the bindings, nothing else. One file per room of the core.
mod scenario;
mod simulate;

use pyo3::prelude::*;

/// The compiled core of `access_av`.
#[pymodule]
mod _core {
    use super::*;

    #[pymodule_export]
    use crate::scenario::{Platform, Scenario, ScenarioError};
    #[pymodule_export]
    use crate::simulate::{SimulationResult, simulate};

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
