//! Keys of settings files that were renamed or removed: an old key is rejected with the new one, or with what to do
//! instead.

use std::sync::LazyLock;

use toml::{Table, Value};

use super::error::SettingsError;
use super::read::join;

/// Old and new names, which the Python package uses too.
const RENAMED: &str = include_str!("../../../../python/access_av/tables/renamed.toml");

/// Pairs of texts.
type Pairs = Vec<(String, String)>;

/// Old and new keys, each as the end of a dotted path.
static KEYS: LazyLock<Pairs> = LazyLock::new(|| pairs("keys"));

/// Removed keys, each as the end of a dotted path, and their replacements.
static REMOVED_KEYS: LazyLock<Pairs> = LazyLock::new(|| pairs("removed_keys"));

fn pairs(table: &str) -> Pairs {
    let names = RENAMED.parse::<Table>().unwrap_or_default();
    let keys = names.get(table).and_then(Value::as_table);
    let pairs = keys.into_iter().flatten();
    pairs
        .filter_map(|(old, new)| Some((old.clone(), new.as_str()?.to_owned())))
        .collect()
}

/// Rejects a table that contains an old or removed key.
///
/// # Errors
/// [`SettingsError::RenamedKey`] and [`SettingsError::RemovedKey`].
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
        if let Some((_, instead)) = found(&REMOVED_KEYS, &path) {
            let instead = instead.to_owned();
            return Err(SettingsError::RemovedKey {
                file: file.to_owned(),
                key: path,
                instead,
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
    found(&KEYS, path).map(|(parents, new)| format!("{parents}{new}"))
}

/// Returns the parents of the key that ends a path, with the last dot, and the text of this key.
fn found<'a>(keys: &'a [(String, String)], path: &'a str) -> Option<(&'a str, &'a str)> {
    keys.iter().find_map(|(old, text)| {
        let parents = path.strip_suffix(old.as_str())?;
        let is_whole = parents.is_empty() || parents.ends_with('.');
        is_whole.then_some((parents, text.as_str()))
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
    fn every_removed_key_is_rejected_with_what_to_do_instead() {
        assert!(REMOVED_KEYS.len() > 10, "{}", REMOVED_KEYS.len());
        for (old, instead) in REMOVED_KEYS.iter() {
            let message = refuse_renamed(&only(&format!("truth.vehicle.{old}")), "", "mine.toml")
                .unwrap_err()
                .to_string();
            let expected =
                format!("mine.toml: `truth.vehicle.{old}` was removed in version 0.2.0: {instead}");
            assert_eq!(message, expected);
        }
    }

    #[test]
    fn current_keys_with_the_ending_of_an_old_key_are_accepted() {
        for path in ["motion.bound_m", "dislike", "my_wake_up.due", "overdue"] {
            refuse_renamed(&only(path), "", "mine.toml").unwrap();
        }
    }
}
