//! Files that grow: whole when the node ends, and as new ones by size and time.

use std::fs::{self, File};
use std::io::{self, BufWriter};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

/// Opens a file to write to, and the folder it is in.
///
/// # Errors
/// Those of the file system, with the file's name.
pub fn create(path: &Path) -> Result<BufWriter<File>> {
    let made = || -> io::Result<File> {
        if let Some(folder) = path.parent() {
            fs::create_dir_all(folder)?;
        }
        File::create(path)
    };
    let file = made().with_context(|| path.display().to_string())?;
    Ok(BufWriter::with_capacity(1 << 16, file))
}

/// Removes the oldest files of a folder that a prefix and an ending tell, so that so many are left.
///
/// # Errors
/// Those of the file system.
pub fn keep_newest(folder: &Path, prefix: &str, ending: &str, keep: usize) -> io::Result<()> {
    let mut found: Vec<PathBuf> = Vec::new();
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        let name = path
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        if name.starts_with(prefix) && name.ends_with(ending) {
            found.push(path);
        }
    }
    found.sort();
    let gone = found.len().saturating_sub(keep);
    found.iter().take(gone).try_for_each(fs::remove_file)
}
