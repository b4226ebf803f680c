//! Whether the model, so many plane waves in white noise, explains what was received.
//!
//! With `R` the covariance of `L` snapshots of `N` antennas, `A` the steering vectors of the `K` sources,
//! `P` the projection on their complement and `y = A^+ x` the waveforms, what `P x` holds is regressed on
//! `y`. If the model holds, the two parts are independent:
//!
//! - what hangs together with the waveforms, `tr P R A (A^H R A)^-1 A^H R P`, less the part that is taken
//!   away by choosing the directions: `sigma^2 / (2 L) chi^2` of `2 K (N - K) - p` degrees of freedom, `p`
//!   being the parameters of the directions;
//! - the rest `E = R - R A (A^H R A)^-1 A^H R`, whose trace is `sigma^2 / (2 L) chi^2` of
//!   `2 (L - K) (N - K)`. It has no preferred direction.
//!
//! Their ratio is F distributed whatever the waveforms are, random or not (Anderson 2003, 8.4: regression
//! with complex observations). Reflections, and antennas that are not as described, are in the first
//! part. A further source is in the second: where the noise is not known, its form is tested by John's
//! statistic (1971), `(m tr E^2 / (tr E)^2 - 1) ((L - K) m + 1) / (m^2 - 1)` with `m = N - K`: 1 in the
//! mean, and about a chi^2 of `m^2 - 1` degrees of freedom over them. Where it is known, the trace is.

use super::verdict::Reason;
use crate::simd::math::select;

/// Either test finds fault with a model that holds with this probability: one in a hundred for both.
const FALSE_ALARM_DEVIATE: f64 = 2.575_829_303_548_901;

/// Degrees of freedom of an estimated noise variance from which on it counts as known: its error then adds less
/// than 1.6 % to a standard deviation.
const MANY_FREEDOMS: f64 = 100.0;
/// Minimum degrees of freedom of an estimated noise variance for a reliable angle. With fewer the ratio of error
/// to standard deviation exceeds 3 in more than 0.6 % of the estimates, or is below 0.9 RMS.
const FEWEST_FREEDOMS: f64 = 8.0;
/// Degrees of freedom of an estimated noise variance that double the SNR needed to exclude a wholly wrong direction.
/// With fewer the estimated SNR scatters more.
const FREEDOMS_AT_TWICE_THE_SNR: f64 = 10.0;
/// Relative increase of an angle's variance at the needed SNR; it falls with the cube of the SNR. An SNR near the
/// threshold exceeds it more often because the noise is underestimated than because it is small. Fitted so that angles
/// that are reliable in one fifth of the trials or more have a z-RMS from 0.9 to 1.15.
const INCREASE_AT_THRESHOLD: f64 = 0.6;

/// How well the sources and white noise explain what was received.
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
    /// Power beside the plane waves that hangs together with their waveforms, over that of noise there: a
    /// reduced chi-squared, 1 in the mean if the model holds.
    pub coherent: f64,
    /// What else is left: where the noise is known, its power over that of noise; elsewhere a measure of
    /// how much it prefers some directions. 1 in the mean if the model holds.
    pub noise: f64,
    model: Model,
}

/// What was fitted to what.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Model {
    pub(crate) antennas: u8,
    pub(crate) sources: u8,
    /// Parameters of all directions together.
    pub(crate) parameters: u8,
    pub(crate) noise_is_known: bool,
    pub(crate) snapshots: u32,
}

/// What the sources leave, summed over the snapshots.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Residual {
    /// Power that hangs together with the waveforms.
    pub(crate) coherent: f64,
    /// `tr E` and `tr E^2`.
    pub(crate) rest: f64,
    pub(crate) rest_squared: f64,
}

/// The tests of a model, with what they need of it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Tests {
    model: Model,
    /// Degrees of freedom of both parts; one where there are none.
    coherent_freedom: f64,
    rest_freedom: f64,
    dimensions_left: f64,
    /// Factor on the variance of an angle far above the threshold SNR, and its increase at that SNR.
    unknown_noise: f64,
    increase_at_threshold: f64,
    /// Factor on the threshold SNR.
    needed: f64,
    is_noise_determined: bool,
    /// John's statistic is this times `m tr E^2 / (tr E)^2 - 1`; without a meaning in one dimension.
    shape: Option<f64>,
    /// The largest ratios that are still called a fit.
    coherent_limit: f64,
    noise_limit: f64,
}

/// What the tests say of a residual.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Tested {
    pub(crate) coherent: f64,
    pub(crate) noise: f64,
    /// By what factor the variance of an angle is larger than noise makes it: 1 if the model fits.
    /// Otherwise what hangs together with the waveforms is taken to displace the angle as it does
    /// everything else: the square of Birge's ratio (1932).
    pub(crate) inflation: f64,
}

impl Model {
    /// One source in electrical angle.
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

    /// Degrees of freedom of the noise variance of one source, from all that the source does not explain.
    fn noise_freedom(self) -> f64 {
        self.residual_dimensions() - f64::from(self.parameters)
    }

