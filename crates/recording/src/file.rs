//! Files in and out: regular ones of a bounded size in, whole ones out.

use std::fs::{self, File};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

use crate::error::RecordingError;

/// Opens a regular file; a pipe or a device has no end that could be relied on.
///
/// # Errors
/// What the file system says, or that it is no regular file.
pub fn open(path: &Path) -> io::Result<File> {
    // Asked before it is opened: that alone may wait for ever on a pipe.
    if !fs::metadata(path)?.is_file() {
        return Err(io::Error::other("not a regular file"));
    }
    File::open(path)
}

/// Reads a regular file of at most so many bytes.
///
/// # Errors
/// As [`open`], or that it is longer.
pub fn read(path: &Path, most_bytes: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    open(path)?.take(most_bytes + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > most_bytes {
        let message = format!("longer than the {most_bytes} bytes that are read of such a file");
        return Err(io::Error::other(message));
    }
    Ok(bytes)
}

/// A file that appears whole: written beside its place and moved there in the end, or gone.
#[derive(Debug)]
pub struct Partial {
    path: PathBuf,
    target: PathBuf,
}

impl Partial {
    /// Begins the file that will be `target`.
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

    /// Puts the file into its place.
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
        // After `finish` there is none.
        let _ = fs::remove_file(&self.path);
    }
}

/// Writes a whole file.
///
/// # Errors
/// [`RecordingError::Io`].
pub fn write(target: &Path, bytes: &[u8]) -> Result<(), RecordingError> {
    let (partial, mut file) = Partial::create(target)?;
    file.write_all(bytes)
        .map_err(|source| RecordingError::io(target, source))?;
    partial.finish()
}
