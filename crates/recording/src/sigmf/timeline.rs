//! Positions of captures in the stream of the receiver, from `core:global_index` or `core:datetime`.

use super::date;
use super::metadata::Capture;

/// Maximum difference between a date and the number of samples without a gap (s): one SSB period. Receivers stamp a
/// block of samples late by up to some milliseconds. Shorter gaps are detected by the times of the SSBs.
const STAMP_ERROR_S: f64 = 0.02;
/// Maximum relative error of the sample rate with respect to the clock of the dates.
const CLOCK_ERROR: f64 = 1e-4;

/// Position of a capture's first sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Position {
    /// Number of the sample since the start of the receiver.
    pub number: u64,
    /// Resolution of the two dates (s) that determine the gap before the capture; `None` if `core:global_index`
    /// determines it, or without a gap.
    pub gap_resolution_s: Option<f64>,
}

/// Value that contradicts the previous captures.
#[derive(Debug, Clone, PartialEq)]
pub struct Contradiction {
    /// Index of the capture.
    pub capture: usize,
    /// Key of the value.
    pub key: &'static str,
    pub found: String,
    pub allowed: String,
}

/// Returns the position of every capture. A capture without an index and without a date continues the previous one.
///
/// # Errors
/// [`Contradiction`] if an index or a date precedes the end of the previous capture, or if a date of one of several
/// captures is not ISO 8601.
pub fn positions(captures: &[Capture], rate_hz: f64) -> Result<Vec<Position>, Contradiction> {
    let mut positions: Vec<Position> = Vec::with_capacity(captures.len());
    // First sample in the file and its number, of the previous capture.
    let mut last: Option<(u64, u64)> = None;
    // Date of the last capture that has one, and the number of its first sample.
    let mut dated: Option<(date::Date, u64)> = None;
    for (index, capture) in captures.iter().enumerate() {
        let start = capture.sample_start;
        let expected = last.map_or(start, |(last_start, number)| {
            number.saturating_add(start.saturating_sub(last_start))
        });
        let wrong = |key, found: String, allowed: String| Contradiction {
            capture: index,
            key,
            found,
            allowed,
        };
        let date = match capture.datetime() {
            Some(text) if captures.len() > 1 => Some(date::parse(text).ok_or_else(|| {
                let allowed = "it must be ISO 8601, for example 2026-05-01T12:00:00.000000Z";
                wrong("core:datetime", format!("{text:?}"), allowed.to_owned())
            })?),
            _ => None,
        };
        let mut gap_resolution_s = None;
        let number = if let Some(number) = capture.global_index() {
            if last.is_some() && number < expected {
                let allowed = format!(
                    "it must be at least {expected}, by the captures and samples before it"
                );
                return Err(wrong("core:global_index", number.to_string(), allowed));
            }
            number
        } else if let (Some(date), Some((before, counted))) = (date, dated) {
            let samples_s = expected.saturating_sub(counted) as f64 / rate_hz;
            let excess_s = date.seconds_since(&before) - samples_s;
            let resolution_s = date.resolution_s().max(before.resolution_s());
            let tolerance_s = STAMP_ERROR_S + 2.0 * resolution_s + CLOCK_ERROR * samples_s;
            if excess_s < -tolerance_s {
                let allowed = format!(
                    "it is {:.3} s earlier than the end of the samples before it; correct the dates, or write \
                     core:global_index",
                    -excess_s
                );
                let text = capture.datetime().unwrap_or_default();
                return Err(wrong("core:datetime", text.to_owned(), allowed));
            }
            if excess_s > tolerance_s {
                gap_resolution_s = Some(resolution_s);
                expected.saturating_add((excess_s * rate_hz).round() as u64)
            } else {
                expected
            }
        } else {
            expected
        };
        last = Some((start, number));
        if let Some(date) = date {
            dated = Some((date, number));
        }
        positions.push(Position {
            number,
            gap_resolution_s,
        });
    }
    Ok(positions)
}

#[cfg(test)]
mod tests {
    use super::*;

    const RATE_HZ: f64 = 1e6;

    fn capture(sample_start: u64, key: &str, value: &str) -> Capture {
        let value = value
            .parse::<u64>()
            .map_or_else(|_| value.into(), Into::into);
        Capture {
            sample_start,
            other: [(key.to_owned(), value)].into_iter().collect(),
            ..Capture::default()
        }
    }

    fn dated(dates: &[(u64, &str)]) -> Result<Vec<(u64, Option<f64>)>, Contradiction> {
        let captures: Vec<Capture> = dates
            .iter()
            .map(|(start, date)| capture(*start, "core:datetime", date))
            .collect();
        let found = positions(&captures, RATE_HZ)?.into_iter();
        Ok(found.map(|it| (it.number, it.gap_resolution_s)).collect())
    }

    #[test]
    fn dates_determine_gaps() {
        let first = (0, "2026-05-01T23:59:59.000000Z");
        // One second of samples, then five seconds without any; midnight is between them.
        let gap = dated(&[first, (1_000_000, "2026-05-02T00:00:05.000000Z")]);
        assert_eq!(gap, Ok(vec![(0, None), (6_000_000, Some(1e-6))]));
        // Another notation of the same second, and a stamp that is 5 ms late.
        for next in ["2026-05-02T02:00:00+02:00", "2026-05-02T00:00:00.005Z"] {
            let none = dated(&[first, (1_000_000, next)]);
            assert_eq!(none, Ok(vec![(0, None), (1_000_000, None)]), "{next}");
        }
        // Dates in seconds do not determine a gap of 1.5 s.
        let coarse = [
            (0, "2026-05-01T12:00:00Z"),
            (1_000_000, "2026-05-01T12:00:02Z"),
        ];
        assert_eq!(dated(&coarse), Ok(vec![(0, None), (1_000_000, None)]));
    }

    #[test]
    fn contradictory_dates_are_rejected() {
        let first = (0, "2026-05-01T12:00:00Z");
        let early = dated(&[first, (9_000_000, "2026-05-01T12:00:01Z")]).unwrap_err();
        assert_eq!((early.capture, early.key), (1, "core:datetime"));
        assert!(early.allowed.contains("8.000 s earlier"), "{early:?}");
        let other = dated(&[first, (9, "1 May 2026")]).unwrap_err();
        assert!(other.allowed.contains("ISO 8601"), "{other:?}");
        // One capture cannot be compared with another.
        assert!(dated(&[(0, "1 May 2026")]).is_ok());
    }

    #[test]
    fn a_sample_index_takes_precedence_over_a_date() {
        let mut second = capture(100, "core:global_index", "100");
        let date = "2026-05-01T12:00:05Z".into();
        second.other.insert("core:datetime".to_owned(), date);
        let captures = [capture(0, "core:datetime", "2026-05-01T12:00:00Z"), second];
        assert_eq!(positions(&captures, RATE_HZ).unwrap()[1].number, 100);
        let back = [
            capture(0, "core:global_index", "50"),
            capture(100, "core:global_index", "149"),
        ];
        let error = positions(&back, RATE_HZ).unwrap_err();
        assert!(error.allowed.contains("at least 150"), "{error:?}");
    }
}
