//! Angles of arrival that some receiver has already estimated, one per line.
//!
//! Columns: `time_s`, `pci` and either `phase_rad` (electrical angle ω = 2π(d/λ)·cos θ) with its
//! standard deviation `phase_sigma_rad`, or `angle_rad` (θ from the array's axis) with
//! `angle_sigma_rad`; where both are given the former counts. `ssb_index` (0 without) and `snr_db`
//! need not be there.

use std::fmt;
use std::fmt::Write as _;
use std::path::Path;

use crate::error::RecordingError;
use crate::file as files;
use crate::table::Table;
use onboard::localize::AngleMeasurement;
use onboard::observation::SensedSsb;

const COLUMNS: [&str; 7] = [
    "time_s",
    "pci",
    "ssb_index",
    "phase_rad",
    "phase_sigma_rad",
    "angle_rad",
    "snr_db",
];

/// Columns that every log has, and those of which some may be missing.
const REQUIRED: [&str; 2] = ["time_s", "pci"];
const OPTIONAL: [&str; 6] = [
    "ssb_index",
    "phase_rad",
    "phase_sigma_rad",
    "angle_rad",
    "angle_sigma_rad",
    "snr_db",
];

/// Standard deviation of an angle of which nothing is known, π/√3 (rad).
const MOST_SIGMA_RAD: f64 = 1.813_799_364_234_217_8;

/// SNR (dB) of an angle of which none is stated: good enough for any policy.
const UNSTATED_SNR_DB: f64 = 20.0;

/// One angle and the SSB it came from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoggedAngle {
    /// Cell, beam, time and strength.
    pub ssb: SensedSsb,
    /// The angle.
    pub measured: AngleMeasurement,
}

/// The usable angles of a file, in its order, and the lines left out.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct AngleLog {
    /// The angles.
    pub angles: Vec<LoggedAngle>,
    /// What was left out and why.
    pub remarks: Vec<AngleRemark>,
}

/// A line of an angle log that was left out.
#[derive(Debug, Clone, PartialEq)]
pub struct AngleRemark {
    /// Line in the file, from 1.
    pub line: usize,
    /// Time of the last usable angle before it, in seconds.
    pub time_s: f64,
    /// Why.
    pub message: String,
}

impl fmt::Display for AngleRemark {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "angle log line {}: left out, {}",
            self.line, self.message
        )
    }
}

/// Reads an angle log.
///
/// # Errors
/// [`RecordingError`] when the file cannot be read or lacks a column. Single lines are only
/// remarked upon.
pub fn read_angle_log(file: &Path) -> Result<AngleLog, RecordingError> {
    let mut log = AngleLog::default();
    let table = Table::read(file, &REQUIRED, &OPTIONAL)?;
    let told = |column, sigma| table.has(column) && table.has(sigma);
    if !told("phase_rad", "phase_sigma_rad") && !told("angle_rad", "angle_sigma_rad") {
        let key = if table.has("phase_rad") {
            "phase_sigma_rad"
        } else if table.has("angle_rad") {
            "angle_sigma_rad"
        } else {
            "phase_rad"
        };
        let allowed = "the first line must name phase_rad and phase_sigma_rad, or angle_rad and \
                       angle_sigma_rad";
        return Err(table.missing(key, allowed));
    }
    for row in table.rows {
        match row.values.and_then(|values| angle(&values)) {
            Ok(angle) => log.angles.push(angle),
            Err(message) => log.remarks.push(AngleRemark {
                line: row.line,
                time_s: log
                    .angles
                    .last()
                    .map_or(f64::NEG_INFINITY, |last| last.measured.time_s),
                message,
            }),
        }
    }
    Ok(log)
}

fn angle(values: &[Option<f64>]) -> Result<LoggedAngle, String> {
    let &[
        time_s,
        pci,
        ssb_index,
        phase_rad,
        phase_sigma_rad,
        angle_rad,
        angle_sigma_rad,
        snr_db,
    ] = values
    else {
        return Err("too few columns".to_owned());
    };
    let finite = |value: Option<f64>, name: &str| match value {
        Some(value) if !value.is_finite() => Err(format!("{name} is not finite")),
        value => Ok(value),
    };
    let needed = |value: Option<f64>, name: &str| {
        finite(value, name)?.ok_or_else(|| format!("{name} is missing"))
    };
    let (time_s, pci) = (needed(time_s, "time_s")?, needed(pci, "pci")?);
    let ssb_index = finite(ssb_index, "ssb_index")?.unwrap_or(0.0);
    let snr_db = finite(snr_db, "snr_db")?.unwrap_or(UNSTATED_SNR_DB);
    let angle_rad = finite(angle_rad, "angle_rad")?;
    // Without a phase the deviation is that of the angle, until the array's spacing is known.
    let deviation = |value: Option<f64>, name: &str| match needed(value, name)? {
        value if value > 0.0 && value < MOST_SIGMA_RAD => Ok(value),
        value if value > 0.0 => Err(format!(
            "{name} {value} says nothing of an angle; check its unit"
        )),
        value => Err(format!("{name} {value} is not above 0")),
    };
    let (phase_rad, phase_sigma_rad) = match (finite(phase_rad, "phase_rad")?, angle_rad) {
        (Some(phase_rad), _) => (phase_rad, deviation(phase_sigma_rad, "phase_sigma_rad")?),
        (None, Some(_)) => (f64::NAN, deviation(angle_sigma_rad, "angle_sigma_rad")?),
        (None, None) => return Err("neither phase_rad nor angle_rad is there".to_owned()),
    };
    let angle_rad = angle_rad.unwrap_or(f64::NAN);
    let whole = |value: f64, most: f64| value.fract() == 0.0 && (0.0..=most).contains(&value);
    if !whole(pci, 1007.0) {
        return Err(format!("pci {pci} is not an integer from 0 to 1007"));
    }
    if !whole(ssb_index, 63.0) {
        return Err(format!(
            "ssb_index {ssb_index} is not an integer from 0 to 63"
        ));
    }
    let (pci, ssb_index) = (pci as u16, ssb_index as u8);
    Ok(LoggedAngle {
        ssb: SensedSsb {
            pci,
            ssb_index,
            time_s,
            snr_db,
        },
        measured: AngleMeasurement {
            time_s,
            phase_rad,
            phase_sigma_rad,
            angle_rad,
            snr_db,
            resolved: true,
        },
    })
}

/// Writes an angle log as [`read_angle_log`] reads it.
///
/// # Errors
/// [`RecordingError::Io`].
pub fn write_angle_log(file: &Path, angles: &[LoggedAngle]) -> Result<(), RecordingError> {
    let mut text = COLUMNS.join(",") + "\n";
    for LoggedAngle { ssb, measured } in angles {
        // Writing into a string does not fail.
        let _ = writeln!(
            text,
            "{},{},{},{},{},{},{}",
            measured.time_s,
            ssb.pci,
            ssb.ssb_index,
            measured.phase_rad,
            measured.phase_sigma_rad,
            measured.angle_rad,
            measured.snr_db,
        );
    }
    files::write(file, text.as_bytes())
}
