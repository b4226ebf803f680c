//! Settings files: one way to read, check, modify and write them.

use std::sync::OnceLock;

use schemars::JsonSchema;
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value as Json;
use toml::{Table, Value};

use super::check::Check;
use super::error::SettingsError;
use super::limits::check_limits;
use super::overlay::{ends_in_tag, merge_table, set};
use super::read::{from_table, parse};
use super::renamed::refuse_renamed;

/// Maximum length of a chain of `extends` keys.
const MAX_EXTENDS: usize = 8;

/// Text of a file, and its name for error messages.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NamedText {
    /// Path of the file, or name of the shipped file.
    pub origin: String,
    /// TOML text.
    pub text: String,
}

/// Source of the files that other files name. Code on the vehicle opens no files itself.
pub trait Library {
    /// Returns the file `name` of this kind, as named in the file `referrer`.
    ///
    /// # Errors
    /// [`SettingsError`] if the file does not exist or cannot be read.
    fn text(
        &self,
        what: &'static str,
        shipped: &[(&'static str, &'static str)],
        name: &str,
        referrer: &str,
    ) -> Result<NamedText, SettingsError>;

    /// Returns the points of a survey file, as named in the file `referrer`.
    ///
    /// # Errors
    /// [`SettingsError`] if the file does not exist or cannot be read.
    fn points_m(&self, name: &str, referrer: &str) -> Result<Vec<[f64; 2]>, SettingsError>;

    /// Returns the full path of a file that is named in the file `referrer` and is not opened here.
    /// Without a file system, the name is returned unchanged.
    fn path(&self, name: &str, _referrer: &str) -> String {
        name.to_owned()
    }
}

/// Conversions of a settings type from and to text.
///
/// They are functions of a static of the type's crate. As generic methods, they would be compiled again in every crate
/// that reads or writes such a file, which takes minutes.
pub struct TomlFormat<T> {
    read: fn(Table, &str) -> Result<T, SettingsError>,
    to_toml: fn(&T) -> String,
    to_json: fn(&T) -> String,
    to_value: fn(&T) -> Json,
    to_table: fn(&T) -> Table,
    make_schema: fn() -> Json,
    schema: OnceLock<Json>,
}

impl<T: Serialize + DeserializeOwned + JsonSchema> TomlFormat<T> {
    /// Returns the conversions by serde and schemars.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            read: from_table,
            // Checked settings contain finite numbers, strings and tables only, which are valid TOML.
            to_toml: |settings| toml::to_string_pretty(settings).unwrap_or_default(),
            to_json: |settings| serde_json::to_string_pretty(settings).unwrap_or_default(),
            to_value: |settings| serde_json::to_value(settings).unwrap_or_default(),
            to_table: |settings| Table::try_from(settings).unwrap_or_default(),
            make_schema: || with_extends(schemars::schema_for!(T).to_value()),
            schema: OnceLock::new(),
        }
    }
}

impl<T: Serialize + DeserializeOwned + JsonSchema> Default for TomlFormat<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T> TomlFormat<T> {
    fn schema(&self) -> &Json {
        self.schema.get_or_init(self.make_schema)
    }
}