    /// Real dimensions that the source leaves in all snapshots.
    fn residual_dimensions(self) -> f64 {
        2.0 * f64::from(self.snapshots) * self.dimensions_left()
    }

    /// Whether the noise is known, or as good as known. Several sources keep their asymptotic variance.
    fn has_known_noise(self) -> bool {
        self.noise_is_known || self.sources != 1 || self.noise_freedom() >= MANY_FREEDOMS
    }

    /// Factor on the variance of an angle because the noise variance is estimated with `f` degrees of freedom.
    ///
    /// The residual's power is divided by all of its dimensions, `f + p`, although `p` of them were fitted. The
    /// angle's error over its standard deviation then follows Student's t distribution of `f` degrees of freedom,
    /// whose variance is `f / (f - 2)`. `f / (f - 3)` in its place also keeps the share beyond three standard
    /// deviations below 0.6 %, for `f` from 7 on.
    fn unknown_noise(self) -> f64 {
        if self.has_known_noise() {
            return 1.0;
        }
        let remaining = self.noise_freedom() - 3.0;
        self.residual_dimensions() / remaining.max(1.0)
    }

    /// Factor on the SNR needed to exclude a wholly wrong direction, because the noise variance is estimated.
    fn needed(self) -> f64 {
        if self.has_known_noise() {
            return 1.0;
        }
        self.unknown_noise() * (1.0 + FREEDOMS_AT_TWICE_THE_SNR / self.noise_freedom().max(1.0))
    }

    /// Degrees of freedom of each ratio, above and below the line.
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
    /// No residual, and no misfit.
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
    /// `noise_power` is the noise variance per antenna, `power` that of all antennas, both summed over
    /// the snapshots: relative to the latter rounding is told from noise.
    #[inline(always)]
    pub(crate) fn of(&self, left: &Residual, noise_power: f64, power: f64) -> Tested {
        const ROUNDING: f64 = 1e-13;
        let larger = |a: f64, b: f64| if a > b { a } else { b };
        let least = power * ROUNDING;
        let rest = larger(left.rest, least);
        // The variance of noise in one real dimension, as stated or estimated and as the rest has it.
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

    /// That as it is told.
    #[inline(always)]
    pub(crate) const fn fit(&self, tested: &Tested) -> GoodnessOfFit {
        GoodnessOfFit {
            coherent: tested.coherent,
            noise: tested.noise,
            model: self.model,
        }
    }

    /// SNR needed to exclude a wholly wrong direction, where `with_known_noise` is the one for known noise.
    pub(crate) const fn needed_snr(&self, with_known_noise: f64) -> f64 {
        self.needed * with_known_noise
    }

    /// Factor on the variance of an angle, because the noise variance is estimated. `needed_snr` is that of
    /// [`Self::needed_snr`].
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

    /// What is wrong with the model, if something is.
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
    /// What is wrong with the model, if one of the tests finds fault with it: [`Reason::Multipath`] or
    /// [`Reason::MoreSources`]. Of a model that holds it is said once in a hundred times.
    pub fn misfit(&self) -> Option<Reason> {
        self.model.tests().misfit([self.coherent, self.noise])
    }

    /// The probability that a model that holds fits as badly as this or worse, from the worse of both
    /// ratios. 1 where nothing is left to test: a single snapshot, unless the noise is known.
    ///
    /// By Paulson's approximation of the F distribution (1942): within a tenth down to 1e-3, and never
    /// much too small.
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
        // They are independent.
        less * (2.0 - less)
    }
}

/// Nothing was tested.
impl Default for GoodnessOfFit {
    fn default() -> Self {
        Self {
            coherent: 1.0,
            noise: 1.0,
            model: Model::one::<2>(0, false),
        }
    }
}

/// A ratio of variances as a standard normal deviate: with `a = 2 / (9 n1)`, `b = 2 / (9 n2)`
/// `((1 - b) F^(1/3) - (1 - a)) / sqrt(b F^(2/3) + a)` (Paulson 1942). Minus infinity if there is
/// nothing to compare.
fn deviate(ratio: f64, freedom: [f64; 2]) -> f64 {
    if freedom.iter().any(|it| *it < 1.0) {
        return f64::NEG_INFINITY;
    }
    let [a, b] = freedom.map(|it| 2.0 / (9.0 * it));
    let root = ratio.cbrt();
    ((1.0 - b) * root - (1.0 - a)) / (b * root * root + a).sqrt()
}

/// The ratio whose [`deviate`] is that of a false alarm; infinite if no ratio is so large.
fn largest_ratio(freedom: [f64; 2]) -> f64 {
    if freedom.iter().any(|it| *it < 1.0) {
        return f64::INFINITY;
    }
    let [a, b] = freedom.map(|it| 2.0 / (9.0 * it));
    let squared = FALSE_ALARM_DEVIATE * FALSE_ALARM_DEVIATE;
    // A quadratic equation for the cube root, its larger solution.
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
    fn ratios_are_those_of_the_tables() {
        // Upper 0.5 % points of the F distribution, and of chi-squared over its freedom.
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
