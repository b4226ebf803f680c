//! Tests whether the model, `K` plane waves in white noise, explains the received snapshots.
//!
//! With `R` the covariance of `L` snapshots of `N` antennas, `A` the steering vectors of the `K` sources,
//! `P` the projection on their orthogonal complement and `y = A^+ x` the waveforms, the residual `P x` is
//! regressed on `y`. If the model holds, the two parts of its power are independent:
//!
//! - the coherent part, which is correlated with the waveforms: `tr P R A (A^H R A)^-1 A^H R P`. It is
//!   distributed as `sigma^2 / (2 L) chi^2` with `2 K (N - K) - p` degrees of freedom, because the fit of
//!   the `p` parameters of the directions removes `p` of them;
//! - the rest `E = R - R A (A^H R A)^-1 A^H R`, whose trace is distributed as
//!   `sigma^2 / (2 L) chi^2` with `2 (L - K) (N - K)` degrees of freedom. It has no preferred direction.
//!
//! The ratio of the two is F distributed for any waveforms, random or deterministic (Anderson 2003, 8.4:
//! regression with complex observations). Reflections and errors of the array model increase the first
//! part. Another source increases the second. If the noise is unknown, the shape of `E` is tested by John's
//! statistic (1971), `(m tr E^2 / (tr E)^2 - 1) ((L - K) m + 1) / (m^2 - 1)` with `m = N - K`. Its
//! mean is 1, and it is approximately a reduced chi^2 with `m^2 - 1` degrees of freedom. If the noise is
//! known, the trace of `E` is tested.

use super::verdict::Reason;
use crate::simd::math::select;

/// Standard normal deviate of the limit of each test: the false-alarm probability is 0.5 % per test and 1 % for
/// both.
const FALSE_ALARM_DEVIATE: f64 = 2.575_829_303_548_901;

/// Minimum degrees of freedom of an estimated noise variance that is treated as known: its error then adds less
/// than 1.6 % to a standard deviation.
const MANY_FREEDOMS: f64 = 100.0;
/// Minimum degrees of freedom of an estimated noise variance for a reliable angle. With fewer, the
/// ratio of error to standard deviation exceeds 3 in more than 0.6 % of the estimates, or has an
/// RMS below 0.9.
const FEWEST_FREEDOMS: f64 = 8.0;
/// Degrees of freedom of an estimated noise variance that double the SNR required to exclude an
/// outlier. With fewer, the variance of the estimated SNR is larger.
const FREEDOMS_AT_TWICE_THE_SNR: f64 = 10.0;
/// Relative increase of an angle's variance at the required SNR; it decreases with the cube of the
/// SNR. An estimated SNR near the threshold is more often caused by an underestimated noise than by
/// a weak signal. The value was fitted so that the z-RMS is 0.9 to 1.15 if at least one fifth of
/// the angles are reliable.
const INCREASE_AT_THRESHOLD: f64 = 0.6;

/// Goodness of fit of the sources and white noise to the received snapshots.
///
/// ```
/// use aoa::{Array, Reason, maximum_likelihood_pilots};
///
/// let array = Array::<4>::half_wavelength();
/// let [direct, echo] = [0.5, 1.8].map(|phase| array.steering_vector(phase));
/// let block: [_; 4] = std::array::from_fn(|n| direct[n] + echo[n] * 0.5);
/// let found = maximum_likelihood_pilots(&[block, block], Some(0.01), &array)?;
/// assert!(found.is_resolved() && !found.is_reliable());
/// assert_eq!(found.fit.misfit(), Some(Reason::Multipath));
/// assert!(found.fit.p_value() < 1e-6);
/// # Ok::<(), aoa::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GoodnessOfFit {
    /// Residual power that is correlated with the waveforms, relative to the noise power in the same
    /// dimensions: a reduced chi-squared with mean 1 if the model holds.
    pub coherent: f64,
    /// Rest of the residual: the ratio of its power to the noise power if the noise is known,
    /// otherwise its anisotropy (John's statistic). The mean is 1 if the model holds.
    pub noise: f64,
    model: Model,
}

/// Dimensions of the fitted model and of the data.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Model {
    pub(crate) antennas: u8,
    pub(crate) sources: u8,
    /// Total number of parameters of the directions.
    pub(crate) parameters: u8,
    pub(crate) noise_is_known: bool,
    pub(crate) snapshots: u32,
}

