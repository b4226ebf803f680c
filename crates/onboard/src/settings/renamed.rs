//! Keys of settings files that were renamed: an old key is rejected with the new one.

use std::sync::LazyLock;

use toml::{Table, Value};

use super::error::SettingsError;
use super::read::join;

/// Old and new names, which the Python package uses too.
const RENAMED: &str = include_str!("../../../../python/access_av/tables/renamed.toml");

/// Old and new keys, each as the end of a dotted path.
static KEYS: LazyLock<Vec<(String, String)>> = LazyLock::new(|| {
    let names = RENAMED.parse::<Table>().unwrap_or_default();
    let keys = names.get("keys").and_then(Value::as_table);
    let pairs = keys.into_iter().flatten();
    pairs
        .filter_map(|(old, new)| Some((old.clone(), new.as_str()?.to_owned())))
        .collect()
});

/// Rejects a table that contains an old key.
///
/// # Errors
/// [`SettingsError::RenamedKey`].
pub fn refuse_renamed(table: &Table, path: &str, file: &str) -> Result<(), SettingsError> {
    for (key, value) in table {
        let path = join(path, key);
        if let Some(new) = new_path(&path) {
            return Err(SettingsError::RenamedKey {
                file: file.to_owned(),
                key: path,
                new,
            });
        }
        refuse_in(value, &path, file)?;
    }
    Ok(())
}

fn refuse_in(value: &Value, path: &str, file: &str) -> Result<(), SettingsError> {
    match value {
        Value::Table(table) => refuse_renamed(table, path, file),
        Value::Array(items) => items
            .iter()
            .enumerate()
            .try_for_each(|(index, item)| refuse_in(item, &format!("{path}[{index}]"), file)),
        _ => Ok(()),
    }
}

/// Returns the new path of an old key; `None` if the key was not renamed.
fn new_path(path: &str) -> Option<String> {
    KEYS.iter().find_map(|(old, new)| {
        let parents = path.strip_suffix(old.as_str())?;
        let is_whole = parents.is_empty() || parents.ends_with('.');
        is_whole.then(|| format!("{parents}{new}"))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns a table that contains only the key at a dotted path.
    fn only(path: &str) -> Table {
        let mut steps = path.rsplit('.');
        let last = steps.next().unwrap().to_owned();
        let innermost = Table::from_iter([(last, Value::Integer(1))]);
        steps.fold(innermost, |table, step| {
            Table::from_iter([(step.to_owned(), Value::Table(table))])
        })
    }

    #[test]
    fn every_old_key_is_rejected_with_the_new_key() {
        assert!(KEYS.len() > 10, "{}", KEYS.len());
        for (old, new) in KEYS.iter() {
            for parents in ["", "vehicle.", "truth.vehicle."] {
                let table = only(&format!("{parents}{old}"));
                let message = refuse_renamed(&table, "", "mine.toml")
                    .unwrap_err()
                    .to_string();
                let expected = format!(
                    "mine.toml: `{parents}{old}` was renamed in version 0.2.0: write \
                     `{parents}{new}`"
                );
                assert_eq!(message, expected);
            }
            refuse_renamed(&only(new), "", "mine.toml").unwrap();
        }
    }

    #[test]
    fn current_keys_with_the_ending_of_an_old_key_are_accepted() {
        for path in ["motion.bound_m", "dislike", "my_wake_up.due", "overdue"] {
            refuse_renamed(&only(path), "", "mine.toml").unwrap();
        }
    }
}
