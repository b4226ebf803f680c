//! Diagnosis of recorded channels before processing.

use num_complex::Complex32;

use crate::numeric::decibel::decibel;

/// Minimum fraction of samples at the maximum amplitude of a component for a clipped channel. Noise
/// reaches its maximum once.
const CLIPPED_SHARE: f64 = 1e-3;
/// Maximum power of a silent channel: −140 dBFS, far below the resolution of any converter.
const SILENT_DBFS: f64 = -140.0;
/// Minimum power difference from the strongest channel for a dead channel, in dB.
const WEAK_DB: f64 = 40.0;
/// Minimum magnitude of the correlation coefficient of identical channels. Two antennas of one
/// strong plane wave are below it, because their noise is independent.
const DUPLICATE_CORRELATION: f64 = 1.0 - 1e-9;

/// Fault of a channel.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Fault {
    /// Samples that are not finite; the receiver replaces them by zero.
    NotFinite {
        /// Number of these samples.
        samples: usize,
    },
    /// No signal.
    Silent,
    /// Power far below that of the strongest channel.
    Weak {
        /// Difference in dB.
        below_strongest_db: f64,
    },
    /// Many samples at the maximum amplitude.
    Clipped {
        /// Fraction of samples.
        share: f64,
    },
    /// Samples identical to those of another channel, up to a constant factor.
    Duplicate {
        /// Index of the other channel, which is lower.
        of: usize,
    },
}

/// Diagnosis of one channel.
#[derive(Debug, Clone, PartialEq)]
pub struct ChannelDiagnosis {
    /// Mean power; 0 dB for a tone of amplitude one.
    pub power_dbfs: f64,
    /// Faults; empty for a healthy channel.
    pub faults: Vec<Fault>,
}

/// Diagnoses every channel of a recording.
pub fn diagnose(channels: &[&[Complex32]]) -> Vec<ChannelDiagnosis> {
    let powers: Vec<f64> = channels.iter().map(|samples| power_dbfs(samples)).collect();
    let strongest = powers.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let diagnosis = |(index, samples): (usize, &&[Complex32])| {
        let mut faults = Vec::new();
        let not_finite = samples.iter().filter(|x| !x.is_finite()).count();
        if not_finite > 0 {
            faults.push(Fault::NotFinite {
                samples: not_finite,
            });
        }
        let below_strongest_db = strongest - powers[index];
        if powers[index] < SILENT_DBFS {
            faults.push(Fault::Silent);
        } else {
            if below_strongest_db > WEAK_DB {
                faults.push(Fault::Weak { below_strongest_db });
            }
            let share = share_at_largest(samples);
            if share > CLIPPED_SHARE {
                faults.push(Fault::Clipped { share });
            }
            let duplicate =
                |other: &&[Complex32]| correlation(samples, other) > DUPLICATE_CORRELATION;
            if let Some(of) = channels[..index].iter().position(duplicate) {
                faults.push(Fault::Duplicate { of });
            }
        }
        ChannelDiagnosis {
            power_dbfs: powers[index],
            faults,
        }
    };
    channels.iter().enumerate().map(diagnosis).collect()
}

fn finite(samples: &[Complex32]) -> impl Iterator<Item = &Complex32> {
    samples.iter().filter(|x| x.is_finite())
}

fn power_dbfs(samples: &[Complex32]) -> f64 {
    let energy: f64 = finite(samples).copied().map(power).sum();
    decibel(energy / samples.len().max(1) as f64)
}

/// Returns the fraction of samples with a component within a thousandth of the maximum.
fn share_at_largest(samples: &[Complex32]) -> f64 {
    let reach = |x: &Complex32| x.re.abs().max(x.im.abs());
    let largest = finite(samples).map(reach).fold(0.0, f32::max);
    let near = finite(samples)
        .filter(|x| reach(x) > 0.999 * largest)
        .count();
    // A few samples always are: the maximum itself, and equal values in a recording of small
    // integers.
    near.saturating_sub(8) as f64 / samples.len().max(1) as f64
}

/// Returns the magnitude of the correlation coefficient.
fn correlation(a: &[Complex32], b: &[Complex32]) -> f64 {
    let (mut re, mut im, mut energy_a, mut energy_b) = (0.0, 0.0, 0.0, 0.0);
    for (x, y) in a
        .iter()
        .zip(b)
        .filter(|(x, y)| x.is_finite() && y.is_finite())
    {
        re += f64::from(x.re) * f64::from(y.re) + f64::from(x.im) * f64::from(y.im);
        im += f64::from(x.im) * f64::from(y.re) - f64::from(x.re) * f64::from(y.im);
        energy_a += power(*x);
        energy_b += power(*y);
    }
    let scale = (energy_a * energy_b).sqrt();
    if scale > 0.0 {
        (re * re + im * im).sqrt() / scale
    } else {
        0.0
    }
}

fn power(x: Complex32) -> f64 {
    f64::from(x.re) * f64::from(x.re) + f64::from(x.im) * f64::from(x.im)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::noise::noise;

    #[test]
    fn every_fault_is_reported_and_healthy_channels_have_none() {
        let healthy = noise(1, 4000);
        let mut broken = noise(2, 4000);
        broken[7].re = f32::NAN;
        let silent = vec![Complex32::ZERO; 4000];
        let weak: Vec<_> = noise(3, 4000).iter().map(|x| x * 1e-3).collect();
        let limit = |x: f32| x.clamp(-0.5, 0.5);
        let clipped: Vec<_> = noise(4, 4000)
            .iter()
            .map(|x| Complex32::new(limit(x.re), limit(x.im)))
            .collect();
        let duplicate: Vec<_> = healthy
            .iter()
            .map(|x| x * Complex32::new(0.0, 2.0))
            .collect();
        let found = diagnose(&[&healthy, &broken, &silent, &weak, &clipped, &duplicate]);
        assert!(found[0].faults.is_empty(), "{found:?}");
        assert_eq!(found[1].faults, [Fault::NotFinite { samples: 1 }]);
        assert_eq!(found[2].faults, [Fault::Silent]);
        assert!(
            matches!(found[3].faults[..], [Fault::Weak { below_strongest_db }] if below_strongest_db > 55.0)
        );
        assert!(matches!(found[4].faults[..], [Fault::Clipped { share }] if share > 0.01));
        assert_eq!(found[5].faults, [Fault::Duplicate { of: 0 }]);
        assert!(diagnose(&[]).is_empty());
        assert_eq!(diagnose(&[&[]])[0].faults, [Fault::Silent]);
    }
}