/// Residual of the sources, summed over the snapshots.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Residual {
    /// Power that is correlated with the waveforms.
    pub(crate) coherent: f64,
    /// `tr E`, with the residual covariance `E` that is not correlated with the waveforms.
    pub(crate) rest: f64,
    /// `tr E^2`.
    pub(crate) rest_squared: f64,
}

/// Tests of a model with their precomputed constants.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Tests {
    model: Model,
    /// Degrees of freedom of the coherent part of the residual, at least 1.
    coherent_freedom: f64,
    /// Degrees of freedom of the rest of the residual, at least 1.
    rest_freedom: f64,
    dimensions_left: f64,
    /// Factor on the variance of an angle far above the threshold SNR, because the noise is
    /// estimated.
    unknown_noise: f64,
    /// Relative increase of the variance at the threshold SNR.
    increase_at_threshold: f64,
    /// Factor on the threshold SNR.
    needed: f64,
    is_noise_determined: bool,
    /// Factor on `m tr E^2 / (tr E)^2 - 1` in John's statistic; `None` in one dimension, where the statistic is
    /// undefined.
    shape: Option<f64>,
    /// Maximum ratios of a model that fits.
    coherent_limit: f64,
    noise_limit: f64,
}

/// Results of the tests of a residual.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Tested {
    pub(crate) coherent: f64,
    pub(crate) noise: f64,
    /// Factor on the variance of an angle due to noise: 1 if the model fits. Otherwise, the residual that is
    /// correlated with the waveforms is assumed to affect the angle like the other dimensions, and the factor is
    /// the square of Birge's ratio (1932).
    pub(crate) inflation: f64,
}

impl Model {
    /// Creates the model of one source with one parameter, the electrical angle.
    pub(crate) fn one<const N: usize>(snapshots: usize, noise_is_known: bool) -> Self {
        Self::new::<N>([1, 1], snapshots, noise_is_known)
    }

    pub(crate) fn new<const N: usize>(
        [sources, parameters]: [usize; 2],
        snapshots: usize,
        noise_is_known: bool,
    ) -> Self {
        Self {
            antennas: N as u8,
            sources: sources as u8,
            parameters: parameters as u8,
            noise_is_known,
            snapshots: u32::try_from(snapshots).unwrap_or(u32::MAX),
        }
    }

    fn dimensions_left(self) -> f64 {
        f64::from(self.antennas) - f64::from(self.sources)
    }

    fn snapshots_left(self) -> f64 {
        (f64::from(self.snapshots) - f64::from(self.sources)).max(0.0)
    }

    fn coherent_freedom(self) -> f64 {
        let dimensions = 2.0 * f64::from(self.sources) * self.dimensions_left();
        (dimensions - f64::from(self.parameters)).max(0.0)
    }

    fn rest_freedom(self) -> f64 {
        2.0 * self.snapshots_left() * self.dimensions_left()
    }

    /// Returns the degrees of freedom of the noise variance that is estimated from the whole
    /// residual of one source.
    fn noise_freedom(self) -> f64 {
        self.residual_dimensions() - f64::from(self.parameters)
    }

    /// Returns the number of real dimensions of the residual in all snapshots.
    fn residual_dimensions(self) -> f64 {
        2.0 * f64::from(self.snapshots) * self.dimensions_left()
    }

    /// Whether the noise is treated as known. Several sources use the asymptotic variance.
    fn has_known_noise(self) -> bool {
        self.noise_is_known || self.sources != 1 || self.noise_freedom() >= MANY_FREEDOMS
    }

    /// Returns the factor on the variance of an angle that is due to the estimation of the noise
    /// variance with `f` degrees of freedom.
    ///
    /// The residual's power is divided by all of its dimensions, `f + p`, although `p` of them were
    /// fitted. The ratio of the angle's error to its standard deviation then follows Student's t
    /// distribution with `f` degrees of freedom, whose variance is `f / (f - 2)`. The factor `f /
    /// (f - 3)` also keeps the fraction beyond three standard deviations below 0.6 % for `f` of at
    /// least 7.
    fn unknown_noise(self) -> f64 {
        if self.has_known_noise() {
            return 1.0;
        }
        let remaining = self.noise_freedom() - 3.0;
        self.residual_dimensions() / remaining.max(1.0)
    }

    /// Returns the factor on the SNR required to exclude an outlier that is due to the estimation
    /// of the noise variance.
    fn needed(self) -> f64 {
        if self.has_known_noise() {
            return 1.0;
        }
        self.unknown_noise() * (1.0 + FREEDOMS_AT_TWICE_THE_SNR / self.noise_freedom().max(1.0))
    }

