//! Carrier frequency offset (CFO): a coarse estimate within symbols, and a fine one from the phase
//! between symbols.
//!
//! Symbol `l` of an SSB at its own centre frequency contains `exp(−j2π f_SSB t_l)` in addition to
//! the offset, because the transmitter resets its carrier phase at each symbol (TS 38.211 §5.4).
//! Estimates within one symbol (cyclic prefix and its copy, both halves of the PSS) do not depend
//! on this phase. The far more precise phase step between symbols does, and requires the absolute
//! frequency of the SSB.

use std::f64::consts::TAU;

use num_complex::{Complex32, Complex64};

use super::base_rate::{CYCLIC_PREFIX, SYMBOL_FFT, SYMBOL_SAMPLES};
use crate::numeric::phasors::{fill_phasors, wrap};
use crate::standard::grid::SYMBOLS;

/// Returns the coarse offset in cycles per sample, of an SSB whose PSS begins at `start`. It is the
/// mean of the cyclic-prefix estimate (unambiguous within ± half a subcarrier) and the estimate
/// from the two halves of the PSS (± one subcarrier), which also resolves the ambiguity of the
/// first. `pss` is the PSS in the time domain, `hypothesis_cycles` the offset of its detection.
pub(crate) fn coarse<S: AsRef<[Complex32]>>(
    antennas: &[S],
    start: usize,
    pss: &[Complex32],
    hypothesis_cycles: f64,
) -> f64 {
    const HALF: usize = SYMBOL_FFT / 2;
    let mut reference = [Complex32::ZERO; SYMBOL_FFT];
    fill_phasors(&mut reference, 0.0, hypothesis_cycles);
    for (phasor, chip) in reference.iter_mut().zip(pss) {
        *phasor *= chip;
    }
    let mut halves = Complex64::ZERO;
    let mut prefix = Complex64::ZERO;
    for samples in antennas {
        let Some(symbol) = samples.as_ref().get(start..start + SYMBOL_FFT) else {
            continue;
        };
        let first = correlate(&reference[..HALF], &symbol[..HALF]);
        let second = correlate(&reference[HALF..], &symbol[HALF..]);
        halves += widen(first.conj() * second);
        for symbol in 0..SYMBOLS {
            let end = start + symbol * SYMBOL_SAMPLES;
            let (Some(begin), Some(copy)) = (
                end.checked_sub(CYCLIC_PREFIX),
                samples.as_ref().get(end + SYMBOL_FFT - CYCLIC_PREFIX..),
            ) else {
                continue;
            };
            let Some(copy) = copy.get(..CYCLIC_PREFIX) else {
                continue;
            };
            prefix += widen(correlate(&samples.as_ref()[begin..end], copy));
        }
    }
    let from_halves = hypothesis_cycles + halves.arg() / (TAU * HALF as f64);
    let spacing = 1.0 / SYMBOL_FFT as f64;
    let from_prefix = prefix.arg() / TAU * spacing;
    let alias = ((from_halves - from_prefix) / spacing).round();
    0.5 * (from_halves + from_prefix + alias * spacing)
}

/// Returns the phase step per symbol in radians, from the correlations `r[l][m]` of symbols `l` and
/// `m`.
///
/// It is the phase between PSS and SSS (distance 2, 127 elements each). All pairs together,
/// `max Re Σ r[l][m] exp(−jθ(m−l))`, resolve its ambiguity. (A weighted estimate from all pairs is
/// hardly more precise in noise, and differs by 10 Hz from the offset of other receivers under
/// oscillator phase noise.)
pub(crate) fn symbol_phase_step(pairs: &SymbolPairs) -> f64 {
    const GRID: usize = 32;
    let value = |step: f64| -> f64 {
        let mut sum = 0.0;
        for (early, row) in pairs.iter().enumerate() {
            for (late, r) in row.iter().enumerate().skip(early + 1) {
                sum += (r * Complex64::cis(-step * (late - early) as f64)).re;
            }
        }
        sum
    };
    let coarse = (0..GRID)
        .map(|i| TAU * i as f64 / GRID as f64)
        .max_by(|a, b| value(*a).total_cmp(&value(*b)))
        .unwrap_or(0.0);
    let from_sync = 0.5 * pairs[0][2].arg();
    let half_turn = 0.5 * TAU;
    wrap(from_sync + half_turn * ((coarse - from_sync) / half_turn).round())
}

/// Correlations `Σ z*_l z_m` between the symbols of an SSB, `[l][m]` with `l < m`.
pub(crate) type SymbolPairs = [[Complex64; SYMBOLS]; SYMBOLS];

/// Returns the phase step per symbol due to TS 38.211 §5.4 at an SSB frequency, in radians.
pub(crate) fn carrier_reset_step(ssb_freq_hz: f64, base_rate_hz: f64) -> f64 {
    let cycles = ssb_freq_hz * SYMBOL_SAMPLES as f64 / base_rate_hz;
    wrap(-TAU * cycles.fract())
}

fn correlate(reference: &[Complex32], samples: &[Complex32]) -> Complex32 {
    reference
        .iter()
        .zip(samples)
        .map(|(r, x)| r.conj() * x)
        .sum()
}

fn widen(value: Complex32) -> Complex64 {
    Complex64::new(f64::from(value.re), f64::from(value.im))
}
