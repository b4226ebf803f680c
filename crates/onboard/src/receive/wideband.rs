//! Separation of the line of sight from frequency-selective scatter.
//!
//! Delayed scatter varies over the subcarriers; the line of sight, with its delay compensated, does
//! not. Over the groups of subcarriers `b` and the antennas `n` the channel model is
//!
//! `z_nb = g a_n(ω) exp(−j2πk_b δ/256) + h_nb + noise`.
//!
//! `h` is Gaussian, independent between antennas. Its power `P` decays exponentially over the delay
//! with time constant τ, starting at the line of sight, so that over the band
//! `E[h_b h*_b'] = P / (1 + j2π(k_b − k_b')τ/256)` (dense multipath of A. Richter, "Estimation of
//! radio channel parameters", TU Ilmenau 2005). With `C` the covariance of scatter plus noise over
//! the band, the log-likelihood of (δ, τ, P), maximised over `g`, is
//!
//! `−N ln|C| − Σ_n z_nᴴ C⁻¹ z_n + max_ω |Σ_n a_n* u_n|² / (N e)`,  `u_n = 1ᴴ C⁻¹ z_n`,
//! `e = 1ᴴ C⁻¹ 1`.
//!
//! At its maximum `u / √e` is one despread block whose noise, including scatter, has unit variance.
//! If noise explains the variation of the channel, this block does not exist: the sum over the band
//! is optimal, and its scatter cannot be separated from the signal.

use std::f64::consts::TAU;

use aoa::{Array, DirectionFinder, maximum_likelihood_pilots};
use num_complex::Complex64;

use super::despread::{Despread, FFT_SIZE, GROUP, GROUPS};
use crate::manifold::ArrayManifold;

/// Grid of decay time constants, in samples at the base rate.
const DECAYS: [f64; 6] = [0.125, 0.25, 0.5, 1.0, 2.0, 4.0];
/// Minimum delay of the line of sight relative to the delay of the maximum power, in samples.
const EARLIEST: f64 = -1.0;
/// Maximum delay of the line of sight relative to the delay of the maximum power, in samples.
const LATEST: f64 = 0.5;
/// Number of delays on the grid for each time constant.
const DELAYS: usize = 6;
/// Number of subsequent bisections of the spacing of the delays.
const HALVINGS: i32 = 4;
/// Threshold of the channel variation in standard deviations of the noise: exceeded by one of 10⁵
/// SSBs of a flat channel.
const VARIES: f64 = 5.0;
/// Noise of a group without known elements, relative to that of an element; large, because the
/// group contains no information.
const UNKNOWN: f64 = 1e9;

type Band = [Complex64; GROUPS];

/// Line of sight, separated from scatter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LineOfSight<const A: usize> {
    /// Array response; noise plus scatter has unit variance.
    pub block: [Complex64; A],
    /// Power of the scatter relative to the noise of a resource element.
    pub scatter: f64,
    /// Time constant of the scatter's decay, in samples.
    pub decay: f64,
}