/// Kind of settings file. A file with `extends = "another"` overrides keys of that other file.
pub trait TomlFile: Sized + 'static {
    /// Name of this kind of file in error messages, such as "site".
    const WHAT: &'static str;
    /// Names and texts of the shipped files.
    const SHIPPED: &'static [(&'static str, &'static str)];

    /// Returns the conversions of the type, a static.
    fn format() -> &'static TomlFormat<Self>;

    /// Returns the short name of the file.
    fn name(&self) -> &str;

    /// Returns an error if values contradict each other.
    ///
    /// # Errors
    /// [`SettingsError::Value`] naming the key and what is allowed.
    fn check(&self, check: Check<'_>) -> Result<(), SettingsError>;

    /// Replaces references to other files by their contents.
    ///
    /// # Errors
    /// [`SettingsError`] if the library does not contain the file.
    fn resolve(
        _table: &mut Table,
        _origin: &str,
        _library: &dyn Library,
    ) -> Result<(), SettingsError> {
        Ok(())
    }

    /// Returns the names of the shipped files.
    fn names() -> impl Iterator<Item = &'static str> + Clone {
        Self::SHIPPED.iter().map(|(name, _)| *name)
    }

    /// Returns the file of this name from a library.
    ///
    /// # Errors
    /// [`SettingsError`] if the file does not exist or is invalid.
    fn from_library(name: &str, library: &dyn Library) -> Result<Self, SettingsError> {
        let named = library.text(Self::WHAT, Self::SHIPPED, name, "")?;
        Self::from_toml(&named.text, &named.origin, library)
    }

    /// Parses TOML. `origin` is the name of the file in errors; relative paths start at its folder.
    ///
    /// # Errors
    /// [`SettingsError`] naming the key and what is allowed.
    fn from_toml(text: &str, origin: &str, library: &dyn Library) -> Result<Self, SettingsError> {
        Self::from_table(parse(text, origin)?, origin, library)
    }

    /// Reads a parsed table.
    ///
    /// # Errors
    /// [`SettingsError`] naming the key and what is allowed.
    fn from_table(
        mut table: Table,
        origin: &str,
        library: &dyn Library,
    ) -> Result<Self, SettingsError> {
        let check = Check { file: origin };
        apply_extends::<Self>(&mut table, origin, library)?;
        Self::resolve(&mut table, origin, library)?;
        let format = Self::format();
        let settings = (format.read)(table, origin)?;
        check_limits(&(format.to_value)(&settings), format.schema(), check)?;
        let name = settings.name();
        check.that(
            is_usable_name(name),
            "name",
            format!("{name:?}"),
            "it must be of 1 to 64 letters, digits, `.`, `-`, `_` and blanks, and begin with a \
             letter or digit",
        )?;
        settings.check(check)?;
        Ok(settings)
    }

    /// Returns the keys that a file contains, with those of the files that it extends, without defaults.
    ///
    /// # Errors
    /// [`SettingsError`] if a file that it extends cannot be read.
    fn stated_keys(
        mut table: Table,
        origin: &str,
        library: &dyn Library,
    ) -> Result<Table, SettingsError> {
        apply_extends::<Self>(&mut table, origin, library)?;
        Ok(table)
    }

    /// Returns a copy with modified keys, such as `("array.elements", 5)` or
    /// `("radio_heads[0].eirp_dbm", 0.0)`. A table is replaced as a whole. If a tag
    /// (`wake_up.policy`, `localizer.kind`) changes, the keys of the previous variant are removed.
    ///
    /// # Errors
    /// [`SettingsError`], like those of a file.
    fn with_overrides<'a>(
        &self,
        overrides: impl IntoIterator<Item = (&'a str, Value)>,
        library: &dyn Library,
    ) -> Result<Self, SettingsError> {
        let origin = format!("{} with overrides", self.name());
        let mut table = self.to_table();
        let mut overrides: Vec<_> = overrides.into_iter().collect();
        overrides.sort_by_key(|(path, _)| !ends_in_tag(path));
        for (path, value) in overrides {
            set(&mut table, path, value, &origin)?;
        }
        Self::from_table(table, &origin, library)
    }

    /// Returns TOML text with every default written out.
    fn to_toml(&self) -> String {
        (Self::format().to_toml)(self)
    }

    /// Returns a table with every default written out.
    fn to_table(&self) -> Table {
        (Self::format().to_table)(self)
    }

    /// Returns JSON text with every default written out.
    fn to_json(&self) -> String {
        (Self::format().to_json)(self)
    }

    /// Returns the JSON Schema of this kind of file.
    fn schema_json() -> String {
        serde_json::to_string_pretty(Self::format().schema()).unwrap_or_default()
    }
}

/// Whether a name is valid as a part of file names and pages.
fn is_usable_name(name: &str) -> bool {
    let allowed = |sign: char| sign.is_alphanumeric() || ['.', '-', '_', ' '].contains(&sign);
    name.chars().count() <= 64
        && name.chars().all(allowed)
        && name.starts_with(|first: char| first.is_alphanumeric())
        && !name.ends_with(' ')
}

/// Applies a table as an override to the file that its `extends` key names.
fn apply_extends<T: TomlFile>(
    table: &mut Table,
    origin: &str,
    library: &dyn Library,
) -> Result<(), SettingsError> {
    refuse_renamed(table, "", origin)?;
    let mut referrer = origin.to_owned();
    for _ in 0..MAX_EXTENDS {
        let check = Check { file: &referrer };
        let name = match table.remove("extends") {
            None => return Ok(()),
            Some(Value::String(name)) => name,
            Some(other) => {
                return Err(check.error("extends", other, "it must be the name of a file"));
            }
        };
        let base = library.text(T::WHAT, T::SHIPPED, &name, &referrer);
        let base = base.map_err(|error| error.with_path_prefix(&referrer, "extends"))?;
        let mut merged = parse(&base.text, &base.origin)?;
        refuse_renamed(&merged, "", &base.origin)?;
        merge_table(&mut merged, std::mem::take(table), "", check)?;
        *table = merged;
        referrer = base.origin;
    }
    let allowed = format!("a chain of `extends` may contain at most {MAX_EXTENDS} files");
    Err(Check { file: origin }.error("extends", "endless", &allowed))
}

/// Adds the key `extends` to a schema; the types do not contain it.
fn with_extends(mut schema: Json) -> Json {
    let extends = serde_json::json!({
        "type": "string",
        "description": "Name of a shipped file, or path of a file. The keys of this file override its keys.",
    });
    if let Some(properties) = schema.get_mut("properties").and_then(Json::as_object_mut) {
        properties.insert("extends".to_owned(), extends.clone());
    }
    for held in ["Site", "Vehicle"] {
        let held = schema.pointer_mut(&format!("/$defs/{held}/properties"));
        if let Some(properties) = held.and_then(Json::as_object_mut) {
            properties.insert("extends".to_owned(), extends.clone());
        }
    }
    schema
}
