//! Whether samples are of the type that their metadata states.
//!
//! Two 16-bit integers read as a 32-bit float have an exponent made of the upper bits of one of them: nearly all are
//! then tiny, huge or no numbers. Floats of a receiver are within a few decades of 1.

use super::samples::Datatype;

/// Bytes that are judged.
pub const JUDGED_BYTES: usize = 1 << 16;
/// Magnitudes of floats as receivers write them: from 1e-12 of full scale to 32-bit integers that were not scaled.
const USUAL: std::ops::Range<f32> = 1e-12..1e10;
/// Minimum number of values other than zero that are judged.
const LEAST_VALUES: usize = 64;
/// Share of usual magnitudes above which the values are floats, and below which they are not. Among random bits it is
/// 0.29, the share of the exponents.
const MOSTLY: f64 = 0.95;
const HARDLY: f64 = 0.5;

/// The type that the bytes probably are, if that is not the stated one.
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
    if all < LEAST_VALUES {
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

    /// Values of a linear congruential generator, evenly distributed in ±1.
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
    fn the_right_type_is_not_doubted() {
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
    fn integers_declared_as_floats_are_found() {
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
    fn silence_is_either() {
        for stated in [Datatype::Cf32Le, Datatype::Ci16Le] {
            assert_eq!(contradiction(stated, &[0; 4096]), None);
            assert_eq!(contradiction(stated, &[]), None);
        }
    }
}
