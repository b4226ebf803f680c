//! Posterior of the first path's delay in multipath.
//!
//! Model: the first path at the delay τ with an unknown amplitude per antenna, and diffuse paths
//! after it with an exponential power-delay profile, whose delay spread `d` and power relative to
//! the first path, 1/K, are unknown. The diffuse part is Gaussian with the covariance
//! `ρ / (1 + j2π(k−k')d/256)` between subcarriers. The unknown amplitude is removed by a projection
//! (restricted likelihood, Patterson and Thompson, Biometrika 1971). In the eigenvectors `u_i` of the
//! projected covariance, with eigenvalues λ_i,
//! `ln p(z | τ, d, ρ) = −|P z|² + Σ_i [|u_iᴴz|² ρλ_i/(1 + ρλ_i) − A ln(1 + ρλ_i)] + const`,
//! where `z` are the elements without the delay τ and with unit noise, and `|·|²` adds `A` antennas.
//! The posterior is summed over τ, d and K. A channel of one path is a further hypothesis. Its
//! probability is filtered from one SSB of a beam to the next, because one weak SSB cannot decide
//! between both; the result is that of the more probable hypothesis.
//!
//! Prior distributions are those of TR 38.901 Table 7.5-6 at 3.5 GHz, between UMi (delay spread
//! 65 ns, K 9 dB) and InF (26 ns, 7 dB), with the wider standard deviations of InF.

use std::sync::LazyLock;

use num_complex::{Complex32, Complex64};

use crate::dsp::base_rate::SYMBOL_FFT;
use crate::dsp::received_grid::PerAntenna;
use crate::standard::grid::SUBCARRIERS;

/// Number of groups of subcarriers, eight each: a delay of three samples changes the phase within a
/// group by 0.6 rad, a loss of 1.5 %.
const GROUPS: usize = 30;
const WIDTH: usize = SUBCARRIERS / GROUPS;
/// Number of eigenvectors: the eigenvalue of the next one is below −60 dB at the longest delay
/// spread that the band does not resolve.
const MODES: usize = 6;
/// Number of delay spreads of the prior, a factor of two apart: 5 ns to 660 ns at 15 kHz.
const SPREADS: usize = 8;
/// Smallest delay spread of the prior, in samples.
const SHORTEST: f64 = 0.02;
/// Number of K factors of the prior.
const FACTORS: usize = 14;
/// Smallest K factor of the prior, in dB.
const MIN_K_DB: f64 = -7.5;
const STEP_K_DB: f64 = 2.5;
/// Mean and standard deviation of K, in dB.
const PRIOR_K_DB: [f64; 2] = [7.0, 8.0];
/// Mean and standard deviation of the decimal logarithm of the delay spread in seconds.
const PRIOR_LG_SPREAD: [f64; 2] = [-7.4, 0.4];
/// Prior probability that the channel consists of a single path, at the first SSB.
const FIRST_SINGLE: f64 = 0.5;
/// Probability that multipath appears or disappears between two successive SSBs.
const CHANGE: f64 = 0.01;
/// Fraction of independent observations of multipath, because multipath of neighbouring antennas is
/// correlated and consists of few paths.
const INDEPENDENT: f64 = 0.4;
/// Maximum probability of K < 0 dB for a separated first path.
const WEAK: f64 = 0.1;
/// Minimum noise relative to the signal in the search for the delay, −10 dB: deviation of a channel
/// of few paths from the exponential model. With −20 dB, the NEES of the delay is 6 in the channels
/// of TR 38.901 with K = 3 to 10 dB.
const DELAY_FLOOR: f64 = 0.1;
/// Minimum noise relative to the signal for the powers of the paths, −20 dB. With −10 dB, a blocked
/// first path is not distinguished from K = 5 dB.
const POWER_FLOOR: f64 = 1e-2;
/// Exponents below this value give zero: the smallest positive `f64` is e^−744.4.
const MIN_EXPONENT: f64 = -746.0;
/// Number of delays of a grid.
const GRID: usize = 17;
/// Maximum number of grids, each finer than the previous one.
const GRIDS: usize = 6;
/// Range of the first grid before the delay of a single path, in samples, in addition to six
/// standard deviations.
const BEFORE: f64 = 3.0;
/// Range of the first grid after the delay of a single path, in samples, in addition to six
/// standard deviations.
const AFTER: f64 = 0.3;

/// Number of known elements of every group: PSS, SSS and DM-RS; and with the PBCH.
const KNOWN: [fn(usize) -> f64; 2] = [
    |group| f64::from(4 + dmrs_of_sss(group) + sync(group)),
    |group| f64::from(16 + 4 * dmrs_of_sss(group) + sync(group)),
];

