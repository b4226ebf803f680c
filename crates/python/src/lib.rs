//! `access_av._core`: the Python bindings, one file per module of the core.
mod aoa;
mod arrays;
mod bound;
mod campaign;
mod channel;
mod drive;
mod interrupt;
mod live;
mod message;
mod nr;
mod plug_ins;
mod recording;
mod settings;
mod survey;
mod table;
mod threads;

use pyo3::pymodule;

/// Compiled core of `access_av`.
#[pymodule]
mod _core {
    use pyo3::prelude::*;

    #[pymodule]
    mod aoa {
        #[pymodule_export]
        use crate::aoa::{
            AngleEstimate, DirectionEstimate, MeasuredManifold, calibrate, covariance, crb_rad,
            direction, direction_crb_rad, direction_spectrum, esprit, estimate_sources,
            forward_backward, maximum_likelihood, maximum_likelihood_pilots, music, root_music,
            spectrum,
        };
        use pyo3::prelude::*;

        #[pymodule_init]
        fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
            // Register the submodule, so that `import access_av._core.aoa` works with a compiled
            // module.
            let modules = module.py().import("sys")?.getattr("modules")?;
            modules.set_item("access_av._core.aoa", module)
        }
    }

    #[pymodule]
    mod interrupt {
        #[pymodule_export]
        use crate::interrupt::{came, clean, end, watch, writing};
        use pyo3::prelude::*;

        #[pymodule_init]
        fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
            let modules = module.py().import("sys")?.getattr("modules")?;
            module.add("INTERRUPTED", crate::interrupt::INTERRUPTED)?;
            modules.set_item("access_av._core.interrupt", module)
        }
    }

    #[pymodule]
    mod nr {
        #[pymodule_export]
        use crate::nr::{Cell, Observables, Receiver, Scan, Searcher, build_burst, scan, search};
        use pyo3::prelude::*;

        #[pymodule_init]
        fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
            let modules = module.py().import("sys")?.getattr("modules")?;
            modules.set_item("access_av._core.nr", module)
        }
    }

    #[pymodule_export]
    use crate::bound::ErrorBound;
    #[pymodule_export]
    use crate::campaign::{MeasurementTraces, SimulationResult, simulate};
    #[pymodule_export]
    use crate::channel::{channel_drops, check_paths};
    #[pymodule_export]
    use crate::drive::{
        LocatedDrive, estimate_angles, locate, log_angles, read_ranges, read_tum, synthesize,
    };
    #[pymodule_export]
    use crate::live::{Live, LiveEnergy, LiveHead, LiveOutcome, LiveStatus};
    #[pymodule_export]
    use crate::message::brief_text;
    #[pymodule_export]
    use crate::plug_ins::{RadioHead, Situation, SsbDetection};
    #[pymodule_export]
    use crate::recording::{Recording, RecordingError};
    #[pymodule_export]
    use crate::settings::{
        Plant, Platform, Scenario, SettingsError, SettingsWarning, Site, Vehicle,
    };
    #[pymodule_export]
    use crate::survey::LoggedDrive;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add(
            "ERROR_CORRELATION_S",
            onboard::settings::ERROR_CORRELATION_S,
        )?;
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
