//! Despreading of one SSB's known resource elements in groups of subcarriers.

use std::f64::consts::TAU;
use std::ops::Range;

use nr_ssb::grid::{SUBCARRIERS, SYMBOLS};
use nr_ssb::{Complex32, SsbGrid};
use num_complex::Complex64;

use crate::settings::Pilots;

/// Number of groups of the 240 subcarriers.
pub const GROUPS: usize = 24;
/// Subcarriers in a group.
pub const GROUP: usize = SUBCARRIERS / GROUPS;
/// FFT size that defines a delay in samples.
pub const FFT_SIZE: f64 = 256.0;
/// Subcarriers of PSS and SSS (TS 38.211, 7.4.3.1) in symbols 0 and 2.
const SYNC: Range<usize> = 56..183;

/// Despread known elements of `A` antennas: Σ y s* for each symbol and group. The noise of each
/// term has the variance of one resource element.
#[derive(Debug, Clone)]
pub struct Despread<const A: usize> {
    /// Σ y s* of each antenna, `[symbol][group]`.
    pub sums: [[[Complex64; A]; GROUPS]; SYMBOLS],
    /// Σ |s|²: number of known elements.
    pub counts: [[f64; GROUPS]; SYMBOLS],
}

impl<const A: usize> Despread<A> {
    /// Despreads the known elements that `pilots` selects, and compensates a delay of `delay`
    /// samples.
    pub fn new(
        elements: [&[[Complex32; SUBCARRIERS]; SYMBOLS]; A],
        known: &SsbGrid,
        pilots: Pilots,
        delay: f64,
    ) -> Self {
        let mut result = Self {
            sums: [[[Complex64::ZERO; A]; GROUPS]; SYMBOLS],
            counts: [[0.0; GROUPS]; SYMBOLS],
        };
        let cycles = delay / FFT_SIZE;
        let step = Complex64::cis(TAU * cycles);
        let mut turn = Complex64::cis(-TAU * cycles * 0.5 * SUBCARRIERS as f64);
        let ramp: [Complex64; SUBCARRIERS] = std::array::from_fn(|_| {
            let here = turn;
            turn *= step;
            here
        });
        let groups = result.sums.iter_mut().zip(&mut result.counts);
        for (l, ((sums, counts), known)) in groups.zip(known.symbols()).enumerate() {
            for k in subcarriers(pilots, l) {
                let s = known[k];
                let energy = s.norm_sqr();
                if energy > 0.5 {
                    let weight = Complex64::new(s.re.into(), s.im.into()).conj() * ramp[k];
                    for (sum, grid) in sums[k / GROUP].iter_mut().zip(&elements) {
                        let y = grid[l][k];
                        *sum += Complex64::new(y.re.into(), y.im.into()) * weight;
                    }
                    counts[k / GROUP] += f64::from(energy);
                }
            }
        }
        result
    }

    /// Returns the sums with each antenna multiplied by a gain.
    #[must_use]
    pub fn scaled(mut self, gains: &[Complex64; A]) -> Self {
        for sum in self.sums.iter_mut().flatten() {
            for (value, gain) in sum.iter_mut().zip(gains) {
                *value *= gain;
            }
        }
        self
    }

    /// Returns one block per symbol with pilots, over the whole band: the sum divided by the square
    /// root of the number of elements, so that the noise variance is unchanged.
    pub fn blocks(&self) -> impl Iterator<Item = [Complex64; A]> {
        let symbols = self.sums.iter().zip(&self.counts);
        symbols.filter_map(|(sums, counts)| {
            let count: f64 = counts.iter().sum();
            let scale = count.max(1.0).sqrt().recip();
            (count > 0.0).then(|| {
                let antenna =
                    |antenna: usize| sums.iter().map(|sum| sum[antenna]).sum::<Complex64>();
                std::array::from_fn(|it| antenna(it) * scale)
            })
        })
    }
}

/// Returns the subcarriers of symbol `l` that are pilots.
fn subcarriers(pilots: Pilots, l: usize) -> Range<usize> {
    match (pilots, l) {
        (Pilots::Ssb, _) => 0..SUBCARRIERS,
        (Pilots::Pss | Pilots::PssSss, 0) | (Pilots::PssSss, 2) => SYNC,
        _ => 0..0,
    }
}
