//! A kind of settings file: read, checked, changed and written in one way.

use std::any::type_name;
use std::collections::HashMap;
use std::sync::{Mutex, PoisonError};

use schemars::JsonSchema;
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value as Json;
use toml::{Table, Value};

use super::check::Check;
use super::error::SettingsError;
use super::limits::check_limits;
use super::overlay::{ends_in_tag, lay_over, set};
use super::read::{from_table, parse};

/// Files that are `like` one another must end somewhere.
const MOST_LIKES: usize = 8;

/// A file's text and what errors call it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NamedText {
    /// Its path, or the shipped name.
    pub origin: String,
    /// Its TOML.
    pub text: String,
}

/// Where the files come from that others name. What runs on the vehicle opens none by itself.
pub trait Library {
    /// The file `name` of a kind, as named in the file `beside`.
    ///
    /// # Errors
    /// [`SettingsError`] where there is none, or it cannot be read.
    fn text(
        &self,
        what: &'static str,
        shipped: &[(&'static str, &'static str)],
        name: &str,
        beside: &str,
    ) -> Result<NamedText, SettingsError>;

    /// Points of a survey file, as named in the file `beside`.
    ///
    /// # Errors
    /// [`SettingsError`] where there is none, or it cannot be read.
    fn points_m(&self, name: &str, beside: &str) -> Result<Vec<[f64; 2]>, SettingsError>;

    /// The whole path of a file that the file `beside` names and that nobody here opens; as it was
    /// named where there is no file system.
    fn path(&self, name: &str, _beside: &str) -> String {
        name.to_owned()
    }
}

/// A kind of settings file. Any of them may say `like = "another"` and lay its own keys over those
/// of that other file.
pub trait TomlFile: Serialize + DeserializeOwned + JsonSchema {
    /// What errors call it: "site".
    const WHAT: &'static str;
    /// Names and texts of those that come with the product.
    const SHIPPED: &'static [(&'static str, &'static str)];

    /// Its short name.
    fn name(&self) -> &str;

    /// Refuses values that contradict each other.
    ///
    /// # Errors
    /// [`SettingsError::Value`] naming the key and what is allowed.
    fn check(&self, check: Check<'_>) -> Result<(), SettingsError>;

    /// Puts in place what the file only names.
    ///
    /// # Errors
    /// [`SettingsError`] where the library has it not.
    fn resolve(
        _table: &mut Table,
        _origin: &str,
        _library: &dyn Library,
    ) -> Result<(), SettingsError> {
        Ok(())
    }

    /// Names of the shipped ones.
    fn names() -> impl Iterator<Item = &'static str> + Clone {
        Self::SHIPPED.iter().map(|(name, _)| *name)
    }

    /// The file of this name in a library.
    ///
    /// # Errors
    /// [`SettingsError`] when there is none, or when what there is cannot be used.
    fn from_library(name: &str, library: &dyn Library) -> Result<Self, SettingsError> {
        let named = library.text(Self::WHAT, Self::SHIPPED, name, "")?;
        Self::from_toml(&named.text, &named.origin, library)
    }

    /// Reads TOML. `origin` is the file that errors name, and beside which other files lie.
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
        take_after_likes::<Self>(&mut table, origin, library)?;
        Self::resolve(&mut table, origin, library)?;
        let settings: Self = from_table(table, origin)?;
        let json = serde_json::to_value(&settings).unwrap_or_default();
        check_limits(&json, &schema::<Self>(), check)?;
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

    /// This with single keys set: `("array.elements", 5)`, `("radio_heads[0].eirp_dbm", 0.0)`.
    /// Setting a table replaces it whole; setting a tag (`wake_up.policy`, `localizer.kind`) to
    /// another variant drops the old one's keys.
    ///
    /// # Errors
    /// [`SettingsError`] as for a file.
    fn with_overrides<'a>(
        &self,
        overrides: impl IntoIterator<Item = (&'a str, Value)>,
        library: &dyn Library,
    ) -> Result<Self, SettingsError> {
        let origin = format!("{} with overrides", self.name());
        let mut table = parse(&self.to_toml(), &origin)?;
        let mut overrides: Vec<_> = overrides.into_iter().collect();
        overrides.sort_by_key(|(path, _)| !ends_in_tag(path));
        for (path, value) in overrides {
            set(&mut table, path, value, &origin)?;
        }
        Self::from_table(table, &origin, library)
    }

    /// TOML with every default written out.
    fn to_toml(&self) -> String {
        // Checked settings hold finite numbers, strings and tables: all of them valid TOML.
        toml::to_string_pretty(self).unwrap_or_default()
    }

    /// JSON with every default written out.
    fn to_json(&self) -> String {
        serde_json::to_string_pretty(self).unwrap_or_default()
    }

    /// The JSON Schema of such a file.
    fn schema_json() -> String {
        serde_json::to_string_pretty(&schema::<Self>()).unwrap_or_default()
    }
}

/// Names become names of files and parts of pages.
fn is_usable_name(name: &str) -> bool {
    let allowed = |sign: char| sign.is_alphanumeric() || ['.', '-', '_', ' '].contains(&sign);
    name.chars().count() <= 64
        && name.chars().all(allowed)
        && name.starts_with(|first: char| first.is_alphanumeric())
        && !name.ends_with(' ')
}

/// Lays a table over the file that it says it is like.
fn take_after_likes<T: TomlFile>(
    table: &mut Table,
    origin: &str,
    library: &dyn Library,
) -> Result<(), SettingsError> {
    let mut beside = origin.to_owned();
    for _ in 0..MOST_LIKES {
        let check = Check { file: &beside };
        let name = match table.remove("like") {
            None => return Ok(()),
            Some(Value::String(name)) => name,
            Some(other) => {
                return Err(check.error("like", other, "it must be the name of a file"));
            }
        };
        let base = library.text(T::WHAT, T::SHIPPED, &name, &beside);
        let base = base.map_err(|error| error.beneath(&beside, "like"))?;
        let mut laid = parse(&base.text, &base.origin)?;
        lay_over(&mut laid, std::mem::take(table), "", check)?;
        *table = laid;
        beside = base.origin;
    }
    let allowed = format!("at most {MOST_LIKES} files may be like one another in a row");
    Err(Check { file: origin }.error("like", "endless", &allowed))
}

/// The schema of a type, made once.
fn schema<T: JsonSchema>() -> Json {
    static MADE: Mutex<Option<HashMap<&'static str, Json>>> = Mutex::new(None);
    let mut made = MADE.lock().unwrap_or_else(PoisonError::into_inner);
    made.get_or_insert_default()
        .entry(type_name::<T>())
        .or_insert_with(|| with_like(schemars::schema_for!(T).to_value()))
        .clone()
}

/// Files may say what they are like; their types need not know.
fn with_like(mut schema: Json) -> Json {
    let like = serde_json::json!({
        "type": "string",
        "description": "A shipped name, or a path: this file's keys are laid over that one's.",
    });
    if let Some(properties) = schema.get_mut("properties").and_then(Json::as_object_mut) {
        properties.insert("like".to_owned(), like.clone());
    }
    for held in ["Site", "Vehicle"] {
        let held = schema.pointer_mut(&format!("/$defs/{held}/properties"));
        if let Some(properties) = held.and_then(Json::as_object_mut) {
            properties.insert("like".to_owned(), like.clone());
        }
    }
    schema
}