/// Returns the number of known elements of PSS and SSS (subcarriers 56 to 182) in a group.
const fn sync(group: usize) -> u8 {
    match group {
        7..=21 => 16,
        22 => 14,
        _ => 0,
    }
}

/// Returns the number of DM-RS elements of a group in the symbol of the SSS.
const fn dmrs_of_sss(group: usize) -> u8 {
    match group {
        0..=5 | 24.. => 2,
        _ => 0,
    }
}

/// Posterior of the first path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Posterior {
    /// Mean of the delay in samples, relative to the rows.
    pub(crate) delay: f64,
    /// Variance of the delay in samples² due to multipath, in addition to noise.
    pub(crate) multipath_variance: f64,
    /// Mean of the first path's share of the power.
    pub(crate) share: f64,
    /// Standard deviation of the first path's share of the power.
    pub(crate) share_sigma: f64,
    /// Mean of the power of the other paths relative to the first one.
    pub(crate) diffuse: f64,
    /// Whether multipath is detected.
    pub(crate) is_multipath: bool,
    /// Whether the first path may be weaker than the others.
    pub(crate) is_weak: bool,
}

type Row = [Complex64; GROUPS];

/// Eigenvectors of the diffuse part for one set of known elements.
struct Basis {
    /// Square root of the number of known elements of each group.
    root: [f64; GROUPS],
    /// First path, a unit vector.
    direct: Row,
    /// Eigenvalues and conjugated eigenvectors, for each delay spread.
    spreads: [([f64; MODES], [Row; MODES]); SPREADS],
}

static BASES: LazyLock<[Basis; 2]> = LazyLock::new(|| KNOWN.map(Basis::new));

/// Filter of the first path of one beam.
#[derive(Debug, Clone)]
pub(crate) struct FirstPath {
    /// Probability of a single path after the last SSB.
    single: f64,
}

impl FirstPath {
    /// Creates the filter and its tables, so that later calls do not compute them.
    pub(crate) fn new() -> Self {
        LazyLock::force(&BASES);
        Self {
            single: FIRST_SINGLE,
        }
    }

    /// Returns the posterior from the received elements times the conjugated known ones, summed over the
    /// symbols, for each antenna; the noise variance of an element of each antenna; the delay of a
    /// single path in the rows, in samples, with its variance due to noise.
    pub(crate) fn follow(
        &mut self,
        rows: &[[Complex32; SUBCARRIERS]],
        noise_variance: &[f64],
        with_pbch: bool,
        single: f64,
        single_variance: f64,
        base_rate_hz: f64,
    ) -> Posterior {
        let basis = &BASES[usize::from(with_pbch)];
        let rows = rows.iter().zip(noise_variance);
        let elements = rows
            .map(|(row, noise)| basis.whitened(row, *noise))
            .collect();
        let search = Search::new(basis, elements, single, base_rate_hz);
        let powers = search.with_floor(POWER_FLOOR);
        let multi = powers.run(single, single_variance);
        let odds = powers.log_odds(&multi, single, single_variance);
        let before = self.single + CHANGE * (1.0 - 2.0 * self.single);
        self.single = 1.0 / (1.0 + odds.exp() * (1.0 - before) / before);
        if self.single > 0.5 {
            return Posterior::single(single);
        }
        let delays = search.with_floor(DELAY_FLOOR);
        let delay = delays.run(single, single_variance);
        Posterior {
            delay: delay.mean,
            // The first path is at most as precise as a single one.
            multipath_variance: (delay.variance - single_variance * delays.excess).max(0.0),
            share: multi.share,
            share_sigma: multi.share_variance.sqrt(),
            diffuse: multi.diffuse,
            is_multipath: true,
            is_weak: multi.weak > WEAK,
        }
    }
}

impl Posterior {
    const fn single(delay: f64) -> Self {
        Self {
            delay,
            multipath_variance: 0.0,
            share: 1.0,
            share_sigma: 0.0,
            diffuse: 0.0,
            is_multipath: false,
            is_weak: false,
        }
    }
}

/// Returns Σ |z|² over the antennas.
fn energy(elements: &[Row]) -> f64 {
    elements.iter().flatten().map(Complex64::norm_sqr).sum()
}

/// Returns Σ |directᴴ z|² over the antennas, without the delay.
fn project(elements: &[Row], basis: &Basis, delay: f64) -> f64 {
    let ramp = ramp(delay);
    let on = |row: &Row| -> f64 {
        let terms = row.iter().zip(&ramp).zip(&basis.direct);
        terms
            .map(|((z, turn), e)| z * turn * e)
            .sum::<Complex64>()
            .norm_sqr()
    };
    elements.iter().map(on).sum()
}

