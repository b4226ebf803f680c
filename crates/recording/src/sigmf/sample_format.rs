//! Check of the sample type against the metadata.
//!
//! If two 16-bit integers are read as a 32-bit float, the exponent consists of the upper bits of
//! one of them. Almost all values are then tiny, huge or NaN. Float samples of a receiver are
//! within a few decades of 1.

use super::samples::Datatype;

/// Number of bytes that are checked.
pub const JUDGED_BYTES: usize = 1 << 16;
/// Usual magnitudes of float samples: from 1e-12 of full scale to unscaled 32-bit integers.
const USUAL: std::ops::Range<f32> = 1e-12..1e10;
/// Minimum number of nonzero values for a check.
const MIN_VALUES: usize = 64;
/// Minimum fraction of usual magnitudes for floats. Random bits have a fraction of 0.29, that of
/// the exponents.
const MOSTLY: f64 = 0.95;
/// Maximum fraction of usual magnitudes for values that are not floats.
const HARDLY: f64 = 0.5;

/// Returns the probable type of the bytes if it differs from the type in the metadata.
pub fn contradiction(stated: Datatype, bytes: &[u8]) -> Option<Datatype> {
    let words = bytes
        .chunks_exact(4)
        .filter_map(|word| word.first_chunk::<4>());
    let floats = words
        .map(|word| f32::from_le_bytes(*word))
        .filter(|it| *it != 0.0);
    let (mut all, mut usual) = (0_usize, 0_usize);
    for value in floats {
        all += 1;
        usual += usize::from(USUAL.contains(&value.abs()));
    }
    if all < MIN_VALUES {
        return None;
    }
    let share = usual as f64 / all as f64;
    match stated {
        Datatype::Cf32Le if share < HARDLY => Some(Datatype::Ci16Le),
        Datatype::Ci16Le if share > MOSTLY => Some(Datatype::Cf32Le),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns uniformly distributed values in ±1 from a linear congruential generator.
    fn noise() -> impl Iterator<Item = f64> {
        let mut state = 1_u64;
        std::iter::repeat_with(move || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        })
    }

    #[test]
    fn the_correct_type_is_accepted() {
        for scale in [1e-6, 1e-3, 1.0, 2048.0, 32768.0] {
            let floats: Vec<u8> = noise()
                .take(4096)
                .flat_map(|it| ((scale * it) as f32).to_le_bytes())
                .collect();
            assert_eq!(contradiction(Datatype::Cf32Le, &floats), None, "{scale}");
            assert_eq!(
                contradiction(Datatype::Ci16Le, &floats),
                Some(Datatype::Cf32Le),
                "{scale}"
            );
        }
    }

    #[test]
    fn integers_declared_as_floats_are_detected() {
        for scale in [3.0, 20.0, 300.0, 2048.0, 32767.0] {
            let integers: Vec<u8> = noise()
                .take(4096)
                .flat_map(|it| ((scale * it) as i16).to_le_bytes())
                .collect();
            assert_eq!(
                contradiction(Datatype::Cf32Le, &integers),
                Some(Datatype::Ci16Le),
                "{scale}"
            );
            assert_eq!(contradiction(Datatype::Ci16Le, &integers), None, "{scale}");
        }
    }

    #[test]
    fn zero_samples_match_any_type() {
        for stated in [Datatype::Cf32Le, Datatype::Ci16Le] {
            assert_eq!(contradiction(stated, &[0; 4096]), None);
            assert_eq!(contradiction(stated, &[]), None);
        }
    }
}
