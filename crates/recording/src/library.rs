//! Settings files: shipped files and files of the file system.

use std::path::{Path, PathBuf};

use onboard::settings::{Library, NamedText, SettingsError, Shipped, TomlFile};

use crate::road_file::read_points_m;
use crate::text::read_text;

/// Maximum size of a settings file in bytes.
const MAX_BYTES: u64 = 4 << 20;

/// Library of shipped files by name and other files by path. Relative paths in a file refer to its
/// folder.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Files;

/// Loads a shipped file by name, or another file by path.
///
/// # Errors
/// [`SettingsError`] if neither exists, or if the file is invalid.
pub fn load<T: TomlFile>(name_or_path: &str) -> Result<T, SettingsError> {
    T::from_library(name_or_path, &Files)
}

impl Library for Files {
    fn text(
        &self,
        what: &'static str,
        shipped: &[(&'static str, &'static str)],
        name: &str,
        referrer: &str,
    ) -> Result<NamedText, SettingsError> {
        let path = relative_to(referrer, name);
        match Shipped.text(what, shipped, name, referrer) {
            Err(unknown) if !path.exists() => Err(unknown),
            Err(_) => Ok(NamedText {
                text: read_text(&path, MAX_BYTES)?,
                origin: path.display().to_string(),
            }),
            found => found,
        }
    }

    fn points_m(&self, name: &str, referrer: &str) -> Result<Vec<[f64; 2]>, SettingsError> {
        read_points_m(&relative_to(referrer, name))
    }

    fn path(&self, name: &str, referrer: &str) -> String {
        let path = relative_to(referrer, name);
        let whole = std::path::absolute(&path).unwrap_or(path);
        whole.display().to_string()
    }
}

fn relative_to(referrer: &str, name: &str) -> PathBuf {
    let folder = Path::new(referrer).parent().unwrap_or(Path::new(""));
    folder.join(name)
}
