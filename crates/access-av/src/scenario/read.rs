//! From TOML text to checked settings, and overriding single keys.

use std::fs;
use std::path::Path;

use serde::de::DeserializeOwned;
use toml::{Table, Value};

use super::error::{ScenarioError, nearest};

/// Tags that decide which other keys their table may have.
const TAGS: [&str; 2] = ["policy", "kind"];

/// Loads a shipped file of the kind `what` by its name, or else a file by its path.
pub(crate) fn load<T>(
    what: &'static str,
    shipped: &[(&'static str, &str)],
    name_or_path: &str,
    from_toml: fn(&str, &str) -> Result<T, ScenarioError>,
) -> Result<T, ScenarioError> {
    if let Some((name, text)) = shipped.iter().find(|it| it.0 == name_or_path) {
        return from_toml(text, name);
    }
    if !Path::new(name_or_path).exists() {
        let names = shipped.iter().map(|(name, _)| *name);
        return Err(ScenarioError::unknown_name(what, name_or_path, names));
    }
    let text = fs::read_to_string(name_or_path).map_err(|source| ScenarioError::Read {
        file: name_or_path.to_owned(),
        source,
    })?;
    from_toml(&text, name_or_path)
}

/// A file's text as a table with single keys set; tags first, which decide about the others.
pub(crate) fn overridden<'a>(
    text: &str,
    overrides: impl IntoIterator<Item = (&'a str, Value)>,
    file: &str,
) -> Result<Table, ScenarioError> {
    let mut table = parse(text, file)?;
    let mut overrides: Vec<_> = overrides.into_iter().collect();
    overrides.sort_by_key(|(path, _)| !ends_in_tag(path));
    for (path, value) in overrides {
        set(&mut table, path, value, file)?;
    }
    Ok(table)
}

/// Parses TOML into a table.
pub(crate) fn parse(text: &str, file: &str) -> Result<Table, ScenarioError> {
    text.parse::<Table>()
        .map_err(|error| ScenarioError::Syntax {
            file: file.to_owned(),
            message: error.to_string().trim_end().to_owned(),
        })
}

/// Turns a parsed table into settings.
pub(crate) fn settings<T: DeserializeOwned>(table: Table, file: &str) -> Result<T, ScenarioError> {
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
fn explain(file: &str, path: &str, message: &str) -> ScenarioError {
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
        return ScenarioError::UnknownKey {
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
    ScenarioError::Shape {
        file: file.to_owned(),
        key,
        message,
    }
}

fn refuse_not_finite(value: &Value, path: &str, file: &str) -> Result<(), ScenarioError> {
    match value {
        Value::Float(number) if !number.is_finite() => Err(ScenarioError::Value {
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

fn join(path: &str, key: &str) -> String {
    if path.is_empty() {
        key.to_owned()
    } else {
        format!("{path}.{key}")
    }
}

/// Whether a path names a tag.
fn ends_in_tag(path: &str) -> bool {
    TAGS.contains(&path.rsplit_once('.').map_or(path, |(_, key)| key))
}

/// Sets the value at a dotted path (`channel.rician_k_db`, `radio_heads[0].tx_power_dbm`).
///
/// Where the path ends in a tag (`wake_up.policy`) whose value changes, the table's other keys
/// belonged to the old variant and are dropped.
fn set(table: &mut Table, path: &str, value: Value, file: &str) -> Result<(), ScenarioError> {
    let no_such = || ScenarioError::Shape {
        file: file.to_owned(),
        key: path.to_owned(),
        message: "there is nothing at this path to override".to_owned(),
    };
    let (parents, key) = match path.rsplit_once('.') {
        Some((parents, key)) => (parents, key),
        None => ("", path),
    };
    let mut here = table;
    for step in parents.split('.').filter(|step| !step.is_empty()) {
        let (name, index) = match step.strip_suffix(']').and_then(|s| s.split_once('[')) {
            Some((name, index)) => (name, Some(index.parse::<usize>().map_err(|_| no_such())?)),
            None => (step, None),
        };
        let entry = here
            .entry(name)
            .or_insert_with(|| Value::Table(Table::new()));
        let entry = match index {
            Some(index) => entry.as_array_mut().and_then(|items| items.get_mut(index)),
            None => Some(entry),
        };
        here = entry.and_then(Value::as_table_mut).ok_or_else(no_such)?;
    }
    if TAGS.contains(&key) && here.get(key) != Some(&value) {
        here.clear();
    }
    here.insert(key.to_owned(), value);
    Ok(())
}
