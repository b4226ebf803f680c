//! Log of an OpenAirInterface UE with delays of positioning reference signals (PRS), one delay per
//! line:
//!
//! ```text
//! [2023-09-28 16:51:52.173629] [gNB 0][rsc 0][Rx 0][sfn 645][slot 2] DL PRS ToA ==> -13.0 / 4096 samples, peak channel power -53.9 dBm, SNR 4.0 dB, rsrp -77.4 dBm
//! ```
//!
//! The number of the gNB is the `pci` of the radio head, and that of the PRS resource (`rsc`) is its
//! `ssb_index`. The sample rate is the FFT size (4096) times the subcarrier spacing. Times are those
//! of frames and slots since the first line; dates determine gaps of more than a cycle of the system
//! frame number (10.24 s).

use std::path::Path;

use onboard::range::RangeMeasurement;
use onboard::settings::SPEED_OF_LIGHT_MPS;

use crate::error::RecordingError;
use crate::file as files;
use crate::range_log::{LoggedRange, RangeLog};
use crate::sigmf::date::{Date, parse};

/// Text before the delay.
const DELAY: &str = "DL PRS ToA ==>";

/// Duration of a frame (s).
const FRAME_S: f64 = 0.01;
/// Duration of a cycle of the system frame number (s).
const CYCLE_S: f64 = 10.24;

/// Maximum decrease of the time between two lines (s): lines of slots are written by several threads.
const DISORDER_S: f64 = 0.1;

/// Line with a delay.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Line {
    date: Option<Date>,
    pci: u16,
    ssb_index: u8,
    /// System frame number.
    frame: f64,
    /// Slot in the frame.
    slot: f64,
    delay_samples: f64,
    fft_size: f64,
}

/// Whether a file is read as a log of OpenAirInterface: its name ends in `.log` or `.txt`.
pub fn is_prs_log(file: &Path) -> bool {
    let is = |extension: &str| {
        file.extension()
            .is_some_and(|it| it.eq_ignore_ascii_case(extension))
    };
    is("log") || is("txt")
}

/// Reads the delays of a log of OpenAirInterface, given the subcarrier spacing of the PRS.
///
/// # Errors
/// [`RecordingError`] if the file cannot be read, has no line with a delay, or contradicts the
/// subcarrier spacing. Invalid single lines are reported as remarks only.
pub fn read_prs_log(file: &Path, spacing_khz: f64) -> Result<RangeLog, RecordingError> {
    let bytes =
        files::read(file, files::MAX_BYTES).map_err(|source| RecordingError::io(file, source))?;
    let text = String::from_utf8_lossy(&bytes);
    let slots = (10.0 * spacing_khz / 15.0).round();
    let mut log = RangeLog {
        has_delays: true,
        ..RangeLog::default()
    };
    let mut clock = FrameClock::default();
    for (number, text) in text.lines().enumerate() {
        let Some((before, after)) = text.split_once(DELAY) else {
            continue;
        };
        let line = match line(before, after) {
            Ok(line) => line,
            Err(why) => {
                let text = format!("PRS log line {}: left out, {why}", number + 1);
                log.remarks.push((clock.time_s, text));
                continue;
            }
        };
        if line.slot >= slots {
            let key = format!("line {}: slot", number + 1);
            let allowed = format!(
                "a frame has {slots} slots with ssb.subcarrier_spacing_khz = {spacing_khz} of the site; \
                 set it to the subcarrier spacing of the PRS"
            );
            return Err(RecordingError::value(file, key, line.slot, allowed));
        }
        let time_s = clock.advance_to(FRAME_S * (line.frame + line.slot / slots), line.date);
        let sample_m = SPEED_OF_LIGHT_MPS / (line.fft_size * spacing_khz * 1e3);
        log.include_sample(sample_m);
        log.ranges.push(LoggedRange {
            pci: line.pci,
            ssb_index: line.ssb_index,
            measured: RangeMeasurement::range(time_s, sample_m * line.delay_samples, None),
        });
    }
    if log.ranges.is_empty() && log.remarks.is_empty() {
        return Err(RecordingError::Missing {
            file: file.display().to_string(),
            key: DELAY.to_owned(),
            allowed:
                "a .log or .txt file must be the log of an OpenAirInterface UE with PRS (log level \
                      info); name tables of ranges .csv"
                    .to_owned(),
        });
    }
    log.sort();
    Ok(log)
}

/// Time since the first line, from frames and slots.
#[derive(Debug, Default)]
struct FrameClock {
    time_s: f64,
    /// Time within the cycle, and date, of the last line.
    last: Option<(f64, Option<Date>)>,
}

