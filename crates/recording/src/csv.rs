//! Tables of numbers with named columns, separated by commas.

use std::path::Path;

use crate::error::RecordingError;
use crate::file as files;

/// A day of samples at 50 Hz.
const MOST_BYTES: u64 = 512 << 20;

/// A table in memory: the wanted columns of each row, or what is wrong with the row.
#[derive(Debug)]
pub struct Table {
    pub rows: Vec<Row>,
    header: Vec<String>,
}

#[derive(Debug)]
pub struct Row {
    /// Line in the file, from 1.
    pub line: usize,
    /// One value per wanted column, `None` where an optional one is absent or empty.
    pub values: Result<Vec<Option<f64>>, String>,
}

impl Table {
    /// Reads the columns `required` and `optional`; others are ignored.
    ///
    /// # Errors
    /// [`RecordingError`] when the file cannot be read or a required column is missing. A row that
    /// cannot be used is not an error: it says what is wrong with it.
    pub fn read(file: &Path, required: &[&str], optional: &[&str]) -> Result<Self, RecordingError> {
        let bytes =
            files::read(file, MOST_BYTES).map_err(|source| RecordingError::io(file, source))?;
        let text = String::from_utf8_lossy(&bytes);
        let mut lines = text.trim_start_matches('\u{feff}').lines().enumerate();
        let header: Vec<&str> = lines
            .next()
            .map(|(_, line)| line.split(',').map(str::trim).collect())
            .unwrap_or_default();
        let place = |name: &str| header.iter().position(|column| *column == name);
        let mut wanted: Vec<(&str, Option<usize>, bool)> = Vec::new();
        for name in required {
            let Some(place) = place(name) else {
                return Err(RecordingError::Missing {
                    file: file.display().to_string(),
                    key: (*name).to_owned(),
                    allowed: format!(
                        "the first line must name the columns {}",
                        required.join(", ")
                    ),
                });
            };
            wanted.push((name, Some(place), true));
        }
        wanted.extend(optional.iter().map(|name| (*name, place(name), false)));
        let rows = lines
            .filter(|(_, line)| !line.trim().is_empty())
            .map(|(index, line)| Row {
                line: index + 1,
                values: values(line, header.len(), &wanted),
            })
            .collect();
        let header = header.into_iter().map(str::to_owned).collect();
        Ok(Self { rows, header })
    }

    /// Whether there is a column of this name.
    pub fn has(&self, name: &str) -> bool {
        self.header.iter().any(|column| column == name)
    }
}

fn values(
    line: &str,
    columns: usize,
    wanted: &[(&str, Option<usize>, bool)],
) -> Result<Vec<Option<f64>>, String> {
    let fields: Vec<&str> = line.split(',').map(str::trim).collect();
    if fields.len() != columns {
        return Err(format!("{} fields instead of {columns}", fields.len()));
    }
    let value = |(name, place, required): &(&str, Option<usize>, bool)| {
        let field = place
            .and_then(|place| fields.get(place))
            .copied()
            .unwrap_or_default();
        if field.is_empty() && !required {
            return Ok(None);
        }
        let number = field
            .parse()
            .map_err(|_| format!("{name} `{field}` is not a number"))?;
        Ok(Some(number))
    };
    wanted.iter().map(value).collect()
}
