//! Tables of numbers with named columns, separated by commas, semicolons or tabs. With semicolons
//! or tabs, numbers may have a decimal comma.

use std::path::Path;

use csv::{ReaderBuilder, StringRecord, Trim};

use crate::error::RecordingError;
use crate::file as files;
use crate::foreign::text_of;
use crate::number::Numbers;

/// Maximum size of a table in bytes: a day of samples at 50 Hz.
const MOST_BYTES: u64 = 512 << 20;

/// Allowed column separators.
const SEPARATORS: [char; 3] = [',', ';', '\t'];

/// Table in memory: the requested columns of each row, or the defect of the row.
#[derive(Debug)]
pub struct Table {
    pub rows: Vec<Row>,
    file: String,
    header: StringRecord,
}

#[derive(Debug)]
pub struct Row {
    /// Line in the file, from 1.
    pub line: usize,
    /// One value per requested column; `None` for an optional column that is missing or empty.
    pub values: Result<Vec<Option<f64>>, String>,
}

impl Table {
    /// Reads the columns `required` and `optional`; other columns and lines that begin with `#` are
    /// ignored.
    ///
    /// # Errors
    /// [`RecordingError`] if the file cannot be read, a required column is missing, or a requested
    /// column occurs twice. An unusable row is not an error; its entry describes the defect.
    pub fn read(file: &Path, required: &[&str], optional: &[&str]) -> Result<Self, RecordingError> {
        let bytes =
            files::read(file, MOST_BYTES).map_err(|source| RecordingError::io(file, source))?;
        let text = text_of(&bytes).map_err(|message| RecordingError::Syntax {
            file: file.display().to_string(),
            format: "CSV",
            message,
        })?;
        Self::parse(&text, file, required, optional)
    }

    /// Reads a table from a text; `file` is the name in errors.
    ///
    /// # Errors
    /// Errors of [`read`](Self::read).
    pub fn parse(
        text: &str,
        file: &Path,
        required: &[&str],
        optional: &[&str],
    ) -> Result<Self, RecordingError> {
        let separator = separator(text);
        let mut numbers = Numbers::new(separator);
        let mut reader = ReaderBuilder::new()
            .delimiter(separator as u8)
            .comment(Some(b'#'))
            .flexible(true)
            .trim(Trim::All)
            .from_reader(text.as_bytes());
        let invalid = |error: csv::Error| RecordingError::Syntax {
            file: file.display().to_string(),
            format: "CSV",
            message: error.to_string(),
        };
        let mut table = Self {
            rows: Vec::new(),
            file: file.display().to_string(),
            header: reader.headers().map_err(invalid)?.clone(),
        };
        let mut wanted: Vec<(&str, Option<usize>, bool)> = Vec::new();
        let names = required.iter().map(|name| (name, true));
        for (name, is_required) in names.chain(optional.iter().map(|name| (name, false))) {
            let named = table.header.iter().enumerate();
            let mut places = named.filter(|(_, column)| column == name).map(|(it, _)| it);
            let place = places.next();
            if places.next().is_some() {
                let once = "each column may occur only once";
                return Err(RecordingError::value(file, *name, "there twice", once));
            }
            if is_required && place.is_none() {
                let allowed = format!(
                    "the first line must name the columns {}",
                    required.join(", ")
                );
                return Err(table.missing(name, &allowed));
            }
            wanted.push((name, place, is_required));
        }
        for record in reader.records() {
            let record = record.map_err(invalid)?;
            let line = record.position().map_or(0, csv::Position::line) as usize;
            if record.iter().eq([""]) {
                continue; // blanks
            }
            let values = values(&record, table.header.len(), &wanted, &mut numbers);
            table.rows.push(Row { line, values });
        }
        Ok(table)
    }

    /// Whether a column with this name exists.
    pub fn has(&self, name: &str) -> bool {
        self.header.iter().any(|column| column == name)
    }

    /// Creates the error for a missing column, with the allowed and the existing columns.
    pub fn missing(&self, column: &str, allowed: &str) -> RecordingError {
        let named: Vec<&str> = self.header.iter().collect();
        let is_header = |name: &&str| name.parse::<f64>().is_err();
        let named = if named.is_empty() {
            "the file is empty".to_owned()
        } else if !named.iter().any(is_header) {
            format!(
                "the file has no header: its first line holds the numbers {}",
                named.join(", ")
            )
        } else {
            format!("it names {}", named.join(", "))
        };
        RecordingError::Missing {
            file: self.file.clone(),
            key: column.to_owned(),
            allowed: format!("{allowed}; {named}"),
        }
    }
}

/// Returns the separator with the most occurrences in the first line.
fn separator(text: &str) -> char {
    let mut lines = text.trim_start_matches('\u{feff}').lines();
    let is_header = |line: &&str| !line.trim().is_empty() && !line.starts_with('#');
    let header = lines.find(is_header).unwrap_or_default();
    let count = |it: &char| header.chars().filter(|sign| sign == it).count();
    // For equal counts, the last candidate is selected: the comma if the line has no separator.
    let most = SEPARATORS.into_iter().rev().max_by_key(count);
    most.unwrap_or(',')
}

fn values(
    record: &StringRecord,
    columns: usize,
    wanted: &[(&str, Option<usize>, bool)],
    numbers: &mut Numbers,
) -> Result<Vec<Option<f64>>, String> {
    if record.len() != columns {
        let surplus = record.len() > columns;
        let hint = if surplus { numbers.surplus_hint() } else { "" };
        return Err(format!(
            "{} fields instead of {columns}{hint}",
            record.len()
        ));
    }
    let value = |(name, place, required): &(&str, Option<usize>, bool)| {
        let field = place
            .and_then(|place| record.get(place))
            .unwrap_or_default();
        if field.is_empty() && !required {
            return Ok(None);
        }
        let number = numbers.read(field).map_err(|why| format!("{name} {why}"))?;
        Ok(Some(number))
    };
    wanted.iter().map(value).collect()
}
