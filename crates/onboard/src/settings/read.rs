//! Conversion of TOML text to settings, with errors that name the key.

use serde::de::DeserializeOwned;
use serde_path_to_error::Segment;
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
            message: {
                let at = error.span().map_or(0, |span| span.start);
                format!("{}{}", error.to_string().trim_end(), comma_hint(text, at))
            },
        })
}

/// Returns a hint if the line of a syntax error contains a decimal comma, as in `speed = 3,5`.
fn comma_hint(text: &str, at: usize) -> String {
    let start = text
        .get(..at)
        .and_then(|it| it.rfind('\n'))
        .map_or(0, |it| it + 1);
    let line = text
        .get(start..)
        .and_then(|it| it.lines().next())
        .unwrap_or_default();
    let mut values = line.split('=').skip(1).map(str::trim_start);
    let comma = |value: &str| {
        let is_number = |sign: char| sign.is_ascii_digit() || "+-,".contains(sign);
        let number = value
            .split(|sign| !is_number(sign))
            .next()
            .unwrap_or_default();
        with_point(number.trim_end_matches(','))
    };
    let found = values.find_map(comma);
    found.map(|hint| format!("\n{hint}")).unwrap_or_default()
}

/// Returns the hint for a number with a decimal comma, or an empty string.
fn with_point(number: &str) -> Option<String> {
    let point = number.replacen(',', ".", 1);
    let is_number = number.contains(',') && point.parse::<f64>().is_ok();
    is_number.then(|| format!("numbers take a decimal point: write {point}, not {number}"))
}

/// Converts a parsed table to settings.
///
/// # Errors
/// [`SettingsError`] naming the key.
pub fn from_table<T: DeserializeOwned>(table: Table, file: &str) -> Result<T, SettingsError> {
    let value = Value::Table(table);
    refuse_not_finite(&value, "", file)?;
    read::<T>(&value).map_err(|defect| {
        let path = written(&precise_path::<T>(&value, &defect));
        explain(file, &path, &defect.message)
    })
}

/// Error of serde, and its location as far as known.
struct Defect {
    path: Vec<Step>,
    message: String,
}

/// Step of a path: a table key or a list index.
#[derive(Clone)]
enum Step {
    Key(String),
    Index(usize),
}

/// Maximum number of keys of a table that is searched for the invalid key.
const MAX_KEYS: usize = 200;

fn read<T: DeserializeOwned>(value: &Value) -> Result<T, Defect> {
    serde_path_to_error::deserialize(value.clone()).map_err(|error| Defect {
        path: error.path().iter().map_while(step).collect(),
        // The TOML reader appends a less precise path on a second line.
        message: (error.inner().to_string().lines().next())
            .unwrap_or_default()
            .to_owned(),
    })
}

fn step(segment: &Segment) -> Option<Step> {
    match segment {
        Segment::Seq { index } => Some(Step::Index(*index)),
        Segment::Map { key } | Segment::Enum { variant: key } => Some(Step::Key(key.clone())),
        Segment::Unknown => None,
    }
}

/// Returns the path of the invalid key. serde's path ends at a table with a tag, because serde
/// buffers the whole table. The invalid key is the one whose removal changes the error.
fn precise_path<T: DeserializeOwned>(value: &Value, defect: &Defect) -> Vec<Step> {
    let mut path = defect.path.clone();
    while let Some(Value::Table(table)) = at(value, &path) {
        if table.len() > MAX_KEYS {
            break;
        }
        let gone = |key: &&String| match read::<T>(&without(value, &path, key)) {
            Ok(_) => true,
            Err(other) => {
                other.message != defect.message && !other.message.starts_with("missing field")
            }
        };
        let Some(offender) = table.keys().find(gone) else {
            break;
        };
        path.push(Step::Key(offender.clone()));
    }
    path
}

fn at<'a>(value: &'a Value, path: &[Step]) -> Option<&'a Value> {
    path.iter().try_fold(value, |here, step| match step {
        Step::Index(index) => here.get(*index),
        Step::Key(key) => here.get(key),
    })
}

fn without(value: &Value, path: &[Step], key: &str) -> Value {
    let mut copy = value.clone();
    let table = path.iter().try_fold(&mut copy, |here, step| match step {
        Step::Index(index) => here.get_mut(*index),
        Step::Key(key) => here.get_mut(key),
    });
    if let Some(table) = table.and_then(Value::as_table_mut) {
        table.remove(key);
    }
    copy
}

/// Returns a path in the form `radio_heads[0].pci`.
fn written(path: &[Step]) -> String {
    path.iter().fold(String::new(), |path, step| match step {
        Step::Index(index) => format!("{path}[{index}]"),
        Step::Key(key) => join(&path, key),
    })
}

/// Converts serde's message to the fields of the error.
fn explain(file: &str, path: &str, message: &str) -> SettingsError {
    let mut names = message.split('`').skip(1).step_by(2).map(str::to_owned);
    if message.starts_with("unknown field") {
        let name = names.next().unwrap_or_default();
        let allowed: Vec<String> = names.collect();
        let nearest = nearest(&name, allowed.iter().map(String::as_str));
        // Inside a tagged table the path ends at the table.
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
        (key, format!("{message}{hint}{}", number_hint(message)))
    };
    SettingsError::Shape {
        file: file.to_owned(),
        key,
        message,
    }
}

/// Returns a hint if a list has too many commas, or a number is in quotes.
fn number_hint(message: &str) -> String {
    let hint = if message.starts_with("invalid length") {
        Some("numbers take a decimal point: write 3.5, not 3,5".to_owned())
    } else {
        let quoted = message.strip_prefix("invalid type: string \"");
        let number = quoted
            .and_then(|it| it.split('"').next())
            .unwrap_or_default();
        let in_quotes = || format!("write {number} without quotes");
        with_point(number).or_else(|| number.parse::<f64>().ok().map(|_| in_quotes()))
    };
    hint.map(|hint| format!("; {hint}")).unwrap_or_default()
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

/// Returns `path.key`.
pub fn join(path: &str, key: &str) -> String {
    if path.is_empty() {
        key.to_owned()
    } else {
        format!("{path}.{key}")
    }
}
