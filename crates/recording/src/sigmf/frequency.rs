//! Plausibility of a centre frequency.

/// Minimum centre frequency (Hz) with a margin: below band n31 of 5G NR.
const MIN_HZ: f64 = 400e6;
/// Maximum centre frequency (Hz) with a margin: above FR2-2, which ends at 71 GHz.
const MAX_HZ: f64 = 100e9;
/// Maximum NR-ARFCN (TS 38.104, 5.4.2.1).
const MAX_ARFCN: f64 = 3_279_165.0;

/// Checks that a centre frequency is used by 5G NR; 0 means unknown.
///
/// # Errors
/// Allowed range, and the probable meaning of the value.
pub fn check_centre_hz(hz: f64) -> Result<(), String> {
    if hz == 0.0 || (MIN_HZ..=MAX_HZ).contains(&hz) {
        return Ok(());
    }
    let range = "it must be in hertz, from 4e8 to 1e11, or 0 if it is unknown";
    let guesses = guesses(hz).join(" or ");
    Err(if guesses.is_empty() {
        range.to_owned()
    } else {
        format!("{range}; it is probably {guesses}")
    })
}

/// Returns the possible meanings of a value outside the range.
fn guesses(value: f64) -> Vec<String> {
    let mut guesses = Vec::new();
    if let Some(hz) = arfcn_hz(value).filter(|hz| (MIN_HZ..=MAX_HZ).contains(hz)) {
        guesses.push(format!("an NR-ARFCN ({hz:e} Hz)"));
    }
    for (unit, factor) in [("kHz", 1e3), ("MHz", 1e6), ("GHz", 1e9)] {
        let hz = value * factor;
        if (MIN_HZ..=MAX_HZ).contains(&hz) {
            guesses.push(format!("in {unit} ({hz:e} Hz)"));
        }
    }
    guesses
}

/// Returns the frequency of an NR-ARFCN (TS 38.104, table 5.4.2.1-1); `None` for a value outside
/// FR1 and FR2 or below 400 MHz.
fn arfcn_hz(value: f64) -> Option<f64> {
    if value.fract() != 0.0 || !(0.0..=MAX_ARFCN).contains(&value) {
        return None;
    }
    Some(if value < 600_000.0 {
        5e3 * value
    } else if value < 2_016_667.0 {
        3e9 + 15e3 * (value - 600_000.0)
    } else {
        24_250.08e6 + 60e3 * (value - 2_016_667.0)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frequencies_of_5g_are_accepted() {
        for hz in [0.0, 460e6, 617e6, 3.4896e9, 6e9, 26.5e9, 71e9] {
            assert_eq!(check_centre_hz(hz), Ok(()), "{hz}");
        }
    }

    #[test]
    fn other_units_are_recognised() {
        for (value, unit) in [
            (3489.6, "in MHz (3.4896e9 Hz)"),
            (3_489_600.0, "in kHz (3.4896e9 Hz)"),
            (3.4896, "in GHz (3.4896e9 Hz)"),
            (632_640.0, "an NR-ARFCN (3.4896e9 Hz)"),
            (2_079_427.0, "an NR-ARFCN (2.801568e10 Hz)"),
            (422_000.0, "an NR-ARFCN (2.11e9 Hz)"),
            (26_500.5, "in MHz (2.65005e10 Hz)"),
        ] {
            let error = check_centre_hz(value).unwrap_err();
            assert!(error.contains(unit), "{value}: {error}");
        }
        for value in [-3.5e9, 0.001, 3.5e12, f64::NAN, f64::INFINITY] {
            assert!(check_centre_hz(value).is_err(), "{value}");
        }
    }
}
