//! Errors of settings files; each names the file, the key and the allowed values.

use std::io;

use thiserror::Error;

/// Unusable settings file. `file` is its path, or the origin that the caller named.
#[derive(Debug, Error)]
pub enum SettingsError {
    /// The file cannot be read.
    #[error("{file}: {source}")]
    Read {
        /// Path of the file.
        file: String,
        /// Cause, as reported by the operating system.
        source: io::Error,
    },
    /// The name is neither that of a shipped file nor that of an existing file.
    #[error("no {what} `{name}`: neither a file nor one of {}{}", quoted(known), suggestion(nearest.as_deref()))]
    UnknownName {
        /// Kind of file: "site", "vehicle", "scenario" or "platform".
        what: &'static str,
        /// Requested name.
        name: String,
        /// Names of the shipped files.
        known: Vec<String>,
        /// The most similar name of a shipped file, if one is similar.
        nearest: Option<String>,
    },
    /// The text is not valid TOML.
    #[error("{file}: not valid TOML: {message}")]
    Syntax {
        /// Path of the file.
        file: String,
        /// The parser's message, with line and column.
        message: String,
    },
    /// The schema does not contain the key.
    #[error("{file}: unknown key `{key}`; allowed here: {}{}", quoted(allowed), suggestion(nearest.as_deref()))]
    UnknownKey {
        /// Path of the file.
        file: String,
        /// Path of the key.
        key: String,
        /// Keys that are allowed in this table.
        allowed: Vec<String>,
        /// The most similar allowed key, if one is similar.
        nearest: Option<String>,
    },
    /// The key was renamed.
    #[error("{file}: `{key}` was renamed in version 0.2.0: write `{new}`")]
    RenamedKey {
        /// Path of the file.
        file: String,
        /// Path of the old key.
        key: String,
        /// Path of the new key.
        new: String,
    },
    /// The key was removed.
    #[error("{file}: `{key}` was removed in version 0.2.0: {instead}")]
    RemovedKey {
        /// Path of the file.
        file: String,
        /// Path of the removed key.
        key: String,
        /// Replacement of the key.
        instead: String,
    },
    /// A key is missing, or its value has the wrong type.
    #[error("{file}: `{key}`: {message}")]
    Shape {
        /// Path of the file.
        file: String,
        /// Path of the key, or of the table that lacks the key.
        key: String,
        /// Value found, and expected type.
        message: String,
    },
    /// A value is out of range, or contradicts another value.
    #[error("{file}: `{key}` is {value}; {allowed}")]
    Value {
        /// Path of the file.
        file: String,
        /// Path of the key.
        key: String,
        /// Invalid value.
        value: String,
        /// Allowed values.
        allowed: String,
    },
}

impl SettingsError {
    /// Returns the error with the path of the enclosing table, for a table that is part of another
    /// file.
    #[must_use]
    pub fn with_path_prefix(mut self, holder: &str, path: &str) -> Self {
        if let Self::UnknownName { name, .. } = &self {
            return Self::Value {
                value: format!("{name:?}"),
                allowed: self.to_string(),
                file: holder.to_owned(),
                key: path.to_owned(),
            };
        }
        if let Self::RenamedKey { new, .. } = &mut self {
            *new = format!("{path}.{new}");
        }
        if let Self::UnknownKey { file, key, .. }
        | Self::RenamedKey { file, key, .. }
        | Self::RemovedKey { file, key, .. }
        | Self::Shape { file, key, .. }
        | Self::Value { file, key, .. } = &mut self
        {
            holder.clone_into(file);
            *key = if key.is_empty() || key.starts_with('(') {
                path.to_owned()
            } else {
                format!("{path}.{key}")
            };
        }
        self
    }

    /// Returns the error for a name that is neither a file nor a shipped file.
    pub fn unknown_name<'a>(
        what: &'static str,
        name: &str,
        known: impl Iterator<Item = &'a str> + Clone,
    ) -> Self {
        Self::UnknownName {
            what,
            name: name.to_owned(),
            nearest: nearest(name, known.clone()),
            known: known.map(str::to_owned).collect(),
        }
    }
}

fn quoted(names: &[String]) -> String {
    names
        .iter()
        .map(|name| format!("`{name}`"))
        .collect::<Vec<_>>()
        .join(", ")
}

fn suggestion(nearest: Option<&str>) -> String {
    nearest
        .map(|name| format!(" (did you mean `{name}`?)"))
        .unwrap_or_default()
}

/// Returns the known name that is most similar to `name`, if one is similar.
pub fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<String> {
    known
        .into_iter()
        .map(|candidate| {
            (
                strsim::normalized_damerau_levenshtein(name, candidate),
                candidate,
            )
        })
        .filter(|(likeness, _)| *likeness > 0.6)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, candidate)| candidate.to_owned())
}
