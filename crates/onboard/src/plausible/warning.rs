//! Warning for an implausible value.

use std::fmt;

/// Warning for a value that is possible, but probably a mistake.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Warning {
    /// Path of the key, such as `radio_heads[0].position_m`.
    pub key: String,
    /// Its value.
    pub value: String,
    /// Physical reason.
    pub why: String,
    /// Suggested value.
    pub write: String,
}

impl Warning {
    /// Returns the warning with the path of the enclosing table, for a table of another file.
    #[must_use]
    pub fn with_path_prefix(mut self, path: &str) -> Self {
        self.key = format!("{path}.{}", self.key);
        self
    }
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            key,
            value,
            why,
            write,
        } = self;
        write!(f, "`{key}` is {value}: {why}; {write}")
    }
}
