//! Text files of a bounded size.

use std::fs;
use std::io;
use std::path::Path;

use onboard::settings::SettingsError;

/// Reads a regular file of at most so many bytes.
///
/// # Errors
/// [`SettingsError::Read`].
pub fn read_text(path: &Path, most_bytes: u64) -> Result<String, SettingsError> {
    let read = || {
        let about = fs::metadata(path)?;
        if !about.is_file() {
            return Err(io::Error::other("not a regular file"));
        }
        if about.len() > most_bytes {
            let message = format!("{} bytes; at most {most_bytes} are read", about.len());
            return Err(io::Error::other(message));
        }
        fs::read_to_string(path)
    };
    read().map_err(|source| SettingsError::Read {
        file: path.display().to_string(),
        source,
    })
}
