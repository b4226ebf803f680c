//! SigMF archives (`.sigmf`, a tar file with recordings) and collections (`.sigmf-collection`).

use std::io::Read;
use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::error::RecordingError;
use crate::file as files;
use crate::foreign::format_of;

/// Maximum size of a collection file in bytes: names and hashes of recordings.
const MAX_COLLECTION_BYTES: u64 = 16 << 20;
/// Number of bytes that determine the format of a file.
const MAGIC_BYTES: u64 = 16;

/// Byte range of data in a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Extent {
    /// Path of the file.
    pub file: PathBuf,
    /// Offset of the first byte.
    pub offset: u64,
    /// Number of bytes.
    pub bytes: u64,
}

/// Returns the metadata and the byte range of the data of the only recording of an archive.
///
/// # Errors
/// [`RecordingError`] if the file is not a tar file or does not contain exactly one recording.
pub fn recording_in(archive: &Path) -> Result<(Vec<u8>, Extent), RecordingError> {
    let io = |source| RecordingError::io(archive, source);
    let syntax = |source: std::io::Error| RecordingError::Syntax {
        file: archive.display().to_string(),
        format: "SigMF archive (tar)",
        // The library quotes the bytes of the file.
        message: format!("it is damaged, or not a tar file ({:?})", source.kind()),
    };
    let mut start = Vec::new();
    let opened = files::open(archive).map_err(io)?;
    let mut first = opened.take(MAGIC_BYTES);
    first.read_to_end(&mut start).map_err(io)?;
    if let Some(format) = format_of(&start) {
        let allowed = "a SigMF archive is a tar file without compression; unpack it";
        return Err(RecordingError::value(archive, "archive", format, allowed));
    }
    let mut tar = tar::Archive::new(files::open(archive).map_err(io)?);
    let mut metas: Vec<(String, Vec<u8>)> = Vec::new();
    let mut data: Vec<(String, Extent)> = Vec::new();
    for entry in tar.entries_with_seek().map_err(syntax)? {
        let mut entry = entry.map_err(syntax)?;
        let name = String::from_utf8_lossy(&entry.path_bytes()).into_owned();
        if let Some(stem) = name.strip_suffix(".sigmf-meta") {
            if entry.size() > files::MAX_BYTES {
                let allowed = format!("metadata must be at most {} bytes long", files::MAX_BYTES);
                return Err(RecordingError::value(
                    archive,
                    name.as_str(),
                    entry.size(),
                    allowed,
                ));
            }
            let mut text = Vec::new();
            entry.read_to_end(&mut text).map_err(syntax)?;
            metas.push((stem.to_owned(), text));
        } else if let Some(stem) = name.strip_suffix(".sigmf-data") {
            let extent = Extent {
                file: archive.to_owned(),
                offset: entry.raw_file_position(),
                bytes: entry.size(),
            };
            data.push((stem.to_owned(), extent));
        }
    }
    let names: Vec<String> = metas.iter().map(|(stem, _)| stem.clone()).collect();
    let [(stem, text)] = <[_; 1]>::try_from(metas).map_err(|_| {
        let allowed = if names.is_empty() {
            "an archive must hold a .sigmf-meta file".to_owned()
        } else {
            format!(
                "an archive must contain one recording; extract one of {} with `tar -xf`",
                names.join(", ")
            )
        };
        RecordingError::value(archive, "recordings", names.len(), allowed)
    })?;
    let extent = data
        .into_iter()
        .find(|(name, _)| *name == stem)
        .map(|(_, extent)| extent);
    let extent = extent.ok_or_else(|| RecordingError::HalfMissing {
        present: format!("{}: {stem}.sigmf-meta", archive.display()),
        missing: format!("{stem}.sigmf-data"),
    })?;
    Ok((text, extent))
}

/// Returns the path of the only recording of a collection.
///
/// # Errors
/// [`RecordingError`] if the file cannot be read or does not name exactly one recording.
pub fn recording_of(collection: &Path) -> Result<PathBuf, RecordingError> {
    let text = files::read(collection, MAX_COLLECTION_BYTES)
        .map_err(|source| RecordingError::io(collection, source))?;
    let json: Value = serde_json::from_slice(&text).map_err(|error| RecordingError::Syntax {
        file: collection.display().to_string(),
        format: "JSON",
        message: error.to_string(),
    })?;
    let key = "collection.core:streams";
    let streams = json
        .pointer("/collection/core:streams")
        .and_then(Value::as_array);
    let name = |stream: &Value| {
        let named = stream.get("name").unwrap_or(stream);
        named.as_str().map(str::to_owned)
    };
    let names: Vec<String> = streams.into_iter().flatten().filter_map(name).collect();
    match names.as_slice() {
        [one] => Ok(collection.with_file_name(format!("{one}.sigmf-meta"))),
        [] => Err(RecordingError::Missing {
            file: collection.display().to_string(),
            key: key.to_owned(),
            allowed: "a collection must name its recordings".to_owned(),
        }),
        several => {
            let allowed = format!(
                "one recording is read at a time; give one of {}",
                several.join(", ")
            );
            Err(RecordingError::value(
                collection,
                key,
                format!("{} recordings", several.len()),
                allowed,
            ))
        }
    }
}
