//! Log of angles of arrival that a receiver has already estimated, one angle per line.
//!
//! Columns: `time_s`, `pci` and either `phase_rad` (electrical angle ω = 2π(d/λ)·cos θ) with its
//! standard deviation `phase_sigma_rad`, or `angle_rad` (θ from the array's axis) with
//! `angle_sigma_rad`. If both are given, the former is used. Optional columns are `ssb_index`
//! (default 0), `snr_db` and `resolved` (1, or 0 for an unreliable angle; default 1). The standard
//! deviation is assumed to be the total error of the angle.
//!
//! `at_head` is 1 for an angle that was measured by the array of the radio head, and 0 (default) for
//! an angle that was measured on the vehicle. For an angle measured at the radio head, `angle_rad`
//! and `phase_rad` are both the azimuth of the vehicle in the frame of the radio head's array, whose
//! direction is `radio_heads.array.mounting_rad` of the site.

use std::collections::BTreeMap;
use std::fmt;
use std::fmt::Write as _;
use std::path::Path;

use crate::error::RecordingError;
use crate::file as files;
use crate::table::{Table, drive_time_s, finite, needed, radio_head};
pub use onboard::burst::LoggedAngle;
use onboard::burst::UNSTATED_SNR_DB;
use onboard::localize::{AngleMeasurement, MeasurementKind};
use onboard::observation::{BURST_S, SsbDetection};

const COLUMNS: [&str; 9] = [
    "time_s",
    "pci",
    "ssb_index",
    "phase_rad",
    "phase_sigma_rad",
    "angle_rad",
    "snr_db",
    "resolved",
    "at_head",
];

/// Columns that every log must have.
const REQUIRED: [&str; 2] = ["time_s", "pci"];
/// Optional columns, of which some combinations are required.
const OPTIONAL: [&str; 8] = [
    "ssb_index",
    "phase_rad",
    "phase_sigma_rad",
    "angle_rad",
    "angle_sigma_rad",
    "snr_db",
    "resolved",
    "at_head",
];

/// Error text for missing angle columns.
const NEEDED: &str = "there must be phase_rad and phase_sigma_rad, or angle_rad and \
                      angle_sigma_rad";

/// Comment on the standard deviations in written logs.
const DEVIATIONS: &str = "# phase_sigma_rad: total modelled error: receiver noise and the site's \
                          scatter (rician_k_db); mounting and calibration errors of the array are \
                          not included\n";

/// Standard deviation of a uniformly distributed angle, π/√3 (rad).
const MAX_SIGMA_RAD: f64 = 1.813_799_364_234_217_8;

/// Usable angles of a file in order of time, and remarks on single lines.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct AngleLog {
    /// The angles.
    pub angles: Vec<LoggedAngle>,
    /// Remarks on single lines.
    pub remarks: Vec<AngleRemark>,
}

/// Remark on an item of an angle log.
#[derive(Debug, Clone, PartialEq)]
pub struct AngleRemark {
    /// "line" of a CSV file, "row" of a table or "message" of a bag.
    pub kind: &'static str,
    /// Number of the item in the file, from 1.
    pub line: usize,
    /// Time of the previous usable angle in seconds.
    pub time_s: f64,
    /// Whether the item is used nevertheless.
    pub is_used: bool,
    /// Reason.
    pub message: String,
}

impl fmt::Display for AngleRemark {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let left_out = if self.is_used { "" } else { "left out, " };
        write!(
            f,
            "angle log {} {}: {left_out}{}",
            self.kind, self.line, self.message
        )
    }
}

/// Reads an angle log.
///
/// # Errors
/// [`RecordingError`] if the file cannot be read or lacks a column. Invalid single lines are
/// reported as remarks only.
pub fn read_angle_log(file: &Path) -> Result<AngleLog, RecordingError> {
    let table = Table::read(file, &REQUIRED, &OPTIONAL)?;
    if let Some(key) = missing_column(|name| table.has(name)) {
        return Err(table.missing(key, NEEDED));
    }
    let rows = table.rows.into_iter();
    let items = rows.map(|row| (row.line, row.values.and_then(|values| angle(&values))));
    Ok(AngleLog::of_items("line", items))
}

