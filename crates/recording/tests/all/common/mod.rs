//! Functions that are shared by tests of files.
#![allow(
    dead_code,
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "shared by tests"
)]

use std::path::{Path, PathBuf};

/// Returns the folder of the reference data; prints a reason and returns `None` if it does not
/// exist.
pub fn data_dir() -> Option<PathBuf> {
    let dir = std::env::var_os("ACCESS_AV_DATA").map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data"),
        PathBuf::from,
    );
    if dir.is_dir() {
        return Some(dir);
    }
    println!(
        "skipped: no reference data at {} (set ACCESS_AV_DATA)",
        dir.display()
    );
    None
}

/// Creates an empty directory for a test.
pub fn scratch(name: &str) -> PathBuf {
    let dir = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    if dir.exists() {
        std::fs::remove_dir_all(&dir).unwrap();
    }
    std::fs::create_dir_all(&dir).unwrap();
    dir
}
