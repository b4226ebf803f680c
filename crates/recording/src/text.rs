//! Text files of limited size.

use std::io;
use std::path::Path;

use onboard::settings::SettingsError;

use crate::file;

/// Reads a regular text file with a maximum size.
///
/// # Errors
/// [`SettingsError::Read`].
pub fn read_text(path: &Path, max_bytes: u64) -> Result<String, SettingsError> {
    let text = file::read(path, max_bytes).and_then(|bytes| {
        let not_utf8 = |_| io::Error::new(io::ErrorKind::InvalidData, "not UTF-8 text");
        String::from_utf8(bytes).map_err(not_utf8)
    });
    text.map_err(|source| SettingsError::Read {
        file: path.display().to_string(),
        source,
    })
}
