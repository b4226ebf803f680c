//! One thing that is most likely not meant.

use std::fmt;

/// A value that can be, and is most likely not what was meant.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Warning {
    /// Path of the key: `radio_heads[0].position_m`.
    pub key: String,
    /// Its value.
    pub value: String,
    /// Why it is doubtful, physically.
    pub why: String,
    /// What to write instead.
    pub write: String,
}

impl Warning {
    /// The same of a table that another file holds at `path`.
    #[must_use]
    pub fn beneath(mut self, path: &str) -> Self {
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
