//! Range rate: from the phase difference to the previous SSB, or from the phase slope within one
//! SSB.
//!
//! A frequency offset `f` at the carrier `F` is a rate `−c f/F` of the pseudorange: motion and both
//! oscillators. One cell cannot separate them. The oscillator of the receiver is common to all cells;
//! [`RangeRate::without_oscillator`] removes an estimate of its offset.
//!
//! Two carrier phases with standard deviations σ₁ and σ₂ in a time T give the mean offset with
//! `√(σ₁² + σ₂²)/(2πT)`, ambiguous by multiples of `1/T`. The number of cycles follows from a
//! prediction: the previous rate, whose variance grows with the acceleration and the oscillator, and
//! the offset within each SSB. If half the ambiguity is below [`RESOLVED`] standard deviations of
//! the prediction, the result is the offset within this SSB instead.

use std::f64::consts::{FRAC_1_SQRT_2, TAU};

use num_complex::Complex64;

use crate::dsp::received_grid::PerAntenna;
use crate::numeric::phasors::wrap;

/// Speed of light in m/s.
const LIGHT_M_S: f64 = 299_792_458.0;
/// Half the ambiguity, in standard deviations of the prediction, that is required for a result from a
/// phase difference. The probability of a wrong number of cycles is 6e-5.
const RESOLVED: f64 = 4.0;
/// Acceleration along the line of sight in m/s², one standard deviation: braking of a vehicle.
const ACCELERATION_M_S2: f64 = 2.0;
/// Random walk of the oscillators' relative frequency per square root of second: a TCXO.
const OSCILLATOR_PER_SQRT_S: f64 = 1e-9;
/// Standard deviation of the speed relative to the surroundings, in m/s, which determines the
/// Doppler spread of multipath: a fast vehicle of a factory.
const SPEED_M_S: f64 = 5.0;
/// Number of standard deviations of noise by which the antennas' amplitudes may disagree.
const DISAGREEMENT: f64 = 3.0;

/// Information that determines a range rate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum RateSource {
    /// Phase difference to the previous SSB: mean rate since then.
    PhaseDifference,
    /// Phase slope within this SSB: rate at its time.
    WithinSsb,
}

impl RateSource {
    /// Returns the name in tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::PhaseDifference => "phase difference",
            Self::WithinSsb => "within SSB",
        }
    }
}

/// Rate of the pseudorange.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RangeRate {
    /// Frequency offset in Hz, from `source`.
    pub frequency_hz: f64,
    /// Its standard deviation in Hz: noise and multipath.
    pub sigma_hz: f64,
    /// Rate of the pseudorange in m/s, positive if the distance increases, including the frequency
    /// offset of both oscillators.
    pub rate_m_s: f64,
    /// Its standard deviation in m/s.
    pub sigma_m_s: f64,
    /// Source of the rate.
    pub source: RateSource,
    /// Time since the previous SSB in seconds; zero without one.
    pub interval_s: f64,
    /// Phase difference to the previous SSB in rad, within ±π, for users that resolve its cycles
    /// themselves, and its standard deviation; the latter is infinite without a previous SSB.
    pub phase_change_rad: f64,
    /// Standard deviation of `phase_change_rad` in rad.
    pub phase_change_sigma_rad: f64,
    /// Change of the rate for one cycle of the phase difference, in m/s; infinite without a previous
    /// SSB.
    pub ambiguity_m_s: f64,
    /// Probability of a wrong number of cycles, if the rate is from the phase difference.
    pub wrong_cycles_probability: f64,
    /// Carrier frequency in Hz.
    pub carrier_hz: f64,
}

impl RangeRate {
    /// Returns the range rate in m/s and its standard deviation without an oscillator offset in Hz
    /// and its standard deviation: receiver minus transmitter, from a clock state, a standstill or
    /// other cells.
    pub fn without_oscillator(&self, offset_hz: f64, sigma_hz: f64) -> (f64, f64) {
        let wavelength_m = LIGHT_M_S / self.carrier_hz;
        (
            self.rate_m_s + wavelength_m * offset_hz,
            self.sigma_m_s.hypot(wavelength_m * sigma_hz),
        )
    }
}

/// Frequency offset and amplitudes of one SSB.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Instant {
    /// Reference time in seconds.
    pub(crate) time_s: f64,
    /// Complex amplitude of each antenna at the reference time.
    pub(crate) amplitudes: PerAntenna<Complex64>,
    /// Variance of each amplitude due to noise.
    pub(crate) variance: PerAntenna<f64>,
    /// Variance of the phase due to multipath, at one antenna.
    pub(crate) multipath: f64,
    /// Frequency offset within the SSB in Hz.
    pub(crate) frequency_hz: f64,
    /// Variance of the frequency offset within the SSB due to noise (Hz²).
    pub(crate) frequency_variance: f64,
}

/// Range rate of one beam.
#[derive(Debug, Clone)]
pub(crate) struct RateTracker {
    carrier_hz: f64,
    previous: Option<Previous>,
}

#[derive(Debug, Clone)]
struct Previous {
    instant: Instant,
    /// Most accurate estimate of the frequency offset in Hz.
    frequency_hz: f64,
    /// Variance of this estimate (Hz²).
    variance: f64,
}

impl RateTracker {
    pub(crate) const fn new(carrier_hz: f64) -> Self {
        Self {
            carrier_hz,
            previous: None,
        }
    }

    /// Removes the previous SSB, whose phase is not continuous with the next one.
    pub(crate) fn forget(&mut self) {
        self.previous = None;
    }

