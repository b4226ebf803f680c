//! Dates of ISO 8601, as in `core:datetime`.

const NS_PER_S: i128 = 1_000_000_000;

/// Date with its resolution.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Date {
    /// Time since 1970-01-01T00:00:00Z in nanoseconds.
    pub ns: i128,
    /// Unit of the last digit in nanoseconds.
    pub resolution_ns: i128,
}

impl Date {
    /// Returns the time since another date in seconds.
    pub fn seconds_since(&self, other: &Self) -> f64 {
        (self.ns - other.ns) as f64 / 1e9
    }

    /// Returns the unit of the last digit in seconds.
    pub fn resolution_s(&self) -> f64 {
        self.resolution_ns as f64 / 1e9
    }
}

/// Parses `YYYY-MM-DDTHH:MM:SS`, with an optional fraction of the second, and `Z`, an offset (`+02:00`) or nothing (UTC)
/// at the end. Returns `None` for another notation.
pub fn parse(text: &str) -> Option<Date> {
    let text = text.trim();
    let (day, time) = text.split_once(['T', 't', ' '])?;
    let [year, month, day_of_month] = numbers(day, '-')?;
    let is_day = year <= 9999 && (1..=12).contains(&month) && (1..=31).contains(&day_of_month);
    let (time, offset_s) = split_offset(time)?;
    let (clock, fraction) = time.split_once(['.', ',']).unwrap_or((time, ""));
    let [hour, minute, second] = numbers(clock, ':')?;
    // 60 is a leap second.
    if !is_day || hour > 23 || minute > 59 || second > 60 || fraction.len() > 18 {
        return None;
    }
    let digits = u32::try_from(fraction.len()).ok()?;
    let fraction = match fraction {
        "" => 0,
        some => unsigned(some)?,
    };
    let seconds = days(year, month, day_of_month) * 86_400 + hour * 3600 + minute * 60 + second;
    let seconds = seconds - offset_s;
    let unit = 10_i128.pow(digits);
    Some(Date {
        ns: seconds * NS_PER_S + fraction * NS_PER_S / unit,
        resolution_ns: (NS_PER_S / unit).max(1),
    })
}

/// Splits a time of day from its offset to UTC in seconds.
fn split_offset(time: &str) -> Option<(&str, i128)> {
    if let Some(time) = time.strip_suffix(['Z', 'z']) {
        return Some((time, 0));
    }
    let Some(at) = time.find(['+', '-']) else {
        return Some((time, 0));
    };
    let (time, offset) = time.split_at(at);
    let sign = if offset.starts_with('-') { -1 } else { 1 };
    let digits: String = offset.chars().filter(char::is_ascii_digit).collect();
    let (hours, minutes) = match digits.len() {
        2 => (unsigned(&digits)?, 0),
        4 => (unsigned(digits.get(..2)?)?, unsigned(digits.get(2..)?)?),
        _ => return None,
    };
    Some((time, sign * (hours * 3600 + minutes * 60)))
}

fn numbers(text: &str, separator: char) -> Option<[i128; 3]> {
    let found: Option<Vec<i128>> = text.split(separator).map(unsigned).collect();
    found?.try_into().ok()
}

fn unsigned(digits: &str) -> Option<i128> {
    let is_number = !digits.is_empty() && digits.bytes().all(|it| it.is_ascii_digit());
    is_number.then(|| digits.parse().ok())?
}

/// Returns the days from 1970-01-01 to a date of the Gregorian calendar (Hinnant, `days_from_civil`).
fn days(year: i128, month: i128, day: i128) -> i128 {
    let year = if month <= 2 { year - 1 } else { year };
    let era = year.div_euclid(400);
    let year_of_era = year - era * 400;
    let day_of_year = (153 * ((month + 9) % 12) + 2) / 5 + day - 1;
    let day_of_era = year_of_era * 365 + year_of_era / 4 - year_of_era / 100 + day_of_year;
    era * 146_097 + day_of_era - 719_468
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_are_seconds_since_1970() {
        // The expected values are from `date -u -d TEXT +%s`.
        for (text, seconds) in [
            ("1970-01-01T00:00:00Z", 0),
            ("2000-02-29T12:00:00Z", 951_825_600),
            ("2026-05-01T12:00:00Z", 1_777_636_800),
            ("2026-05-01 14:00:00+02:00", 1_777_636_800),
            ("2026-05-01T08:30:00-0330", 1_777_636_800),
            ("1969-12-31T23:59:59", -1),
        ] {
            let date = parse(text).unwrap();
            assert_eq!(date.ns, seconds * NS_PER_S, "{text}");
            assert_eq!(date.resolution_ns, NS_PER_S, "{text}");
        }
        let date = parse("2026-05-01T12:00:00.125Z").unwrap();
        assert_eq!(date.ns, 1_777_636_800_125_000_000);
        assert_eq!(date.resolution_ns, 1_000_000);
    }

    #[test]
    fn other_notations_are_not_dates() {
        for text in [
            "",
            "now",
            "2026-05-01",
            "2026-13-01T00:00:00Z",
            "2026-05-01T24:00:00Z",
            "2026-05-01T12:00Z",
            "1777636800",
            "99999999999999999999999999999999-01-01T00:00:00Z",
            "2026-05-01T12:00:-1Z",
            "2026-05-01T12:00:00.1234567890123456789Z",
        ] {
            assert_eq!(parse(text), None, "{text}");
        }
    }
}