/// Returns the line of sight if the channel varies over the band. The noise of an element has unit
/// variance and the channels are calibrated; `finder` is the direction finder of a non-linear
/// array.
pub fn line_of_sight<const A: usize>(
    despread: &Despread<A>,
    finder: Option<&DirectionFinder<ArrayManifold<A>, A>>,
) -> Option<LineOfSight<A>> {
    let channel = Channel::new(despread, 0);
    // The PSS of another cell with the same sequence resembles a delayed path, so that the symbols
    // without the PSS must vary as well.
    let others = Channel::new(despread, 1);
    let others = if others.known() > 0.0 {
        others
    } else {
        channel.clone()
    };
    let excess = others.variation()?;
    let fit = |decay: f64, power: f64, delays: &mut dyn Iterator<Item = f64>| {
        let scatter = Scatter::new(&channel, decay, power)?;
        let likelihood = |delay| {
            let likelihood = channel.likelihood(&scatter, delay, finder);
            (likelihood, delay, decay, power)
        };
        delays.map(likelihood).max_by(|a, b| a.0.total_cmp(&b.0))
    };
    let spacing = (LATEST - EARLIEST) / (DELAYS - 1) as f64;
    let better = |best: Option<Fit>, next: Option<Fit>| match (best, next) {
        (Some(best), Some(next)) if next.0 <= best.0 => Some(best),
        (best, next) => next.or(best),
    };
    let mut best = None;
    for decay in DECAYS {
        let power = excess / others.variable_share(decay);
        let mut delays = (0..DELAYS).map(|step| EARLIEST + spacing * step as f64);
        best = better(best, fit(decay, power, &mut delays));
    }
    // Refine the three parameters, one after another.
    for halving in 1..=HALVINGS {
        let (_, delay, decay, power) = best?;
        let near = spacing * 0.5_f64.powi(halving);
        let mut delays = [delay - near, delay + near].into_iter();
        best = better(best, fit(decay, power, &mut delays));
        let factor = 2.0_f64.powf(0.5_f64.powi(halving - 1));
        for (decay_factor, power_factor) in [
            (1.0, factor),
            (1.0, factor.recip()),
            (factor, 1.0),
            (factor.recip(), 1.0),
        ] {
            let (_, delay, ..) = best?;
            let next = fit(
                decay * decay_factor,
                power * power_factor,
                &mut std::iter::once(delay),
            );
            best = better(best, next);
        }
    }
    let (_, delay, decay, power) = best?;
    let scatter = Scatter::new(&channel, decay, power)?;
    let (response, energy) = channel.response(&scatter, delay);
    Some(LineOfSight {
        block: response.map(|gain| gain / energy.sqrt()),
        scatter: power,
        decay,
    })
}

/// Log-likelihood, delay, time constant, power.
type Fit = (f64, f64, f64, f64);

/// Channel estimate from all symbols.
#[derive(Clone)]
struct Channel<const A: usize> {
    /// Mean over the known elements of each group, for each antenna.
    antennas: [Band; A],
    /// Number of known elements.
    counts: [f64; GROUPS],
}

impl<const A: usize> Channel<A> {
    /// Aligns the phases of the symbols, starting at symbol `from`, and adds the symbols.
    fn new(despread: &Despread<A>, from: usize) -> Self {
        // The symbol with the most known elements is the phase reference.
        let known = |counts: &[f64; GROUPS]| counts.iter().sum::<f64>();
        let symbols = despread.sums.iter().zip(&despread.counts).skip(from);
        let first = symbols
            .clone()
            .max_by(|a, b| known(a.1).total_cmp(&known(b.1)));
        let mut antennas = [[Complex64::ZERO; GROUPS]; A];
        let mut counts = [0.0; GROUPS];
        for (sums, here) in symbols {
            let turn: Complex64 = first.map_or(Complex64::ONE, |(other, there)| {
                let groups = sums.iter().zip(here).zip(other.iter().zip(there));
                groups
                    .filter(|((_, here), (_, there))| **here * **there > 0.0)
                    .flat_map(|((a, here), (b, there))| {
                        let scale = (here.max(*there)).recip();
                        a.iter().zip(b).map(move |(a, b)| a * b.conj() * scale)
                    })
                    .sum()
            });
            let back = turn.conj() / turn.norm().max(f64::MIN_POSITIVE);
            for (group, (sum, count)) in sums.iter().zip(here).enumerate() {
                for (antenna, value) in antennas.iter_mut().zip(sum) {
                    antenna[group] += value * back;
                }
                counts[group] += count;
            }
        }
        for antenna in &mut antennas {
            for (value, count) in antenna.iter_mut().zip(&counts) {
                *value /= count.max(1.0);
            }
        }
        Self { antennas, counts }
    }

    fn known(&self) -> f64 {
        self.counts.iter().sum()
    }

