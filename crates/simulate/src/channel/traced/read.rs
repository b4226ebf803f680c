//! Reader of the arrays of an npz file.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use npyz::{DType, NpyFile, Order};
use num_complex::Complex32;
use zip::ZipArchive;

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
        let npy =
            NpyFile::new(bytes.as_slice()).map_err(|error| format!("array `{name}`: {error}"))?;
        let shape = npy.shape().to_vec();
        let fits = match *shape.as_slice() {
            [] | [_] => width == 1,
            [_, columns] => columns == width,
            _ => false,
        };
        if !fits {
            return Err(format!(
                "array `{name}` has the shape {shape:?}; each row must have {width} values"
            ));
        }
        let by_column = npy.order() == Order::Fortran;
        let kind = match npy.dtype() {
            DType::Plain(kind) => kind.to_string(),
            _ => String::new(),
        };
        let values = match kind.trim_start_matches(['<', '|', '=']) {
            "f8" => npy.into_vec::<f64>(),
            "f4" => npy.into_vec::<f32>().map(widened),
            "i8" => npy
                .into_vec::<i64>()
                .map(|values| values.into_iter().map(|it| it as f64).collect()),
            "i4" => npy.into_vec::<i32>().map(widened),
            "u2" => npy.into_vec::<u16>().map(widened),
            "u1" => npy.into_vec::<u8>().map(widened),
            _ => {
                return Err(format!(
                    "array `{name}` has the type {kind}; it must be f4, f8, i4 or i8"
                ));
            }
        };
        let values = values.map_err(|error| format!("array `{name}`: {error}"))?;
        let width = width as usize;
        Ok(if by_column && width > 1 {
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
        let npy =
            NpyFile::new(bytes.as_slice()).map_err(|error| format!("array `{name}`: {error}"))?;
        npy.into_vec::<Complex32>()
            .map_err(|error| format!("array `{name}` must be complex64: {error}"))
    }
}

fn widened<T: Into<f64>>(values: Vec<T>) -> Vec<f64> {
    values.into_iter().map(Into::into).collect()
}
