//! Tables of numbers with named columns, separated by commas, semicolons or tabs. With semicolons
//! or tabs, numbers may have a decimal comma.

use std::borrow::Cow;
use std::path::Path;

use csv::{ReaderBuilder, StringRecord, Trim};
use onboard::time_unit::TimeUnit;

use crate::error::RecordingError;
use crate::file as files;
use crate::foreign::text_of;
use crate::number::Numbers;

/// Allowed column separators.
const SEPARATORS: [char; 3] = [',', ';', '\t'];

/// Table in memory: the requested columns of each row, or the defect of the row.
#[derive(Debug)]
pub struct Table {
    pub rows: Vec<Row>,
    file: String,
    header: StringRecord,
    /// Fields of the first comment, which may be a header by mistake.
    commented: Vec<String>,
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
        let bytes = files::read(file, files::MAX_BYTES)
            .map_err(|source| RecordingError::io(file, source))?;
        let text = text_of(&bytes, "CSV").map_err(|message| RecordingError::Syntax {
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
        let text = without_hints(text);
        let text = text.as_ref();
        let separator = given_separator(text).unwrap_or_else(|| separator(text));
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
            commented: text
                .lines()
                .find_map(|line| line.strip_prefix('#'))
                .map(|line| {
                    line.split(separator)
                        .map(|it| it.trim().to_owned())
                        .collect()
                })
                .unwrap_or_default(),
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
            allowed: format!("{allowed}; {named}{}", self.advice(column)),
        }
    }

    /// Returns the advice for a missing column that the file has in another notation.
    fn advice(&self, column: &str) -> String {
        let is_other = |name: &&str| {
            let has_name = |start: &str| start.eq_ignore_ascii_case(column);
            let rest = name.get(column.len()..).unwrap_or_default();
            let has_unit = rest.starts_with([' ', '[', '(', '/']);
            has_name(name) || (has_unit && name.get(..column.len()).is_some_and(has_name))
        };
        let alone = (self.header.len() == 1)
            .then(|| self.header.get(0))
            .flatten();
        let has_other_separator =
            |name: &str| name.contains(column) && name.contains([' ', '|', ':']);
        if self.commented.iter().any(|name| name == column) {
            "; the header must not begin with #".to_owned()
        } else if alone.is_some_and(has_other_separator) {
            "; separate the columns by commas, semicolons or tabs".to_owned()
        } else if let Some(name) = self.header.iter().find(is_other) {
            format!("; write {column} instead of {name}")
        } else {
            String::new()
        }
    }
}

/// First line of the CSV files of spreadsheets, which gives the separator; as a comment.
const SEPARATOR_LINE: &str = "#sep=";

/// Returns a text without byte order mark, and without blanks before comments. The line `sep=;` of
/// spreadsheets becomes a comment. The number of lines is unchanged.
fn without_hints(text: &str) -> Cow<'_, str> {
    let text = text.trim_start_matches('\u{feff}');
    let first = text.lines().find(|line| !line.trim().is_empty());
    let is_separator = |line: &str| {
        let bare = line.trim_matches([' ', '"', '\r']);
        let name = bare.get(..4).unwrap_or_default();
        name.eq_ignore_ascii_case("sep=") && bare.chars().count() == 5
    };
    let has_hint = first.is_some_and(is_separator);
    let is_indented = |line: &str| !line.starts_with('#') && line.trim_start().starts_with('#');
    if !has_hint && !text.lines().any(is_indented) {
        return Cow::Borrowed(text);
    }
    let mut hint = first.filter(|_| has_hint);
    let lines = text.lines().map(|line| {
        if hint.take_if(|it| *it == line).is_some() {
            // A tab must not be trimmed.
            let separator = line.trim_matches([' ', '"', '\r']).chars().next_back();
            format!("{SEPARATOR_LINE}{}", separator.unwrap_or(','))
        } else if is_indented(line) {
            line.trim_start().to_owned()
        } else {
            line.to_owned()
        }
    });
    Cow::Owned(lines.collect::<Vec<String>>().join("\n") + "\n")
}

/// Returns the separator that the first line gives.
fn given_separator(text: &str) -> Option<char> {
    let first = text.lines().find(|line| !line.trim().is_empty())?;
    let separator = first.strip_prefix(SEPARATOR_LINE)?.chars().next()?;
    (separator.is_ascii() && separator != '"').then_some(separator)
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

/// Returns a value that is not given, or finite.
pub fn finite(value: Option<f64>, name: &str) -> Result<Option<f64>, String> {
    match value {
        Some(value) if !value.is_finite() => Err(format!("{name} is not finite")),
        value => Ok(value),
    }
}

/// Returns a finite value.
pub fn needed(value: Option<f64>, name: &str) -> Result<f64, String> {
    finite(value, name)?.ok_or_else(|| format!("{name} is missing"))
}

/// Returns a time of a drive in seconds.
pub fn drive_time_s(value: Option<f64>) -> Result<f64, String> {
    let time_s = needed(value, "time_s")?;
    TimeUnit::of_epoch(time_s).map_or(Ok(time_s), |unit| {
        Err(format!(
            "time_s {time_s} is not a time of a drive and probably in {unit}; it must be seconds"
        ))
    })
}

/// Returns PCI and SSB index of a radio head; the index is 0 by default.
pub fn radio_head(pci: Option<f64>, ssb_index: Option<f64>) -> Result<(u16, u8), String> {
    let whole = |value: f64, name: &str, most: f64| {
        if value.fract() == 0.0 && (0.0..=most).contains(&value) {
            Ok(value)
        } else {
            Err(format!("{name} {value} is not an integer from 0 to {most}"))
        }
    };
    let ssb_index = finite(ssb_index, "ssb_index")?.unwrap_or(0.0);
    let pci = whole(needed(pci, "pci")?, "pci", 1007.0)?;
    Ok((pci as u16, whole(ssb_index, "ssb_index", 63.0)? as u8))
}
