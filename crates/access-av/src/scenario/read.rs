//! From TOML text to checked settings, and overriding single keys.

use serde::de::DeserializeOwned;
use toml::{Table, Value};

use super::error::{ScenarioError, nearest};

/// Tags that decide which other keys their table may have.
const TAGS: [&str; 2] = ["policy", "kind"];

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
    serde_path_to_error::deserialize(value).map_err(|error| {
        let path = error.path().to_string();
        let message = error.inner().to_string();
        // The TOML reader adds the path on a second line, less precisely.
        let message = message.lines().next().unwrap_or_default();
        explain(file, if path == "." { "" } else { &path }, message)
    })
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
pub(crate) fn ends_in_tag(path: &str) -> bool {
    TAGS.contains(&path.rsplit_once('.').map_or(path, |(_, key)| key))
}

/// Sets the value at a dotted path (`channel.rician_k_db`, `radio_heads[0].tx_power_dbm`).
///
/// Where the path ends in a tag (`wake_up.policy`) whose value changes, the table's other keys
/// belonged to the old variant and are dropped.
pub(crate) fn set(
    table: &mut Table,
    path: &str,
    value: Value,
    file: &str,
) -> Result<(), ScenarioError> {
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
