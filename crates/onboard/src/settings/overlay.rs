//! Overriding keys: `extends` files, overrides, and the truth of a simulation.

use toml::{Table, Value};

use super::check::Check;
use super::error::SettingsError;

/// Tags that determine the other keys of their table.
const TAGS: [&str; 2] = ["policy", "kind"];

/// Applies the keys of `over` to `base`: tables key by key, other values as a whole. A tag that
/// changes removes the keys of the previous variant. If `base` has a list of named tables, a table
/// in `over` refers to its entries by name, or to `all` of them.
///
/// # Errors
/// [`SettingsError::Value`] if the list has no entry of that name.
pub fn merge_table(
    base: &mut Table,
    over: Table,
    path: &str,
    check: Check<'_>,
) -> Result<(), SettingsError> {
    if TAGS
        .iter()
        .any(|tag| matches!((base.get(*tag), over.get(*tag)), (Some(a), Some(b)) if a != b))
    {
        base.clear();
    }
    for (key, value) in over {
        let path = super::read::join(path, &key);
        match (base.get_mut(&key), value) {
            (Some(Value::Table(below)), Value::Table(value)) => {
                merge_table(below, value, &path, check)?;
            }
            (Some(Value::Array(entries)), Value::Table(by_name)) => {
                for (name, value) in by_name {
                    merge_entries(entries, &name, &value, &path, check)?;
                }
            }
            // The base is the name of a file: override keys of that file.
            (Some(Value::String(name)), Value::Table(mut value)) => {
                let name = Value::String(name.clone());
                value.entry("extends").or_insert(name);
                base.insert(key, Value::Table(value));
            }
            (_, value) => {
                base.insert(key, value);
            }
        }
    }
    Ok(())
}

fn merge_entries(
    entries: &mut [Value],
    name: &str,
    value: &Value,
    path: &str,
    check: Check<'_>,
) -> Result<(), SettingsError> {
    let path = super::read::join(path, name);
    let Value::Table(value) = value else {
        return Err(check.error(&path, value, "it must be a table of the entry's keys"));
    };
    let mut met = false;
    for entry in entries.iter_mut().filter_map(Value::as_table_mut) {
        if name == "all" || entry.get("name").and_then(Value::as_str) == Some(name) {
            met = true;
            merge_table(entry, value.clone(), &path, check)?;
        }
    }
    let names: Vec<&str> = entries
        .iter()
        .filter_map(|entry| entry.get("name")?.as_str())
        .collect();
    let allowed = format!("the entries are named {}, or all", names.join(", "));
    check.that(met, &path, "unknown", &allowed)
}

/// Sets the value at a dotted path (`channel.rician_k_db`, `site.radio_heads[0].eirp_dbm`).
///
/// If the path ends in a tag (`wake_up.policy`) whose value changes, the keys of the previous
/// variant are removed.
///
/// # Errors
/// [`SettingsError::Shape`] if the path does not exist.
pub fn set(table: &mut Table, path: &str, value: Value, file: &str) -> Result<(), SettingsError> {
    let missing_key = || SettingsError::Shape {
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
            Some((name, index)) => (
                name,
                Some(index.parse::<usize>().map_err(|_| missing_key())?),
            ),
            None => (step, None),
        };
        let entry = here
            .entry(name)
            .or_insert_with(|| Value::Table(Table::new()));
        let entry = match index {
            Some(index) => entry.as_array_mut().and_then(|items| items.get_mut(index)),
            None => Some(entry),
        };
        here = entry
            .and_then(Value::as_table_mut)
            .ok_or_else(missing_key)?;
    }
    if TAGS.contains(&key) && here.get(key) != Some(&value) {
        here.clear();
    }
    here.insert(key.to_owned(), value);
    Ok(())
}

/// Whether a path ends in a tag. Overrides of tags are applied before those of other keys.
pub fn ends_in_tag(path: &str) -> bool {
    TAGS.contains(&path.rsplit_once('.').map_or(path, |(_, key)| key))
}