    /// Returns the energy per antenna of the channel's variation over the band in excess of noise;
    /// `None` if noise explains the variation.
    fn variation(&self) -> Option<f64> {
        let groups = self.counts.iter().filter(|count| **count > 0.0).count();
        let energy = |antenna: &Band| {
            let (mut all, mut sum) = (0.0, Complex64::ZERO);
            for (value, count) in antenna.iter().zip(&self.counts) {
                all += value.norm_sqr() * count;
                sum += value * *count;
            }
            all - sum.norm_sqr() / self.known()
        };
        let measured: f64 = self.antennas.iter().map(energy).sum();
        // For noise alone it is gamma distributed, with one degree of freedom per group and
        // antenna, minus those of the mean.
        let noise = (A * groups.saturating_sub(1)) as f64;
        (measured > noise + VARIES * noise.sqrt()).then_some((measured - noise) / A as f64)
    }

    /// Returns the [`variation`](Self::variation) for scatter of unit power.
    fn variable_share(&self, decay: f64) -> f64 {
        let mut flat = 0.0;
        for (i, a) in self.counts.iter().enumerate() {
            for (j, b) in self.counts.iter().enumerate() {
                flat += a * b * correlation(i, j, decay).re;
            }
        }
        self.known() - flat / self.known()
    }

    /// Returns `u` and `e`.
    fn response(&self, scatter: &Scatter, delay: f64) -> ([Complex64; A], f64) {
        let response = self.antennas.map(|antenna| {
            let white = scatter.whitened(&delayed(&antenna, delay));
            product(&scatter.line_of_sight, &white)
        });
        (response, scatter.energy)
    }

    fn likelihood(
        &self,
        scatter: &Scatter,
        delay: f64,
        finder: Option<&DirectionFinder<ArrayManifold<A>, A>>,
    ) -> f64 {
        let mut all = 0.0;
        let response = self.antennas.map(|antenna| {
            let white = scatter.whitened(&delayed(&antenna, delay));
            all += white.iter().map(Complex64::norm_sqr).sum::<f64>();
            product(&scatter.line_of_sight, &white)
        });
        let beam = match finder {
            Some(finder) => ArrayManifold::strongest_beam(finder, &response),
            None => beam_of_a_row(&response),
        };
        beam / scatter.energy - all - A as f64 * scatter.log_determinant
    }
}

/// Factorised covariance over the band.
struct Scatter {
    /// Lower Cholesky factor with an inverted diagonal.
    factor: [Band; GROUPS],
    log_determinant: f64,
    /// Whitened line of sight.
    line_of_sight: Band,
    /// Energy `e` of the whitened line of sight.
    energy: f64,
}

impl Scatter {
    fn new<const A: usize>(channel: &Channel<A>, decay: f64, power: f64) -> Option<Self> {
        let mut factor = [[Complex64::ZERO; GROUPS]; GROUPS];
        let mut log_determinant = 0.0;
        for i in 0..GROUPS {
            for j in 0..=i {
                let mut sum = correlation(i, j, decay) * power;
                if i == j {
                    let count = channel.counts[i];
                    sum += if count > 0.0 { count.recip() } else { UNKNOWN };
                }
                for m in 0..j {
                    sum -= factor[i][m] * factor[j][m].conj();
                }
                if i != j {
                    factor[i][j] = sum * factor[j][j].re;
                } else if sum.re > 0.0 {
                    factor[i][i] = Complex64::new(sum.re.sqrt().recip(), 0.0);
                    log_determinant += sum.re.ln();
                } else {
                    return None;
                }
            }
        }
        let mut scatter = Self {
            factor,
            log_determinant,
            line_of_sight: [Complex64::ONE; GROUPS],
            energy: 0.0,
        };
        scatter.line_of_sight = scatter.whitened(&scatter.line_of_sight);
        scatter.energy = scatter.line_of_sight.iter().map(Complex64::norm_sqr).sum();
        Some(scatter)
    }

