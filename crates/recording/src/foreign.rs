//! Detection of other file formats where a text table is expected.

/// First bytes of a file, name of the format, and remedy.
const FORMATS: [(&[u8], &str, &str); 9] = [
    (b"\x89MCAP0", "MCAP", "name the file .mcap"),
    (
        b"#ROSBAG",
        "a bag of ROS 1",
        "convert it with `rosbags-convert --src FILE --dst FOLDER --dst-storage mcap`",
    ),
    (
        b"SQLite format 3",
        "sqlite3, as of rosbag2",
        "convert it to MCAP with `ros2 bag convert`",
    ),
    (b"PAR1", "Parquet", "write the table as CSV"),
    (
        b"\x28\xb5\x2f\xfd",
        "compressed (zstd)",
        "unpack it with `zstd -d FILE`",
    ),
    (
        b"\x04\x22\x4d\x18",
        "compressed (lz4)",
        "unpack it with `lz4 -d FILE`",
    ),
    (
        b"\x1f\x8b",
        "compressed (gzip)",
        "unpack it with `gunzip FILE`",
    ),
    (
        b"PK\x03\x04",
        "a zip file or a spreadsheet",
        "write the table as CSV",
    ),
    (b"\x89HDF", "HDF5", "write the table as CSV"),
];

/// First bytes of files that do not hold tables, and name of the format.
const SAMPLE_FORMATS: [(&[u8], &str); 4] = [
    (b"RIFF", "WAV"),
    (b"MATLAB", "MATLAB"),
    (b"\x93NUMPY", "NumPy"),
    (b"\xfd7zXZ", "compressed (xz)"),
];

/// Byte order mark of UTF-16, little-endian.
const UTF16_LE: &[u8] = b"\xff\xfe";
/// Byte order mark of UTF-16, big-endian.
const UTF16_BE: &[u8] = b"\xfe\xff";

/// Byte order marks of UTF-32; the first begins like that of UTF-16.
const UTF32: [&[u8]; 2] = [b"\xff\xfe\0\0", b"\0\0\xfe\xff"];

/// Returns the name of a known format by the first bytes of a file.
pub fn format_of(bytes: &[u8]) -> Option<&'static str> {
    let tables = FORMATS.into_iter().map(|it| (it.0, it.1));
    let mut known = tables.chain(SAMPLE_FORMATS);
    let found = known.find(|(beginning, _)| bytes.starts_with(beginning));
    found.map(|(_, format)| format)
}

/// Returns the text of a file in UTF-8, or in UTF-16 with a byte order mark.
///
/// # Errors
/// Format of the file and the remedy, if it is not text in the format `wanted`.
pub fn text_of(bytes: &[u8], wanted: &str) -> Result<String, String> {
    let formats = FORMATS.into_iter();
    let known = formats
        .clone()
        .find(|(beginning, ..)| bytes.starts_with(beginning));
    if let Some((_, format, remedy)) = known {
        let remedy = remedy.replace("CSV", wanted);
        return Err(format!("the file is {format}, not {wanted}; {remedy}"));
    }
    let utf16 = |from: fn([u8; 2]) -> u16| {
        let pairs = bytes.chunks_exact(2).skip(1);
        let units = pairs.filter_map(|pair| pair.first_chunk::<2>().map(|pair| from(*pair)));
        String::from_utf16_lossy(&units.collect::<Vec<u16>>())
    };
    if UTF32.iter().any(|mark| bytes.starts_with(mark)) {
        return Err(format!(
            "the file is UTF-32 text; write it as {wanted} in UTF-8"
        ));
    }
    if bytes.starts_with(UTF16_LE) {
        return Ok(utf16(u16::from_le_bytes));
    }
    if bytes.starts_with(UTF16_BE) {
        return Ok(utf16(u16::from_be_bytes));
    }
    if bytes.contains(&0) {
        return Err(format!(
            "the file holds zero bytes: it is binary, or UTF-16 without a byte order mark; write it as {wanted} in \
             UTF-8"
        ));
    }
    Ok(String::from_utf8_lossy(bytes).into_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_in_utf8_and_utf16_is_read() {
        let text = "time_s,Größe\n0,1\n";
        assert_eq!(text_of(text.as_bytes(), "CSV").unwrap(), text);
        let units: Vec<u16> = "\u{feff}"
            .encode_utf16()
            .chain(text.encode_utf16())
            .collect();
        let little: Vec<u8> = units.iter().flat_map(|it| it.to_le_bytes()).collect();
        let big: Vec<u8> = units.iter().flat_map(|it| it.to_be_bytes()).collect();
        assert_eq!(text_of(&little, "CSV").unwrap(), text);
        assert_eq!(text_of(&big, "CSV").unwrap(), text);
        let error = text_of(little.get(2..).unwrap(), "CSV").unwrap_err();
        assert!(error.contains("UTF-16"), "{error}");
    }

    #[test]
    fn other_formats_are_reported_by_name() {
        for (beginning, format, _) in FORMATS {
            let bytes = [beginning, b"\0\0\0"].concat();
            let error = text_of(&bytes, "CSV").unwrap_err();
            assert!(error.contains(format), "{error}");
        }
    }
}
