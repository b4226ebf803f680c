//! File access: reads regular files of limited size, and writes complete files.

use std::fs::{self, File};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

use crate::error::RecordingError;

/// Maximum size of a file that is read as a whole: tables, logs, trajectories, metadata of recordings.
pub const MAX_BYTES: u64 = 512 << 20;

/// Opens a regular file. Pipes and devices are rejected because they have no reliable end.
///
/// # Errors
/// Error of the file system, or an error for a file that is not regular.
pub fn open(path: &Path) -> io::Result<File> {
    // The check precedes the opening, because opening a pipe may block forever.
    if !fs::metadata(path)?.is_file() {
        return Err(io::Error::other("not a regular file"));
    }
    File::open(path)
}

/// Reads a regular file with a maximum size.
///
/// # Errors
/// Errors of [`open`]; an error for a longer file.
pub fn read(path: &Path, max_bytes: u64) -> io::Result<Vec<u8>> {
    let file = open(path)?;
    if file.metadata()?.len() > max_bytes {
        let message = format!("longer than {max_bytes} bytes, the limit for this kind of file");
        return Err(io::Error::other(message));
    }
    let mut bytes = Vec::new();
    // The file may grow.
    file.take(max_bytes).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// File that is written under a temporary name and renamed when it is complete, or removed.
#[derive(Debug)]
pub struct Partial {
    path: PathBuf,
    target: PathBuf,
}

impl Partial {
    /// Creates the temporary file for `target`.
    ///
    /// # Errors
    /// [`RecordingError::Io`].
    pub fn create(target: &Path) -> Result<(Self, File), RecordingError> {
        let name = target.file_name().unwrap_or_default().to_string_lossy();
        let path = target.with_file_name(format!(".{name}.partial"));
        let file = File::create(&path).map_err(|source| RecordingError::io(target, source))?;
        let target = target.to_owned();
        Ok((Self { path, target }, file))
    }

    /// Renames the file to its target.
    ///
    /// # Errors
    /// [`RecordingError::Io`].
    pub fn finish(self) -> Result<(), RecordingError> {
        fs::rename(&self.path, &self.target)
            .map_err(|source| RecordingError::io(&self.target, source))
    }
}

impl Drop for Partial {
    fn drop(&mut self) {
        // After `finish`, the temporary file does not exist.
        let _ = fs::remove_file(&self.path);
    }
}

/// Writes a complete file.
///
/// # Errors
/// [`RecordingError::Io`].
pub fn write(target: &Path, bytes: &[u8]) -> Result<(), RecordingError> {
    let (partial, mut file) = Partial::create(target)?;
    file.write_all(bytes)
        .map_err(|source| RecordingError::io(target, source))?;
    partial.finish()
}
