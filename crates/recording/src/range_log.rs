//! Log of ranges to radio heads, one range per line.
//!
//! Columns: `time_s`, `pci` and either `range_m` (two-way range, or a pseudorange in metres),
//! `delay_ns` (one-way delay by the clocks of vehicle and radio head) or `delay_samples` with
//! `sample_rate_hz`. Optional columns are `ssb_index` (default 0) and the standard deviation of the
//! noise, `sigma_m` or `delay_sigma_ns` (default: `ranging.sigma_m` of the vehicle; half a sample with
//! `delay_samples`).

use std::path::Path;

use onboard::range::{METRES_PER_NS, RangeMeasurement};
use onboard::settings::SPEED_OF_LIGHT_MPS;

use crate::error::RecordingError;
use crate::table::{Table, drive_time_s, needed, radio_head};

const REQUIRED: [&str; 2] = ["time_s", "pci"];
const OPTIONAL: [&str; 7] = [
    "ssb_index",
    "range_m",
    "sigma_m",
    "delay_ns",
    "delay_sigma_ns",
    "delay_samples",
    "sample_rate_hz",
];

/// Columns with ranges, of which a log has one.
const RANGES: [&str; 3] = ["range_m", "delay_ns", "delay_samples"];

/// Allowed sample rates (Hz).
const SAMPLE_RATES_HZ: std::ops::RangeInclusive<f64> = 1e5..=1e11;

/// Maximum distance of a range (m).
const MAX_RANGE_M: f64 = 1e7;

/// Delay (ns) below which a whole log of delays is in seconds: a delay of 10 km is 3e-5 s.
const MIN_DELAY_NS: f64 = 1e-3;

/// Range with its radio head.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoggedRange {
    /// Physical cell identity of the radio head.
    pub pci: u16,
    /// SSB index of the radio head.
    pub ssb_index: u8,
    /// The range.
    pub measured: RangeMeasurement,
}

/// Usable ranges of a file in order of time, and remarks on the omitted lines.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RangeLog {
    /// The ranges.
    pub ranges: Vec<LoggedRange>,
    /// Whether the log has one-way delays instead of ranges (`range_m`).
    pub has_delays: bool,
    /// Whether each range has its own standard deviation.
    pub has_sigma: bool,
    /// Distance that light travels during a sample (m), if the delays are in samples.
    pub sample_m: Option<f64>,
    /// Remarks on the omitted lines: time of the previous usable range, and text.
    pub remarks: Vec<(f64, String)>,
}

impl RangeLog {
    /// Includes the length of a sample (m) of a delay: the largest one counts.
    pub(crate) fn include_sample(&mut self, sample_m: f64) {
        self.sample_m = Some(self.sample_m.unwrap_or(0.0).max(sample_m));
    }

    /// Sorts the ranges by time, and reports decreasing times.
    pub(crate) fn sort(&mut self) {
        let time_s = |it: &LoggedRange| it.measured.time_s;
        let pairs = || self.ranges.windows(2);
        let falls = |pair: &&[LoggedRange]| matches!(pair, [one, two] if time_s(two) < time_s(one));
        if let Some([before, after]) = pairs().find(falls) {
            let text = format!(
                "range log: time_s decreases {} times, first from {} to {} s; the ranges were sorted",
                pairs().filter(falls).count(),
                time_s(before),
                time_s(after)
            );
            self.remarks.push((time_s(after), text));
        }
        self.ranges
            .sort_by(|one, other| time_s(one).total_cmp(&time_s(other)));
    }
}

/// Whether the header of a table has a column of ranges, so that the table is a range log.
///
/// # Errors
/// [`RecordingError`] if the file cannot be read.
pub fn is_range_log(file: &Path) -> Result<bool, RecordingError> {
    let table = Table::read(file, &[], &OPTIONAL)?;
    Ok(RANGES.iter().any(|name| table.has(name)))
}