impl FrameClock {
    fn advance_to(&mut self, cycle_s: f64, date: Option<Date>) -> f64 {
        if let Some((last_s, last_date)) = self.last {
            let mut step_s = (cycle_s - last_s).rem_euclid(CYCLE_S);
            if step_s > CYCLE_S - DISORDER_S {
                step_s -= CYCLE_S;
            }
            if let (Some(date), Some(before)) = (date, last_date) {
                let cycles = ((date.seconds_since(&before) - step_s) / CYCLE_S).round();
                step_s += CYCLE_S * cycles.max(0.0);
            }
            self.time_s += step_s;
        }
        self.last = Some((cycle_s, date));
        self.time_s
    }
}

/// Returns the line, or the reason why it contains no delay.
fn line(before: &str, after: &str) -> Result<Line, String> {
    let whole = |name: &str, most: u16| {
        let value = between(before, &format!("[{name} "), "]");
        let value = value.ok_or_else(|| format!("[{name} …] is missing"))?;
        match value.trim().parse::<u16>() {
            Ok(value) if value <= most => Ok(value),
            _ => Err(format!("{name} {value} is not an integer from 0 to {most}")),
        }
    };
    let number = |text: Option<&str>, name: &str| {
        let value = text.map_or(f64::NAN, |it| it.trim().parse().unwrap_or(f64::NAN));
        if value.is_finite() {
            Ok(value)
        } else {
            Err(format!("the {name} is not a number"))
        }
    };
    let (delay, rest) = after.split_once('/').ok_or("the FFT size is missing")?;
    let fft_size = number(rest.split("samples").next(), "FFT size")?;
    if !(64.0..=65_536.0).contains(&fft_size) {
        return Err(format!("the FFT size {fft_size} is not from 64 to 65536"));
    }
    // An empty channel estimate has no power, and its delay is arbitrary.
    number(between(rest, "channel power ", "dBm"), "peak channel power")?;
    Ok(Line {
        date: between(before, "[", "]").and_then(parse),
        pci: whole("gNB", 1007)?,
        ssb_index: whole("rsc", 63)? as u8,
        frame: f64::from(whole("sfn", 1023)?),
        slot: f64::from(whole("slot", 159)?),
        delay_samples: number(Some(delay), "delay")?,
        fft_size,
    })
}

/// Returns the text between two marks.
fn between<'a>(text: &'a str, from: &str, to: &str) -> Option<&'a str> {
    let (_, after) = text.split_once(from)?;
    after.split_once(to).map(|(inside, _)| inside)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(text: &str) -> Result<Line, String> {
        let (before, after) = text.split_once(DELAY).unwrap();
        line(before, after)
    }

    #[test]
    fn lines_of_several_versions_are_parsed() {
        let dated = parsed(
            "[2023-09-28 16:51:52.173629] [gNB 3][rsc 1][Rx 0][sfn 645][slot 5] DL PRS ToA ==> \
             -13.0 / 4096 samples, peak channel power -53.9 dBm, SNR -2622080.2 dB, rsrp -77.4 dBm",
        )
        .unwrap();
        assert_eq!((dated.pci, dated.ssb_index), (3, 1));
        assert_eq!((dated.frame, dated.slot), (645.0, 5.0));
        assert_eq!((dated.delay_samples, dated.fft_size), (-13.0, 4096.0));
        assert!(dated.date.is_some());
        let old = parsed(
            "[PHY]   [gNB 0][rsc 0][Rx 0][sfn 314][slot 2] DL PRS ToA ==> 1 / 1024 samples, peak \
             channel power 15.6 dBm, SNR +4 dB",
        )
        .unwrap();
        assert!(old.date.is_none() && (old.delay_samples - 1.0).abs() < 1e-12);
        let empty = parsed(
            "[PHY] [gNB 0][rsc 0][Rx 0][sfn 314][slot 2] DL PRS ToA ==> 1 / 1024 samples, peak \
             channel power -inf dBm, SNR +4 dB",
        );
        assert!(empty.unwrap_err().contains("power"));
    }

    #[test]
    fn frames_are_counted_beyond_a_cycle() {
        let mut clock = FrameClock::default();
        let date = |text: &str| parse(text);
        let at = |clock: &mut FrameClock, frame: f64, text: &str| {
            clock.advance_to(FRAME_S * frame, date(text))
        };
        assert!(at(&mut clock, 1000.0, "2023-09-28 16:00:00.000").abs() < 1e-9);
        // The system frame number wraps.
        let next_s = at(&mut clock, 6.0, "2023-09-28 16:00:00.310");
        assert!((next_s - 0.3).abs() < 1e-9, "{next_s}");
        // A line out of order.
        let back_s = at(&mut clock, 5.0, "2023-09-28 16:00:00.311");
        assert!((back_s - 0.29).abs() < 1e-9, "{back_s}");
        // Three cycles without a line, and one second.
        let gap_s = at(&mut clock, 105.0, "2023-09-28 16:00:32.000");
        assert!((gap_s - (0.29 + 31.72)).abs() < 1e-9, "{gap_s}");
    }
}