/// Returns the factors that remove a delay.
fn ramp(delay: f64) -> Row {
    let step = std::f64::consts::TAU * delay / SYMBOL_FFT as f64;
    let turn = Complex64::cis(step * WIDTH as f64);
    let mut phasor = Complex64::cis(step * centre(0));
    std::array::from_fn(|_| {
        let this = phasor;
        phasor *= turn;
        this
    })
}

/// Returns the centre of a group in subcarriers relative to the SSB's centre.
fn centre(group: usize) -> f64 {
    (group as f64 + 0.5) * WIDTH as f64 - 0.5 - 120.0
}

fn k_factor(index: usize) -> f64 {
    10.0_f64.powf(0.1 * (MIN_K_DB + STEP_K_DB * index as f64))
}

/// Returns the prior probability of every delay spread and K factor.
fn prior(base_rate_hz: f64) -> [[f64; FACTORS]; SPREADS] {
    let normal =
        |value: f64, [mean, sigma]: [f64; 2]| (-0.5 * ((value - mean) / sigma).powi(2)).exp();
    let mut prior: [[f64; FACTORS]; SPREADS] = std::array::from_fn(|spread| {
        let lg_spread = (SHORTEST * f64::from(1_u16 << spread) / base_rate_hz).log10();
        std::array::from_fn(|factor| {
            let k_db = MIN_K_DB + STEP_K_DB * factor as f64;
            normal(lg_spread, PRIOR_LG_SPREAD) * normal(k_db, PRIOR_K_DB)
        })
    });
    let total: f64 = prior.iter().flatten().sum();
    for value in prior.iter_mut().flatten() {
        *value /= total.max(f64::MIN_POSITIVE);
    }
    prior
}

impl Basis {
    fn new(known: fn(usize) -> f64) -> Self {
        let root: [f64; GROUPS] = std::array::from_fn(|group| known(group).sqrt());
        let norm = root.iter().map(|it| it * it).sum::<f64>().sqrt();
        let direct = root.map(|it| Complex64::new(it / norm, 0.0));
        let spreads = std::array::from_fn(|spread| {
            eigenvectors(&root, &direct, SHORTEST * f64::from(1_u16 << spread))
        });
        Self {
            root,
            direct,
            spreads,
        }
    }

    /// Returns the sums over the groups with unit noise.
    fn whitened(&self, row: &[Complex32; SUBCARRIERS], noise: f64) -> Row {
        let (groups, _) = row.as_chunks::<WIDTH>();
        let scale = 1.0 / noise.max(f64::MIN_POSITIVE).sqrt();
        std::array::from_fn(|index| {
            let sum: Complex32 = groups.get(index).into_iter().flatten().sum();
            Complex64::new(f64::from(sum.re), f64::from(sum.im)) * (scale / self.root[index])
        })
    }
}

/// Returns the largest eigenvalues and the conjugated eigenvectors of the diffuse part's covariance
/// for one delay spread, orthogonal to the first path, by orthogonal iteration.
fn eigenvectors(root: &[f64; GROUPS], direct: &Row, spread: f64) -> ([f64; MODES], [Row; MODES]) {
    const ITERATIONS: usize = 40;
    let covariance: [Row; GROUPS] = std::array::from_fn(|i| {
        std::array::from_fn(|j| {
            let turn = std::f64::consts::TAU * (centre(i) - centre(j)) / SYMBOL_FFT as f64 * spread;
            Complex64::new(1.0, turn).inv() * (root[i] * root[j])
        })
    });
    // Powers of the frequency span the smooth functions.
    let mut vectors: [Row; MODES] = std::array::from_fn(|mode| {
        std::array::from_fn(|i| {
            Complex64::new(root[i] * (centre(i) / 120.0).powi(mode as i32 + 1), 0.0)
        })
    });
    let mut values = [0.0; MODES];
    for _ in 0..ITERATIONS {
        for mode in 0..MODES {
            let mut next = vectors[mode];
            for (slot, row) in next.iter_mut().zip(&covariance) {
                *slot = row.iter().zip(&vectors[mode]).map(|(c, x)| c * x).sum();
            }
            // Orthogonalised twice, because a single pass loses orthogonality by rounding errors.
            for _ in 0..2 {
                remove(&mut next, direct);
                for earlier in &vectors[..mode] {
                    remove(&mut next, earlier);
                }
            }
            let norm = next.iter().map(Complex64::norm_sqr).sum::<f64>().sqrt();
            values[mode] = norm;
            vectors[mode] = next.map(|x| x / norm.max(f64::MIN_POSITIVE));
        }
    }
    (values, vectors.map(|vector| vector.map(|x| x.conj())))
}