/// Creates an angle log from the columns of a table that was read from `file`, with NaN for missing
/// values. Rows are numbered from 1.
///
/// # Errors
/// [`RecordingError`] if a column is missing. Invalid single rows are reported as remarks only.
pub fn angle_log_of_columns(
    file: &Path,
    columns: &BTreeMap<String, Vec<f64>>,
) -> Result<AngleLog, RecordingError> {
    let missing = |key: &str, allowed: &str| RecordingError::Missing {
        file: file.display().to_string(),
        key: key.to_owned(),
        allowed: allowed.to_owned(),
    };
    if let Some(key) = REQUIRED.into_iter().find(|it| !columns.contains_key(*it)) {
        return Err(missing(key, "there must be time_s and pci"));
    }
    if let Some(key) = missing_column(|name| columns.contains_key(name)) {
        return Err(missing(key, NEEDED));
    }
    let wanted = REQUIRED.into_iter().chain(OPTIONAL);
    let wanted: Vec<Option<&Vec<f64>>> = wanted.map(|name| columns.get(name)).collect();
    let rows = wanted.iter().flatten().map(|it| it.len()).max();
    let items = (0..rows.unwrap_or(0)).map(|row| {
        let value = |column: Option<&Vec<f64>>| column?.get(row).copied();
        let known = wanted.iter().map(|it| value(*it).filter(|it| !it.is_nan()));
        (row + 1, angle(&known.collect::<Vec<_>>()))
    });
    Ok(AngleLog::of_items("row", items))
}

/// Returns the name of a missing column that is required for angles and standard deviations.
fn missing_column(has: impl Fn(&str) -> bool) -> Option<&'static str> {
    let has_both = |column, sigma| has(column) && has(sigma);
    if has_both("phase_rad", "phase_sigma_rad") || has_both("angle_rad", "angle_sigma_rad") {
        None
    } else if has("phase_rad") {
        Some("phase_sigma_rad")
    } else if has("angle_rad") {
        Some("angle_sigma_rad")
    } else {
        Some("phase_rad")
    }
}

impl AngleLog {
    /// Creates a log from the numbered items of a file. Sorts the angles by time, and leaves out
    /// repeated ones; both is reported.
    fn of_items(
        kind: &'static str,
        items: impl Iterator<Item = (usize, Result<LoggedAngle, String>)>,
    ) -> Self {
        let mut log = Self::default();
        let mut numbered: Vec<(usize, LoggedAngle)> = Vec::new();
        for (line, read) in items {
            log.add(kind, line, read);
            numbered.extend(log.angles.get(numbered.len()).map(|it| (line, *it)));
        }
        log.angles.clear();
        let mut latest_s = f64::NEG_INFINITY;
        let mut unsorted = numbered.iter().filter(|(_, it)| {
            let is_early = it.ssb.time_s < latest_s - BURST_S;
            latest_s = latest_s.max(it.ssb.time_s);
            is_early
        });
        if let Some(&(line, first)) = unsorted.next() {
            let count = 1 + unsorted.count();
            log.remarks.push(AngleRemark {
                kind,
                line,
                is_used: true,
                time_s: first.ssb.time_s,
                message: format!(
                    "time_s {} is earlier than a previous time ({count} {kind}s in total); the \
                     angles were sorted by time",
                    first.ssb.time_s
                ),
            });
            numbered.sort_by(|(_, a), (_, b)| a.ssb.time_s.total_cmp(&b.ssb.time_s));
        }
        for (line, angle) in numbered {
            // Bit patterns, because a missing phase or angle is NaN.
            let bits =
                |it: &LoggedAngle| [it.measured.phase_rad, it.measured.angle_rad].map(f64::to_bits);
            let burst = log.angles.iter().rev();
            let mut burst = burst.take_while(|it| it.ssb.time_s == angle.ssb.time_s);
            let is_repeated = burst.any(|it| {
                it.ssb.pci == angle.ssb.pci
                    && it.ssb.ssb_index == angle.ssb.ssb_index
                    && it.measured.kind == angle.measured.kind
                    && bits(it) == bits(&angle)
            });
            if is_repeated {
                log.remarks.push(AngleRemark {
                    kind,
                    line,
                    is_used: false,
                    time_s: angle.ssb.time_s,
                    message: format!(
                        "pci {} has the same angle at {} s twice",
                        angle.ssb.pci, angle.ssb.time_s
                    ),
                });
            } else {
                log.angles.push(angle);
            }
        }
        log.remarks.sort_by_key(|it| it.line);
        log
    }