    /// Returns the degrees of freedom of the numerator and the denominator of each ratio.
    fn freedoms(self) -> [[f64; 2]; 2] {
        let shape = self.dimensions_left().powi(2) - 1.0;
        if self.noise_is_known {
            [
                [self.coherent_freedom(), f64::INFINITY],
                [self.rest_freedom(), f64::INFINITY],
            ]
        } else {
            [
                [self.coherent_freedom(), self.rest_freedom()],
                [shape.min(self.rest_freedom()), f64::INFINITY],
            ]
        }
    }

    pub(crate) fn tests(self) -> Tests {
        let [coherent_limit, noise_limit] = self.freedoms().map(largest_ratio);
        let (m, l) = (self.dimensions_left(), self.snapshots_left());
        Tests {
            model: self,
            coherent_freedom: self.coherent_freedom().max(1.0),
            rest_freedom: self.rest_freedom().max(1.0),
            dimensions_left: m,
            unknown_noise: self.unknown_noise(),
            increase_at_threshold: if self.has_known_noise() {
                0.0
            } else {
                INCREASE_AT_THRESHOLD
            },
            needed: self.needed(),
            is_noise_determined: self.has_known_noise() || self.noise_freedom() >= FEWEST_FREEDOMS,
            shape: (m > 1.0).then(|| (l * m + 1.0) / (m * m - 1.0)),
            coherent_limit,
            noise_limit,
        }
    }
}

impl Tested {
    /// Result without a residual and without a misfit.
    pub(crate) const NOTHING: Self = Self {
        coherent: 1.0,
        noise: 1.0,
        inflation: 1.0,
    };

    pub(crate) const fn ratios(&self) -> [f64; 2] {
        [self.coherent, self.noise]
    }
}

impl Tests {
    /// Applies the tests to a residual. `noise_power` is the noise variance per antenna, and `power` is the
    /// received power of all antennas; both are summed over the snapshots. Residuals below the rounding errors
    /// of `power` are not tested.
    #[inline(always)]
    pub(crate) fn of(&self, left: &Residual, noise_power: f64, power: f64) -> Tested {
        const ROUNDING: f64 = 1e-13;
        let larger = |a: f64, b: f64| if a > b { a } else { b };
        let least = power * ROUNDING;
        let rest = larger(left.rest, least);
        // Noise variance in one real dimension by three sources: the given or estimated noise power,
        // the rest of the residual, and the coherent part of the residual.
        let of_noise = 0.5 * noise_power / f64::from(self.model.snapshots);
        let of_rest = rest / self.rest_freedom;
        let of_coherent = left.coherent / self.coherent_freedom;
        let (coherent, noise) = if self.model.noise_is_known {
            (of_coherent / of_noise, of_rest / of_noise)
        } else {
            let unequal = self.dimensions_left * left.rest_squared / (rest * rest) - 1.0;
            let noise = self
                .shape
                .map_or(1.0, |shape| select(left.rest > least, unequal * shape, 1.0));
            (of_coherent / of_rest, noise)
        };
        let fits = (coherent <= self.coherent_limit) && (noise <= self.noise_limit);
        let inflation = select(fits, 1.0, larger(of_coherent / of_noise, 1.0));
        Tested {
            coherent,
            noise,
            inflation,
        }
    }

    /// Converts the result to its public form.
    #[inline(always)]
    pub(crate) const fn fit(&self, tested: &Tested) -> GoodnessOfFit {
        GoodnessOfFit {
            coherent: tested.coherent,
            noise: tested.noise,
            model: self.model,
        }
    }

    /// Returns the SNR required to exclude an outlier; `with_known_noise` is the required SNR for
    /// known noise.
    pub(crate) const fn needed_snr(&self, with_known_noise: f64) -> f64 {
        self.needed * with_known_noise
    }

    /// Returns the factor on the variance of an angle that is due to the estimation of the noise
    /// variance. `needed_snr` is the result of [`Self::needed_snr`].
    #[inline(always)]
    pub(crate) fn variance_factor(&self, snr: f64, needed_snr: f64) -> f64 {
        let ratio = needed_snr / snr;
        let ratio = select(ratio < 1.0, ratio, 1.0);
        self.unknown_noise * (1.0 + self.increase_at_threshold * ratio * ratio * ratio)
    }

    /// Whether there are too few snapshots to estimate the noise variance.
    #[inline(always)]
    pub(crate) fn noise_doubt(&self) -> Option<Reason> {
        (!self.is_noise_determined).then_some(Reason::TooFewSnapshots)
    }

