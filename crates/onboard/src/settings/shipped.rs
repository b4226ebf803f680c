//! Library of the files that are part of the product.

use super::error::SettingsError;
use super::toml_file::{Library, NamedText};

/// Shipped files by name; no other files are opened.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Shipped;

impl Library for Shipped {
    fn text(
        &self,
        what: &'static str,
        shipped: &[(&'static str, &'static str)],
        name: &str,
        _beside: &str,
    ) -> Result<NamedText, SettingsError> {
        let found = shipped.iter().find(|it| it.0 == name);
        found
            .map(|&(name, text)| NamedText {
                origin: name.to_owned(),
                text: text.to_owned(),
            })
            .ok_or_else(|| {
                SettingsError::unknown_name(what, name, shipped.iter().map(|(name, _)| *name))
            })
    }

    fn points_m(&self, name: &str, referrer: &str) -> Result<Vec<[f64; 2]>, SettingsError> {
        Err(SettingsError::Value {
            file: referrer.to_owned(),
            key: "road.file".to_owned(),
            value: format!("{name:?}"),
            allowed: "no file is opened here; give the points as `polyline_m`".to_owned(),
        })
    }
}
