//! SHA-512 of a data file.

use std::fmt::Write;
use std::io::{self, Read, Seek, SeekFrom};

use sha2::{Digest, Sha512};

/// Number of bytes hashed at once.
const BLOCK: usize = 1 << 16;

use super::archive::Extent;

/// Returns the SHA-512 of data in hexadecimal form, like `core:sha512`.
pub(super) fn of_extent(extent: &Extent) -> io::Result<String> {
    let mut file = crate::file::open(&extent.file)?;
    file.seek(SeekFrom::Start(extent.offset))?;
    let mut file = file.take(extent.bytes);
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
