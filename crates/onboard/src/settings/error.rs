//! What can be wrong with a settings file, said so that it can be put right.

use std::io;

use thiserror::Error;

/// An unusable settings file. `file` is the path, or the origin the caller named.
#[derive(Debug, Error)]
pub enum SettingsError {
    /// The file cannot be read.
    #[error("{file}: {source}")]
    Read {
        /// The file.
        file: String,
        /// Why not.
        source: io::Error,
    },
    /// Neither a shipped name nor a file.
    #[error("no {what} `{name}`: neither a file nor one of {}{}", quoted(known), suggestion(nearest.as_deref()))]
    UnknownName {
        /// The kind of file: "site", "vehicle", "scenario", "platform".
        what: &'static str,
        /// What was asked for.
        name: String,
        /// The shipped ones.
        known: Vec<String>,
        /// The shipped one that looks most like it.
        nearest: Option<String>,
    },
    /// Not TOML.
    #[error("{file}: not valid TOML: {message}")]
    Syntax {
        /// The file.
        file: String,
        /// The parser's message, with line and column.
        message: String,
    },
    /// A key the schema does not have.
    #[error("{file}: unknown key `{key}`; allowed here: {}{}", quoted(allowed), suggestion(nearest.as_deref()))]
    UnknownKey {
        /// The file.
        file: String,
        /// Path of the key.
        key: String,
        /// The keys allowed in its place.
        allowed: Vec<String>,
        /// The allowed key that looks most like it.
        nearest: Option<String>,
    },
    /// A missing key, or a value of the wrong type.
    #[error("{file}: `{key}`: {message}")]
    Shape {
        /// The file.
        file: String,
        /// Path of the key, or of the table it is missing from.
        key: String,
        /// What was found and what is expected.
        message: String,
    },
    /// A value out of range, or one that contradicts another.
    #[error("{file}: `{key}` is {value}; {allowed}")]
    Value {
        /// The file.
        file: String,
        /// Path of the key.
        key: String,
        /// Its value.
        value: String,
        /// What is allowed.
        allowed: String,
    },
}

impl SettingsError {
    /// The same defect of a table that another file holds at `path`.
    #[must_use]
    pub fn beneath(mut self, holder: &str, path: &str) -> Self {
        if let Self::UnknownName { name, .. } = &self {
            return Self::Value {
                value: format!("{name:?}"),
                allowed: self.to_string(),
                file: holder.to_owned(),
                key: path.to_owned(),
            };
        }
        if let Self::UnknownKey { file, key, .. }
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

    /// The error for a name that is neither a file nor one of the shipped.
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

/// The name that looks most like `name`, if any does.
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