    /// Returns `L⁻¹ v`.
    fn whitened(&self, v: &Band) -> Band {
        let mut white = [Complex64::ZERO; GROUPS];
        for (i, row) in self.factor.iter().enumerate() {
            let before: Complex64 = row.iter().zip(&white).take(i).map(|(l, w)| l * w).sum();
            white[i] = (v[i] - before) * row[i].re;
        }
        white
    }
}

/// Returns the correlation of scatter with unit power between two groups.
fn correlation(i: usize, j: usize, decay: f64) -> Complex64 {
    let apart = (i as f64 - j as f64) * GROUP as f64;
    Complex64::new(1.0, TAU * apart * decay / FFT_SIZE).inv()
}

/// Returns the band with a delay compensated.
fn delayed(band: &Band, delay: f64) -> Band {
    let cycles = delay * GROUP as f64 / FFT_SIZE;
    let step = Complex64::cis(TAU * cycles);
    let mut turn = Complex64::cis(-TAU * cycles * 0.5 * (GROUPS - 1) as f64);
    band.map(|value| {
        let here = value * turn;
        turn *= step;
        here
    })
}

/// Returns the inner product `Σ a* b`.
fn product(a: &Band, b: &Band) -> Complex64 {
    a.iter().zip(b).map(|(a, b)| a.conj() * b).sum()
}

/// Returns the maximum beam power of a uniform linear array, `max |Σ u_n e^{−jωn}|² / N` over ω.
fn beam_of_a_row<const A: usize>(received: &[Complex64; A]) -> f64 {
    let found = maximum_likelihood_pilots(&[*received], Some(1.0), &Array::half_wavelength());
    found.map_or(0.0, |found| {
        let step = Complex64::cis(-found.phase_rad);
        // Horner's scheme.
        let sum = (received.iter().rev()).fold(Complex64::ZERO, |sum, gain| sum * step + gain);
        sum.norm_sqr() / A as f64
    })
}

#[cfg(test)]
mod tests {
    use aoa::bound::known_signal;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    use super::*;
    use nr_ssb::grid::SYMBOLS;

    const A: usize = 4;
    const TRUTH: f64 = 0.7;
    /// Known elements of a group: the 830 of the whole SSB, evenly distributed.
    const COUNT: f64 = 830.0 / (SYMBOLS * GROUPS) as f64;

    fn normal(rng: &mut ChaCha8Rng) -> Complex64 {
        let mut part = || rng.sample::<f64, _>(StandardNormal) * std::f64::consts::FRAC_1_SQRT_2;
        Complex64::new(part(), part())
    }

    /// Returns an SSB with unit noise, a line of sight from `TRUTH` delayed by `delay` samples, and
    /// scatter.
    fn ssb(rng: &mut ChaCha8Rng, snr: f64, k: f64, decay: f64, delay: f64) -> Despread<A> {
        let ramp = |k_b: f64, delay: f64| Complex64::cis(-TAU * k_b * delay / FFT_SIZE);
        let rays: Vec<_> = (0..A * 64)
            .map(|_| {
                let late = -decay * (1.0 - rng.random::<f64>()).ln();
                (normal(rng) / 8.0, delay + late)
            })
            .collect();
        let mut ssb = Despread {
            sums: [[[Complex64::ZERO; A]; GROUPS]; SYMBOLS],
            counts: [[COUNT; GROUPS]; SYMBOLS],
        };
        let phases: [Complex64; SYMBOLS] =
            std::array::from_fn(|_| Complex64::cis(TAU * rng.random::<f64>()));
        for group in 0..GROUPS {
            let k_b = (group as f64 - 11.5) * GROUP as f64;
            for antenna in 0..A {
                let own = &rays[antenna * 64..][..64];
                let scatter: Complex64 =
                    own.iter().map(|(gain, late)| gain * ramp(k_b, *late)).sum();
                let direct = Complex64::cis(TRUTH * antenna as f64) * ramp(k_b, delay);
                let channel =
                    direct * (snr * k / (k + 1.0)).sqrt() + scatter * (snr / (k + 1.0)).sqrt();
                for (sums, phase) in ssb.sums.iter_mut().zip(phases) {
                    sums[group][antenna] = channel * phase * COUNT + normal(rng) * COUNT.sqrt();
                }
            }
        }
        ssb
    }

