//! MCAP files of a path: a single file, or the files of a rosbag2 folder.

use std::fs;
use std::path::{Path, PathBuf};

use super::messages::first_time_ns;
use crate::error::RecordingError;
use crate::file as files;

/// Maximum size of `metadata.yaml` in bytes; a bag of many thousand files has a shorter one.
const MAX_METADATA_BYTES: u64 = 16 << 20;

/// Whether a path is a rosbag2 folder or one of its files, judged by the name.
pub fn is_bag(path: &Path) -> bool {
    path.is_dir() || ends_with(path, "mcap") || ends_with(path, "db3")
}

/// Returns the MCAP files of a bag in order of time; a single file is a bag.
///
/// All MCAP files of a folder are read, even if the recorder was stopped before it wrote
/// `metadata.yaml`. A file that `metadata.yaml` names must exist.
///
/// # Errors
/// [`RecordingError`] if the folder cannot be read, lacks a named file, or contains no MCAP file.
pub fn files_of(bag: &Path) -> Result<Vec<PathBuf>, RecordingError> {
    let io = |source| RecordingError::io(bag, source);
    if ends_with(bag, "db3") {
        return Err(not_mcap(bag));
    }
    if !bag.is_dir() {
        return Ok(vec![bag.to_owned()]);
    }
    let (mut found, mut other) = (Vec::new(), None);
    for entry in fs::read_dir(bag).map_err(io)? {
        let file = entry.map_err(io)?.path();
        if ends_with(&file, "mcap") {
            found.push(file);
        } else if ends_with(&file, "db3") || ends_with(&file, "zstd") {
            other = Some(file);
        }
    }
    if found.is_empty() {
        return Err(other.map_or_else(|| empty(bag), |file| not_mcap(&file)));
    }
    for name in announced(bag)? {
        if !bag.join(&name).is_file() {
            return Err(RecordingError::Missing {
                file: bag.join("metadata.yaml").display().to_string(),
                key: name,
                allowed:
                    "every file that it names must be in the folder; to read one file alone, give \
                     that file in place of the folder"
                        .to_owned(),
            });
        }
    }
    if found.len() == 1 {
        return Ok(found);
    }
    let mut timed = Vec::with_capacity(found.len());
    for file in found {
        // The position of a file without messages is arbitrary.
        timed.push((first_time_ns(&file)?.unwrap_or(u64::MAX), file));
    }
    timed.sort();
    Ok(timed.into_iter().map(|(_, file)| file).collect())
}

fn ends_with(file: &Path, extension: &str) -> bool {
    let found = file.extension();
    found.is_some_and(|it| it.eq_ignore_ascii_case(extension))
}

/// Returns the names of the MCAP files in `metadata.yaml`, without the folders that old versions
/// write.
fn announced(bag: &Path) -> Result<Vec<String>, RecordingError> {
    let file = bag.join("metadata.yaml");
    if !file.exists() {
        return Ok(Vec::new());
    }
    let bytes = files::read(&file, MAX_METADATA_BYTES)
        .map_err(|source| RecordingError::io(&file, source))?;
    let text = String::from_utf8_lossy(&bytes);
    let items = text.lines().filter_map(|line| {
        let item = line.trim().strip_prefix("- ")?.trim();
        let path = item.strip_prefix("path:").unwrap_or(item).trim();
        let path = Path::new(path.trim_matches(['"', '\'']));
        let name = ends_with(path, "mcap").then(|| path.file_name())??;
        Some(name.to_string_lossy().into_owned())
    });
    Ok(items.collect())
}

fn not_mcap(file: &Path) -> RecordingError {
    let (storage, remedy) = if ends_with(file, "db3") {
        (
            "sqlite3",
            "MCAP is read: `ros2 bag convert -i BAG -o mcap.yaml` writes it, with `output_bags: \
             [{uri: NEW, storage_id: mcap, all: true}]` in mcap.yaml",
        )
    } else {
        (
            "compressed as a whole",
            "MCAP is read, also with compressed chunks in it: `zstd -d FILE` unpacks it",
        )
    };
    RecordingError::value(file, "storage", storage, remedy)
}

fn empty(bag: &Path) -> RecordingError {
    RecordingError::Missing {
        file: bag.display().to_string(),
        key: "*.mcap".to_owned(),
        allowed: "a rosbag2 folder holds one MCAP file or several".to_owned(),
    }
}
