//! Reader of the arrays of an npz file.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use num_complex::Complex32;
use zip::ZipArchive;

use super::npy::Npy;

/// Arrays of an npz file.
pub struct Arrays(ZipArchive<File>);

/// Error message without the file name.
type Why = String;

impl Arrays {
    /// Opens a file.
    pub fn open(path: &Path) -> Result<Self, Why> {
        let file = File::open(path).map_err(|error| error.to_string())?;
        let archive = ZipArchive::new(file);
        Ok(Self(
            archive.map_err(|error| format!("not an npz file: {error}"))?,
        ))
    }

    fn bytes(&mut self, name: &str) -> Result<Vec<u8>, Why> {
        let entry = self.0.by_name(&format!("{name}.npy"));
        let mut entry = entry.map_err(|_| format!("array `{name}` is missing"))?;
        let mut bytes = Vec::new();
        let read = entry.read_to_end(&mut bytes);
        read.map_err(|error| format!("array `{name}`: {error}"))?;
        Ok(bytes)
    }

    /// Reads real or integer numbers with `width` values per row.
    pub fn numbers(&mut self, name: &str, width: u64) -> Result<Vec<f64>, Why> {
        let bytes = self.bytes(name)?;
        let npy = Npy::new(&bytes).map_err(|error| format!("array `{name}`: {error}"))?;
        let shape = &npy.shape;
        let fits = match *shape.as_slice() {
            [] | [_] => width == 1,
            [_, columns] => columns as u64 == width,
            _ => false,
        };
        if !fits {
            return Err(format!(
                "array `{name}` has the shape {shape:?}; each row must have {width} values"
            ));
        }
        let values = match npy.kind.trim_start_matches(['<', '|', '=']) {
            "f8" => converted(&npy, f64::from_le_bytes),
            "f4" => converted(&npy, |it| f32::from_le_bytes(it).into()),
            "i8" => converted(&npy, |it| i64::from_le_bytes(it) as f64),
            "i4" => converted(&npy, |it| i32::from_le_bytes(it).into()),
            "u2" => converted(&npy, |it| u16::from_le_bytes(it).into()),
            "u1" => converted(&npy, |[it]| it.into()),
            _ => {
                let kind = npy.kind;
                return Err(format!(
                    "array `{name}` has the type {kind}; it must be f4, f8, i4 or i8"
                ));
            }
        };
        let values = values.map_err(|error| format!("array `{name}`: {error}"))?;
        let width = width as usize;
        Ok(if npy.is_by_column && width > 1 {
            let rows = values.len() / width;
            let places = 0..rows * width;
            places
                .map(|place| values[place % width * rows + place / width])
                .collect()
        } else {
            values
        })
    }

    /// Reads complex numbers.
    pub fn complex(&mut self, name: &str) -> Result<Vec<Complex32>, Why> {
        let bytes = self.bytes(name)?;
        let npy = Npy::new(&bytes).map_err(|error| format!("array `{name}`: {error}"))?;
        if npy.kind != "<c8" {
            let kind = npy.kind;
            return Err(format!(
                "array `{name}` must be complex64 (`<c8`), not `{kind}`"
            ));
        }
        let elements = npy.elements();
        let elements = elements.map_err(|error| format!("array `{name}`: {error}"))?;
        let value = |[a, b, c, d, e, f, g, h]: [u8; 8]| {
            Complex32::new(
                f32::from_le_bytes([a, b, c, d]),
                f32::from_le_bytes([e, f, g, h]),
            )
        };
        Ok(elements.iter().copied().map(value).collect())
    }
}

/// Returns all elements of an array as real numbers.
fn converted<const WIDTH: usize>(
    npy: &Npy<'_>,
    number: impl Fn([u8; WIDTH]) -> f64,
) -> Result<Vec<f64>, Why> {
    Ok(npy.elements()?.iter().copied().map(number).collect())
}
