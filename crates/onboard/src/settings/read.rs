//! From TOML text to settings, with errors that name the key.

use serde::de::DeserializeOwned;
use toml::{Table, Value};

use super::error::{SettingsError, nearest};

/// Parses TOML into a table.
///
/// # Errors
/// [`SettingsError::Syntax`].
pub fn parse(text: &str, file: &str) -> Result<Table, SettingsError> {
    text.parse::<Table>()
        .map_err(|error| SettingsError::Syntax {
            file: file.to_owned(),
            message: error.to_string().trim_end().to_owned(),
        })
}

/// Turns a parsed table into settings.
///
/// # Errors
/// [`SettingsError`] naming the key.
pub fn from_table<T: DeserializeOwned>(table: Table, file: &str) -> Result<T, SettingsError> {
    let value = Value::Table(table);
    refuse_not_finite(&value, "", file)?;
    read::<T>(&value).map_err(|defect| {
        let path = precise_path::<T>(&value, &defect);
        explain(file, &path, &defect.message)
    })
}

/// What serde says is wrong, and where as far as it knows.
struct Defect {
    path: String,
    message: String,
}

fn read<T: DeserializeOwned>(value: &Value) -> Result<T, Defect> {
    serde_path_to_error::deserialize(value.clone()).map_err(|error| {
        let path = error.path().to_string();
        let message = error.inner().to_string();
        Defect {
            path: if path == "." { String::new() } else { path },
            // The TOML reader adds the path on a second line, less precisely.
            message: message.lines().next().unwrap_or_default().to_owned(),
        }
    })
}

/// The path of the offending key. serde's own path ends at tables with a tag, which it reads ahead
/// as a whole; inside them the offender is the key without which this defect is gone.
fn precise_path<T: DeserializeOwned>(value: &Value, defect: &Defect) -> String {
    let mut path = defect.path.clone();
    let gone = |key: &str| match read::<T>(&without(value, key)) {
        Ok(_) => true,
        Err(other) => {
            other.message != defect.message && !other.message.starts_with("missing field")
        }
    };
    while let Some(Value::Table(table)) = at(value, &path) {
        let candidates = table.keys().map(|key| join(&path, key));
        let Some(offender) = candidates.into_iter().find(|candidate| gone(candidate)) else {
            break;
        };
        path = offender;
    }
    path
}

fn at<'a>(value: &'a Value, path: &str) -> Option<&'a Value> {
    steps(path).try_fold(value, |here, step| match step.parse::<usize>() {
        Ok(index) => here.get(index),
        Err(_) => here.get(step),
    })
}

fn without(value: &Value, path: &str) -> Value {
    let mut copy = value.clone();
    if let Some((key, parents)) = steps(path).collect::<Vec<_>>().split_last() {
        let table = parents
            .iter()
            .try_fold(&mut copy, |here, step| match step.parse::<usize>() {
                Ok(index) => here.get_mut(index),
                Err(_) => here.get_mut(step),
            });
        if let Some(table) = table.and_then(Value::as_table_mut) {
            table.remove(*key);
        }
    }
    copy
}

/// `radio_heads[0].pci` as `radio_heads`, `0`, `pci`.
fn steps(path: &str) -> impl Iterator<Item = &str> {
    path.split(['.', '[', ']']).filter(|step| !step.is_empty())
}

/// serde says what it expected in words; put them into the error's fields.
fn explain(file: &str, path: &str, message: &str) -> SettingsError {
    let mut names = message.split('`').skip(1).step_by(2).map(str::to_owned);
    if message.starts_with("unknown field") {
        let name = names.next().unwrap_or_default();
        let allowed: Vec<String> = names.collect();
        let nearest = nearest(&name, allowed.iter().map(String::as_str));
        // Inside tagged tables the path ends at the table.
        let key = if path == name || path.ends_with(&format!(".{name}")) {
            path.to_owned()
        } else {
            join(path, &name)
        };
        return SettingsError::UnknownKey {
            file: file.to_owned(),
            key,
            allowed,
            nearest,
        };
    }
    let (key, message) = if message.starts_with("missing field") {
        let name = names.next().unwrap_or_default();
        (join(path, &name), "missing; it has no default".to_owned())
    } else {
        let key = if path.is_empty() {
            "(top level)".to_owned()
        } else {
            path.to_owned()
        };
        let wanted = names.next().unwrap_or_default();
        let hint = if message.starts_with("unknown variant") {
            nearest(
                &wanted,
                names.collect::<Vec<_>>().iter().map(String::as_str),
            )
        } else {
            None
        };
        let hint = hint
            .map(|name| format!(" (did you mean `{name}`?)"))
            .unwrap_or_default();
        (key, format!("{message}{hint}"))
    };
    SettingsError::Shape {
        file: file.to_owned(),
        key,
        message,
    }
}

fn refuse_not_finite(value: &Value, path: &str, file: &str) -> Result<(), SettingsError> {
    match value {
        Value::Float(number) if !number.is_finite() => Err(SettingsError::Value {
            file: file.to_owned(),
            key: path.to_owned(),
            value: number.to_string(),
            allowed: "it must be a finite number".to_owned(),
        }),
        Value::Array(items) => items.iter().enumerate().try_for_each(|(index, item)| {
            refuse_not_finite(item, &format!("{path}[{index}]"), file)
        }),
        Value::Table(table) => table
            .iter()
            .try_for_each(|(key, item)| refuse_not_finite(item, &join(path, key), file)),
        _ => Ok(()),
    }
}

/// `path.key`.
pub fn join(path: &str, key: &str) -> String {
    if path.is_empty() {
        key.to_owned()
    } else {
        format!("{path}.{key}")
    }
}