    /// Returns the variance of the frequency offset within an SSB due to multipath in Hz², for the
    /// variance of the phase.
    pub(crate) fn multipath_variance(&self, phase_variance: f64) -> f64 {
        (SPEED_M_S * self.carrier_hz / LIGHT_M_S).powi(2) * phase_variance
    }

    /// Processes the next SSB.
    pub(crate) fn follow(&mut self, instant: Instant) -> RangeRate {
        let wavelength_m = LIGHT_M_S / self.carrier_hz;
        let own_variance = instant.frequency_variance
            + self.multipath_variance(instant.multipath) / instant.variance.len() as f64;
        let mut rate = RangeRate {
            frequency_hz: instant.frequency_hz,
            sigma_hz: own_variance.sqrt(),
            rate_m_s: 0.0,
            sigma_m_s: 0.0,
            source: RateSource::WithinSsb,
            interval_s: 0.0,
            phase_change_rad: 0.0,
            phase_change_sigma_rad: f64::INFINITY,
            ambiguity_m_s: f64::INFINITY,
            wrong_cycles_probability: 0.0,
            carrier_hz: self.carrier_hz,
        };
        let (mut best, mut variance) = (instant.frequency_hz, own_variance);
        let previous = self.previous.take();
        if let Some(previous) = previous.filter(|it| it.instant.time_s < instant.time_s) {
            // Predict the mean offset of the interval from the last result and this SSB.
            let interval_s = instant.time_s - previous.instant.time_s;
            let walk = OSCILLATOR_PER_SQRT_S * self.carrier_hz;
            let growth =
                (ACCELERATION_M_S2 * interval_s / wavelength_m).powi(2) + walk * walk * interval_s;
            let predicted = previous.variance + growth;
            let gain = predicted / (predicted + own_variance);
            best = previous.frequency_hz + gain * (best - previous.frequency_hz);
            variance = (1.0 - gain) * predicted;
            // Resolve the number of cycles of the phase difference.
            let (change, change_variance) = phase_change(&previous.instant, &instant);
            let excess = wrap(change - TAU * (best * interval_s).fract());
            let sigma = (change_variance / (TAU * interval_s).powi(2) + variance + growth).sqrt();
            let half_ambiguity = 0.5 / interval_s;
            rate.interval_s = interval_s;
            rate.phase_change_rad = change;
            rate.phase_change_sigma_rad = change_variance.sqrt();
            rate.ambiguity_m_s = wavelength_m / interval_s;
            if half_ambiguity > RESOLVED * sigma {
                rate.source = RateSource::PhaseDifference;
                rate.frequency_hz = best + excess / (TAU * interval_s);
                rate.sigma_hz = change_variance.sqrt() / (TAU * interval_s);
                rate.wrong_cycles_probability = tails(half_ambiguity / sigma);
                (best, variance) = (rate.frequency_hz, rate.sigma_hz.powi(2));
            }
        }
        rate.rate_m_s = -wavelength_m * rate.frequency_hz;
        rate.sigma_m_s = wavelength_m * rate.sigma_hz;
        self.previous = Some(Previous {
            instant,
            frequency_hz: best,
            variance,
        });
        rate
    }
}

/// Returns the phase of `next` relative to `previous`, and its variance: noise, multipath, and the
/// disagreement of the antennas due to a turn of the array.
fn phase_change(previous: &Instant, next: &Instant) -> (f64, f64) {
    let (mut product, mut energies) = (Complex64::ZERO, [0.0; 2]);
    let antennas = next.variance.len() as f64;
    let variances = || {
        previous
            .variance
            .iter()
            .zip(&next.variance)
            .map(|(a, b)| a + b)
    };
    let amplitudes = previous.amplitudes.iter().zip(&next.amplitudes);
    for ((a, b), variance) in amplitudes.zip(variances()) {
        let weight = 1.0 / variance.max(1e-300);
        product += a.conj() * b * weight;
        energies[0] += a.norm_sqr() * weight;
        energies[1] += b.norm_sqr() * weight;
    }
    // Each weight is the inverse of the sum of both variances. The noise of one amplitude is its
    // own share of this sum.
    let share = |of: &Instant| {
        let shares = of.variance.iter().zip(variances());
        let total: f64 = shares.map(|(own, sum)| own / sum.max(1e-300)).sum();
        total / antennas
    };
    let [first, second] = energies.map(|it| it.max(1e-300));
    let relative = share(previous) / first + share(next) / second;
    let noise = 0.5 * relative;
    let coherence = (product.norm_sqr() / (first * second)).clamp(1e-6, 1.0);
    let expected = DISAGREEMENT * (antennas - 1.0) * relative;
    let disagreement = (1.0 / coherence - 1.0 - expected).max(0.0) / antennas;
    let multipath = (previous.multipath + next.multipath) / antennas;
    (product.arg(), noise + multipath + disagreement)
}

/// Returns the probability that a standard normal variable is beyond ±`limit`, within 1e-7
/// (Abramowitz and Stegun, 7.1.26).
fn tails(limit: f64) -> f64 {
    let x = limit * FRAC_1_SQRT_2;
    let t = 1.0 / (1.0 + 0.327_591_1 * x);
    let polynomial = t
        * (0.254_829_592
            + t * (-0.284_496_736
                + t * (1.421_413_741 + t * (-1.453_152_027 + t * 1.061_405_429))));
    polynomial * (-x * x).exp()
}
