//! Encoding of a complex sample in a data file.

use std::path::Path;

use num_complex::Complex32;

use crate::error::RecordingError;

/// Format of a complex sample, little-endian. The full scale of integers is one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Datatype {
    /// Two 32-bit floats.
    #[default]
    Cf32Le,
    /// Two 16-bit integers.
    Ci16Le,
}

impl Datatype {
    const ALL: [Self; 2] = [Self::Cf32Le, Self::Ci16Le];
    /// Integer value of 1.0 in `ci16_le`.
    const FULL_SCALE: f32 = 32768.0;

    /// Returns the name of the format in SigMF.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Cf32Le => "cf32_le",
            Self::Ci16Le => "ci16_le",
        }
    }

    /// Returns the number of bytes of one complex sample.
    pub const fn bytes(self) -> usize {
        match self {
            Self::Cf32Le => 8,
            Self::Ci16Le => 4,
        }
    }

    pub(super) fn from_name(name: &str, file: &Path) -> Result<Self, RecordingError> {
        Self::ALL
            .into_iter()
            .find(|datatype| datatype.name() == name)
            .ok_or_else(|| {
                let allowed = "it must be `cf32_le` or `ci16_le`";
                RecordingError::value(file, "global.core:datatype", format!("`{name}`"), allowed)
            })
    }

    /// Decodes the sample at the start of `bytes`; returns zero if there are too few bytes.
    pub(super) fn decode(self, bytes: &[u8]) -> Complex32 {
        match self {
            Self::Cf32Le => bytes.first_chunk::<8>().map_or(Complex32::ZERO, |b| {
                Complex32::new(
                    f32::from_le_bytes([b[0], b[1], b[2], b[3]]),
                    f32::from_le_bytes([b[4], b[5], b[6], b[7]]),
                )
            }),
            Self::Ci16Le => bytes.first_chunk::<4>().map_or(Complex32::ZERO, |b| {
                let part = |low, high| f32::from(i16::from_le_bytes([low, high]));
                Complex32::new(part(b[0], b[1]), part(b[2], b[3])) / Self::FULL_SCALE
            }),
        }
    }

    /// Appends a sample; integers are rounded and saturate at full scale.
    pub(super) fn encode(self, sample: Complex32, bytes: &mut Vec<u8>) {
        for part in [sample.re, sample.im] {
            match self {
                Self::Cf32Le => bytes.extend(part.to_le_bytes()),
                // A cast from float to integer saturates.
                Self::Ci16Le => {
                    bytes.extend(((part * Self::FULL_SCALE).round() as i16).to_le_bytes());
                }
            }
        }
    }
}