/// Removes the component along a unit vector.
fn remove(from: &mut Row, unit: &Row) {
    let along: Complex64 = unit.iter().zip(&*from).map(|(u, x)| u.conj() * x).sum();
    for (x, u) in from.iter_mut().zip(unit) {
        *x -= along * u;
    }
}

/// Search for the first path of one SSB.
struct Search<'a> {
    basis: &'a Basis,
    /// Elements with unit noise, which includes the minimum noise.
    elements: PerAntenna<Row>,
    total: f64,
    /// Noise variance relative to that of the receiver.
    excess: f64,
    /// Power of a resource element relative to noise, mean over the antennas.
    power: f64,
    prior: [[f64; FACTORS]; SPREADS],
    /// K factors of the prior, as power ratios.
    factors: [f64; FACTORS],
}

/// Log-likelihoods of every delay spread and K factor.
type Likelihoods = [[f64; FACTORS]; SPREADS];

impl<'a> Search<'a> {
    /// Creates a search in elements with unit noise; `single` is the delay of a single path.
    fn new(basis: &'a Basis, elements: PerAntenna<Row>, single: f64, base_rate_hz: f64) -> Self {
        let direct = project(&elements, basis, single);
        let known: f64 = basis.root.iter().map(|it| it * it).sum();
        Self {
            basis,
            total: energy(&elements),
            power: (direct / elements.len() as f64 - 1.0).max(1.0) / known,
            elements,
            excess: 1.0,
            prior: prior(base_rate_hz),
            factors: std::array::from_fn(k_factor),
        }
    }

    /// Returns the search with a minimum noise relative to the signal.
    fn with_floor(&self, floor: f64) -> Self {
        let excess = (self.power * floor).max(1.0);
        let scale = excess.sqrt().recip();
        let rows = self.elements.iter();
        let elements: PerAntenna<Row> = rows.map(|row| row.map(|it| it * scale)).collect();
        Self {
            total: energy(&elements),
            elements,
            excess,
            power: self.power / excess,
            ..*self
        }
    }

    /// Returns the posterior, given the delay of a single path and its variance due to the noise of
    /// the receiver.
    fn run(&self, single: f64, single_variance: f64) -> Moments {
        let (gains, losses) = self.weights();
        let sigma = (self.excess * single_variance).sqrt();
        let (mut from, mut to) = (single - BEFORE - 6.0 * sigma, single + AFTER + 6.0 * sigma);
        let mut grid = [[[0.0; FACTORS]; SPREADS]; GRID];
        let mut moments = Moments::default();
        for _ in 0..GRIDS {
            let step = (to - from) / (GRID - 1) as f64;
            let mut largest = f64::NEG_INFINITY;
            for (index, likelihoods) in grid.iter_mut().enumerate() {
                *likelihoods = self.likelihoods(from + step * index as f64, &gains, &losses);
                largest = likelihoods
                    .iter()
                    .flatten()
                    .copied()
                    .fold(largest, f64::max);
            }
            moments = self.moments(&grid, from, step, largest);
            let sigma = moments.variance.sqrt();
            if sigma > 2.0 * step {
                break;
            }
            let reach = 4.0 * sigma.max(step);
            (from, to) = (moments.mean - reach, moments.mean + reach);
        }
        moments
    }

    /// Returns `ρλ/(1 + ρλ)` and `Σ_i A ln(1 + ρλ_i)` for every delay spread and K factor.
    fn weights(&self) -> ([[[f64; MODES]; FACTORS]; SPREADS], Likelihoods) {
        let mut gains = [[[0.0; MODES]; FACTORS]; SPREADS];
        let mut losses = [[0.0; FACTORS]; SPREADS];
        for (spread, (values, _)) in self.basis.spreads.iter().enumerate() {
            for (factor, k) in self.factors.iter().enumerate() {
                let density = self.power / k;
                for (gain, value) in gains[spread][factor].iter_mut().zip(values) {
                    let level = density * value;
                    *gain = level / (1.0 + level);
                    losses[spread][factor] += self.elements.len() as f64 * level.ln_1p();
                }
            }
        }
        (gains, losses)
    }