/// Reads a range log.
///
/// # Errors
/// [`RecordingError`] if the file cannot be read, lacks a column, or has delays in seconds. Invalid
/// single lines and a decreasing time are reported as remarks only.
pub fn read_range_log(file: &Path) -> Result<RangeLog, RecordingError> {
    let table = Table::read(file, &REQUIRED, &OPTIONAL)?;
    let mut given = RANGES.into_iter().filter(|name| table.has(name));
    let (Some(kind), None) = (given.next(), given.next()) else {
        let allowed = "there must be one of range_m, delay_ns and delay_samples";
        return Err(table.missing("range_m", allowed));
    };
    if kind == "delay_samples" && !table.has("sample_rate_hz") {
        let allowed = "delay_samples needs the column sample_rate_hz, for example 122.88e6";
        return Err(table.missing("sample_rate_hz", allowed));
    }
    let has_delays = kind != "range_m";
    let sigma = if has_delays {
        "delay_sigma_ns"
    } else {
        "sigma_m"
    };
    let mut log = RangeLog {
        has_delays,
        has_sigma: table.has(sigma),
        ..RangeLog::default()
    };
    for row in table.rows {
        match row.values.and_then(|values| range(&values, kind)) {
            Ok((range, sample_m)) => {
                log.ranges.push(range);
                if kind == "delay_samples" {
                    log.include_sample(sample_m);
                }
            }
            Err(why) => {
                let last = log.ranges.last();
                let last_s = last.map_or(f64::NEG_INFINITY, |it| it.measured.time_s);
                let text = format!("range log line {}: left out, {why}", row.line);
                log.remarks.push((last_s, text));
            }
        }
    }
    log.sort();
    let delays_ns = || (log.ranges.iter()).map(|it| it.measured.value.abs() / METRES_PER_NS);
    let is_of_seconds = delays_ns().all(|ns| ns < MIN_DELAY_NS) && delays_ns().any(|ns| ns > 0.0);
    if kind == "delay_ns" && is_of_seconds {
        let most = delays_ns().fold(0.0, f64::max);
        let allowed = "delays must be in nanoseconds, and these are probably in seconds: multiply \
                       them by 1e9";
        return Err(RecordingError::value(file, "delay_ns", most, allowed));
    }
    Ok(log)
}

/// Returns the range of the columns [`REQUIRED`] and [`OPTIONAL`] and the length of a sample (m), or the
/// reason why there is none.
fn range(values: &[Option<f64>], kind: &str) -> Result<(LoggedRange, f64), String> {
    let &[
        time_s,
        pci,
        ssb_index,
        range_m,
        sigma_m,
        delay_ns,
        delay_sigma_ns,
        delay_samples,
        sample_rate_hz,
    ] = values
    else {
        return Err("too few columns".to_owned());
    };
    let time_s = drive_time_s(time_s)?;
    let (pci, ssb_index) = radio_head(pci, ssb_index)?;
    let ns = METRES_PER_NS;
    let (value, metres, sigma, sigma_metres, sigma_name) = match kind {
        "range_m" => (range_m, 1.0, sigma_m, 1.0, "sigma_m"),
        "delay_ns" => (delay_ns, ns, delay_sigma_ns, ns, "delay_sigma_ns"),
        _ => {
            let rate_hz = needed(sample_rate_hz, "sample_rate_hz")?;
            if !SAMPLE_RATES_HZ.contains(&rate_hz) {
                return Err(format!(
                    "sample_rate_hz {rate_hz} is not from 1e5 to 1e11; it must be in hertz"
                ));
            }
            let sample_m = SPEED_OF_LIGHT_MPS / rate_hz;
            (
                delay_samples,
                sample_m,
                delay_sigma_ns,
                ns,
                "delay_sigma_ns",
            )
        }
    };
    let range_m = metres * needed(value, kind)?;
    if range_m.abs() > MAX_RANGE_M {
        return Err(format!("{kind} is above {MAX_RANGE_M:e} m; check its unit"));
    }
    let sigma_m = match sigma {
        Some(sigma) if sigma > 0.0 && sigma.is_finite() => Some(sigma_metres * sigma),
        Some(sigma) => return Err(format!("{sigma_name} {sigma} is not above 0")),
        None => None,
    };
    let range = LoggedRange {
        pci,
        ssb_index,
        measured: RangeMeasurement::range(time_s, range_m, sigma_m),
    };
    Ok((range, metres))
}
