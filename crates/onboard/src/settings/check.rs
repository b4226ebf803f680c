//! Values that contradict each other. Ranges of single numbers stand in the schema.

use std::fmt::Display;

use super::error::SettingsError;

/// Collects nothing: the first bad value is the error.
#[derive(Debug, Clone, Copy)]
pub struct Check<'a> {
    /// The file that errors name.
    pub file: &'a str,
}

impl Check<'_> {
    /// The error for a value that is not `allowed`.
    pub fn error(&self, key: &str, value: impl Display, allowed: &str) -> SettingsError {
        SettingsError::Value {
            file: self.file.to_owned(),
            key: key.to_owned(),
            value: value.to_string(),
            allowed: allowed.to_owned(),
        }
    }

    /// Refuses a value for which `good` is false.
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
