//! SHA-512 of a data file.

use std::fmt::Write;
use std::io::{self, Read};
use std::path::Path;

use sha2::{Digest, Sha512};

/// Bytes hashed at once.
const BLOCK: usize = 1 << 16;

/// SHA-512 of a file, hexadecimal, as `core:sha512` holds it.
pub(super) fn of_file(path: &Path) -> io::Result<String> {
    let mut file = crate::file::open(path)?;
    let mut hash = Sha512::new();
    let mut block = vec![0; BLOCK];
    loop {
        let read = file.read(&mut block)?;
        if read == 0 {
            return Ok(hexadecimal(hash));
        }
        hash.update(block.get(..read).unwrap_or_default());
    }
}

pub(super) fn hexadecimal(hash: Sha512) -> String {
    hash.finalize()
        .iter()
        .fold(String::new(), |mut text, byte| {
            // Writing into a string does not fail.
            let _ = write!(text, "{byte:02x}");
            text
        })
}