    /// Returns the reason of a misfit if a ratio exceeds its limit.
    #[inline(always)]
    pub(crate) fn misfit(&self, [coherent, noise]: [f64; 2]) -> Option<Reason> {
        if noise > self.noise_limit {
            Some(Reason::MoreSources)
        } else if coherent > self.coherent_limit {
            Some(Reason::Multipath)
        } else {
            None
        }
    }
}

impl GoodnessOfFit {
    /// Returns the reason of a misfit if a test rejects the model: [`Reason::Multipath`] or
    /// [`Reason::MoreSources`]. A model that holds is rejected with a probability of 1 %.
    pub fn misfit(&self) -> Option<Reason> {
        self.model.tests().misfit([self.coherent, self.noise])
    }

    /// Returns the probability that a model that holds has an equal or worse fit, from the worse of
    /// both ratios. It is 1 if there is nothing to test: a single snapshot with unknown noise.
    ///
    /// The F distribution is approximated by Paulson (1942). The relative error is below 10 % for
    /// probabilities above 1e-3, and the result is never far too small.
    pub fn p_value(&self) -> f64 {
        let ratios = [self.coherent, self.noise];
        let freedoms = self.model.freedoms();
        let tail = |(ratio, freedom): (f64, [f64; 2])| {
            0.5 * libm::erfc(deviate(ratio, freedom) * std::f64::consts::FRAC_1_SQRT_2)
        };
        let less = ratios
            .into_iter()
            .zip(freedoms)
            .map(tail)
            .fold(1.0, f64::min);
        // The minimum of two independent p-values has the distribution function 1 - (1 - p)^2.
        less * (2.0 - less)
    }
}

/// Result without any test.
impl Default for GoodnessOfFit {
    fn default() -> Self {
        Self {
            coherent: 1.0,
            noise: 1.0,
            model: Model::one::<2>(0, false),
        }
    }
}

/// Converts a ratio of variances to a standard normal deviate: with `a = 2 / (9 n1)`, `b = 2 / (9 n2)`
/// `((1 - b) F^(1/3) - (1 - a)) / sqrt(b F^(2/3) + a)` (Paulson 1942). Minus infinity without
/// degrees of freedom.
fn deviate(ratio: f64, freedom: [f64; 2]) -> f64 {
    if freedom.iter().any(|it| *it < 1.0) {
        return f64::NEG_INFINITY;
    }
    let [a, b] = freedom.map(|it| 2.0 / (9.0 * it));
    let root = ratio.cbrt();
    ((1.0 - b) * root - (1.0 - a)) / (b * root * root + a).sqrt()
}

/// Returns the ratio whose [`deviate`] is [`FALSE_ALARM_DEVIATE`]; infinite if no ratio has it.
fn largest_ratio(freedom: [f64; 2]) -> f64 {
    if freedom.iter().any(|it| *it < 1.0) {
        return f64::INFINITY;
    }
    let [a, b] = freedom.map(|it| 2.0 / (9.0 * it));
    let squared = FALSE_ALARM_DEVIATE * FALSE_ALARM_DEVIATE;
    // Larger solution of a quadratic equation for the cube root.
    let quadratic = (1.0 - b) * (1.0 - b) - squared * b;
    if quadratic <= 0.0 {
        return f64::INFINITY;
    }
    let linear = (1.0 - a) * (1.0 - b);
    let constant = (1.0 - a) * (1.0 - a) - squared * a;
    let root = (linear + (linear * linear - quadratic * constant).sqrt()) / quadratic;
    root * root * root
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_match_published_tables() {
        // Upper 0.5 % points of the F distribution and of the reduced chi-squared distribution.
        for (freedom, expected) in [
            ([5.0, 10.0], 6.87),
            ([5.0, 60.0], 3.76),
            ([1.0, 40.0], 8.83),
            ([12.0, 120.0], 2.54),
            ([5.0, f64::INFINITY], 3.35),
            ([8.0, f64::INFINITY], 2.744),
        ] {
            let found = largest_ratio(freedom);
            assert!(
                (found / expected - 1.0).abs() < 0.02,
                "{freedom:?}: {found}"
            );
            assert!((deviate(found, freedom) - FALSE_ALARM_DEVIATE).abs() < 1e-9);
        }
        assert_eq!(largest_ratio([5.0, 0.0]), f64::INFINITY);
    }
}