    fn likelihoods(
        &self,
        delay: f64,
        gains: &[[[f64; MODES]; FACTORS]; SPREADS],
        losses: &Likelihoods,
    ) -> Likelihoods {
        let ramp = ramp(delay);
        let mut misfit = self.total;
        let mut turned = self.elements.clone();
        for row in &mut turned {
            let mut direct = Complex64::ZERO;
            for ((z, turn), e) in row.iter_mut().zip(&ramp).zip(&self.basis.direct) {
                *z *= turn;
                direct += *z * e.re;
            }
            misfit -= direct.norm_sqr();
        }
        std::array::from_fn(|spread| {
            let (_, vectors) = &self.basis.spreads[spread];
            let mut energies = [0.0; MODES];
            for (energy, vector) in energies.iter_mut().zip(vectors) {
                for row in &turned {
                    *energy += product(row, vector).norm_sqr();
                }
            }
            std::array::from_fn(|factor| {
                let pairs = energies.iter().zip(&gains[spread][factor]);
                let explained: f64 = pairs.map(|(energy, gain)| energy * gain).sum();
                explained - losses[spread][factor] - misfit
            })
        })
    }

    /// Sums the posterior over a grid of delays.
    fn moments(&self, grid: &[Likelihoods; GRID], from: f64, step: f64, largest: f64) -> Moments {
        let mut sums = Sums::default();
        for (index, likelihoods) in grid.iter().enumerate() {
            let delay = step * index as f64;
            let (mut density, mut evidence) = (0.0, 0.0);
            for (row, prior) in likelihoods.iter().zip(&self.prior) {
                for ((likelihood, prior), k) in row.iter().zip(prior).zip(self.factors) {
                    let exponent = likelihood - largest;
                    if INDEPENDENT * exponent < MIN_EXPONENT {
                        continue;
                    }
                    let root = (INDEPENDENT * exponent).exp();
                    let weight = root * prior;
                    let share = k / (1.0 + k);
                    density += weight;
                    evidence += exponent.exp() * prior;
                    sums.diffuse += weight / k;
                    sums.share += weight * share;
                    sums.share_squared += weight * share * share;
                    sums.weak += if k < 1.0 { weight } else { 0.0 };
                }
            }
            sums.total += density;
            sums.evidence += evidence;
            sums.first += density * delay;
            sums.second += density * delay * delay;
        }
        let total = sums.total.max(f64::MIN_POSITIVE);
        let mean = sums.first / total;
        let share = sums.share / total;
        Moments {
            mean: from + mean,
            variance: (sums.second / total - mean * mean).max(0.0),
            log_evidence: largest + (sums.evidence * step).max(f64::MIN_POSITIVE).ln(),
            diffuse: sums.diffuse / total,
            share,
            share_variance: (sums.share_squared / total - share * share).max(0.0),
            weak: sums.weak / total,
        }
    }

    /// Returns the logarithm of the likelihood in multipath relative to that of a single path.
    ///
    /// The minimum noise is the largest deviation from the model of multipath. A single path has no
    /// deviation beyond the noise of the receiver. Elements that deviate more are therefore evidence
    /// for multipath: two strong paths that the band does not separate resemble a single one at the
    /// minimum noise. The deviation is that of maximum likelihood.
    fn log_odds(&self, multi: &Moments, single: f64, single_variance: f64) -> f64 {
        let misfit = self.total - project(&self.elements, self.basis, single);
        let width = (std::f64::consts::TAU * self.excess * single_variance).sqrt();
        let odds = multi.log_evidence + misfit - width.max(f64::MIN_POSITIVE).ln();
        let (misfit, dimensions) = (
            self.excess * misfit,
            (self.elements.len() * (GROUPS - 1)) as f64,
        );
        let noise = (misfit / dimensions).clamp(1.0, self.excess);
        let deviation = misfit * (1.0 - 1.0 / noise) - dimensions * noise.ln();
        (odds + deviation).clamp(-50.0, 50.0)
    }
}

/// Moments of the posterior in multipath.
#[derive(Debug, Clone, Copy, Default)]
struct Moments {
    mean: f64,
    variance: f64,
    log_evidence: f64,
    diffuse: f64,
    share: f64,
    share_variance: f64,
    weak: f64,
}

#[derive(Default)]
struct Sums {
    total: f64,
    evidence: f64,
    first: f64,
    second: f64,
    diffuse: f64,
    share: f64,
    share_squared: f64,
    weak: f64,
}

/// Returns Σ a b.
fn product(a: &Row, b: &Row) -> Complex64 {
    let (mut re, mut im) = ([0.0; 2], [0.0; 2]);
    for i in 0..GROUPS {
        re[i % 2] += a[i].re * b[i].re - a[i].im * b[i].im;
        im[i % 2] += a[i].re * b[i].im + a[i].im * b[i].re;
    }
    Complex64::new(re[0] + re[1], im[0] + im[1])
}
