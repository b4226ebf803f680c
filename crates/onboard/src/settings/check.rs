//! Checks for settings that contradict each other. The JSON Schema contains the ranges of single
//! numbers.

use std::fmt::Display;

use super::error::SettingsError;

/// Check of one file; the first invalid value is returned as the error.
#[derive(Debug, Clone, Copy)]
pub struct Check<'a> {
    /// Name of the file, for error messages.
    pub file: &'a str,
}

impl Check<'_> {
    /// Returns the error for a value that is not `allowed`.
    pub fn error(&self, key: &str, value: impl Display, allowed: &str) -> SettingsError {
        SettingsError::Value {
            file: self.file.to_owned(),
            key: key.to_owned(),
            value: value.to_string(),
            allowed: allowed.to_owned(),
        }
    }

    /// Returns an error if `good` is false.
    ///
    /// # Errors
    /// [`SettingsError::Value`].
    pub fn that(
        &self,
        good: bool,
        key: &str,
        value: impl Display,
        allowed: &str,
    ) -> Result<(), SettingsError> {
        if good {
            Ok(())
        } else {
            Err(self.error(key, value, allowed))
        }
    }
}