    /// Adds the angle of a line, or a remark with the reason of its omission.
    pub(crate) fn add(
        &mut self,
        kind: &'static str,
        line: usize,
        read: Result<LoggedAngle, String>,
    ) {
        match read {
            Ok(angle) => self.angles.push(angle),
            Err(message) => {
                let last = self.angles.last();
                self.remarks.push(AngleRemark {
                    kind,
                    line,
                    is_used: false,
                    time_s: last.map_or(f64::NEG_INFINITY, |last| last.measured.time_s),
                    message,
                });
            }
        }
    }
}

/// Returns the angle of the columns [`REQUIRED`] and [`OPTIONAL`], or the reason why there is none.
pub(crate) fn angle(values: &[Option<f64>]) -> Result<LoggedAngle, String> {
    let &[
        time_s,
        pci,
        ssb_index,
        phase_rad,
        phase_sigma_rad,
        angle_rad,
        angle_sigma_rad,
        snr_db,
        resolved,
        at_head,
    ] = values
    else {
        return Err("too few columns".to_owned());
    };
    let time_s = drive_time_s(time_s)?;
    let snr_db = finite(snr_db, "snr_db")?.unwrap_or(UNSTATED_SNR_DB);
    let angle_rad = finite(angle_rad, "angle_rad")?;
    let flag = |value: Option<f64>, name: &str, default: bool| match value {
        None => Ok(default),
        Some(1.0) => Ok(true),
        Some(0.0) => Ok(false),
        Some(value) => Err(format!("{name} {value} is neither 1 nor 0")),
    };
    let resolved = flag(resolved, "resolved", true)?;
    let kind = MeasurementKind::of_angle(flag(at_head, "at_head", false)?);
    // Without a phase, the standard deviation is that of the angle until the array's spacing is
    // known.
    let deviation = |value: Option<f64>, name: &str| match needed(value, name)? {
        value if value > 0.0 && value < MAX_SIGMA_RAD => Ok(value),
        value if value > 0.0 => Err(format!(
            "{name} {value} is too large for an angle; check its unit"
        )),
        value => Err(format!("{name} {value} is not above 0")),
    };
    let (phase_rad, phase_sigma_rad) = match (finite(phase_rad, "phase_rad")?, angle_rad) {
        (Some(phase_rad), _) => (phase_rad, deviation(phase_sigma_rad, "phase_sigma_rad")?),
        (None, Some(_)) => (f64::NAN, deviation(angle_sigma_rad, "angle_sigma_rad")?),
        (None, None) => return Err("phase_rad and angle_rad are both missing".to_owned()),
    };
    let angle_rad = angle_rad.unwrap_or(f64::NAN);
    let (pci, ssb_index) = radio_head(pci, ssb_index)?;
    Ok(LoggedAngle {
        ssb: SsbDetection {
            pci,
            ssb_index,
            time_s,
            snr_db,
        },
        measured: AngleMeasurement {
            kind,
            time_s,
            phase_rad,
            phase_sigma_rad,
            angle_rad,
            snr_db,
            resolved,
        },
    })
}

/// Writes an angle log in the format of [`read_angle_log`].
///
/// # Errors
/// [`RecordingError::Io`].
pub fn write_angle_log(file: &Path, angles: &[LoggedAngle]) -> Result<(), RecordingError> {
    let mut text = DEVIATIONS.to_owned() + &COLUMNS.join(",") + "\n";
    for LoggedAngle { ssb, measured } in angles {
        // Writing into a string does not fail.
        let _ = writeln!(
            text,
            "{},{},{},{},{},{},{},{},{}",
            measured.time_s,
            ssb.pci,
            ssb.ssb_index,
            measured.phase_rad,
            measured.phase_sigma_rad,
            measured.angle_rad,
            measured.snr_db,
            u8::from(measured.resolved),
            u8::from(measured.kind.is_at_head()),
        );
    }
    files::write(file, text.as_bytes())
}