    struct Errors {
        separated: f64,
        flat: f64,
        normalised: f64,
        bound: f64,
    }

    /// Returns the mean squared errors over many SSBs, with separated scatter and with the flat
    /// model.
    fn errors(trials: u32, snr_db: f64, k_db: f64, decay: f64) -> Errors {
        let array = Array::half_wavelength();
        let (snr, k) = (10f64.powf(0.1 * snr_db), 10f64.powf(0.1 * k_db));
        let mut rng = ChaCha8Rng::seed_from_u64(7);
        let mut sums = [0.0; 3];
        for _ in 0..trials {
            // The receiver tracks the delay of the maximum power.
            let ssb = ssb(&mut rng, snr, k, decay, -0.1);
            let separated = line_of_sight(&ssb, None).expect("the channel varies");
            let seen = maximum_likelihood_pilots(&[separated.block], Some(1.0), &array).unwrap();
            let blocks: Vec<_> = ssb.blocks().collect();
            let flat = maximum_likelihood_pilots(&blocks, Some(1.0), &array).unwrap();
            let error = seen.phase_rad - TRUTH;
            sums[0] += error * error;
            sums[1] += (flat.phase_rad - TRUTH).powi(2);
            sums[2] += (error / seen.phase_sigma_rad).powi(2);
        }
        let [separated, flat, normalised] = sums.map(|sum| sum / f64::from(trials));
        let channel = Channel::<A> {
            antennas: [[Complex64::ZERO; GROUPS]; A],
            counts: [COUNT * SYMBOLS as f64; GROUPS],
        };
        let energy = Scatter::new(&channel, decay, snr / (k + 1.0))
            .unwrap()
            .energy;
        let bound = known_signal::<A>(energy * snr * k / (k + 1.0)).powi(2);
        Errors {
            separated,
            flat,
            normalised,
            bound,
        }
    }

    #[test]
    fn scatter_over_the_band_is_averaged_and_reported() {
        let trials = 300;
        // A mean square of n Gaussian errors has a relative standard deviation of √(2/n); the bound
        // is four of them.
        let bound = 4.0 * (2.0 / f64::from(trials)).sqrt();
        // 300 ns are 1.15 samples at 15 kHz and 2.3 at 30 kHz.
        for (snr_db, k_db, decay) in [(0.0, 5.0, 1.15), (20.0, 5.0, 2.3), (10.0, 0.0, 2.3)] {
            let errors = errors(trials, snr_db, k_db, decay);
            let case = format!("{snr_db} dB, K = {k_db} dB, {decay} samples");
            println!(
                "{case}: RMSE {:.4}, known covariance {:.4}, flat {:.4}, normalised {:.3}",
                errors.separated.sqrt(),
                errors.bound.sqrt(),
                errors.flat.sqrt(),
                errors.normalised
            );
            assert!(errors.separated < errors.bound * (1.0 + bound), "{case}");
            assert!(
                errors.flat > errors.separated * (1.0 + 2f64.sqrt() * bound),
                "{case}"
            );
            assert!((errors.normalised - 1.0).abs() < bound, "{case}");
        }
    }

    #[test]
    fn a_flat_channel_is_unchanged() {
        let mut rng = ChaCha8Rng::seed_from_u64(8);
        for trial in 0..2000 {
            // Noise alone, a weak line of sight, strong scatter without delays.
            let (snr, k) = [(1e-6, 1.0), (0.1, 1e6), (100.0, 3.0)][trial % 3];
            assert_eq!(line_of_sight(&ssb(&mut rng, snr, k, 0.0, 0.0), None), None);
        }
    }
}
