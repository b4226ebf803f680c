//! Rician fading across the array: a line of sight and scatter that stands still during an SSB.

use std::f64::consts::TAU;

use num_complex::Complex64;
use rand::RngExt;

use crate::observation::{ANTENNAS, Snapshot};
use crate::random::{Purpose, Streams};
use crate::scenario::{ScatterModel, Scenario};

/// The fading of one radio head in one run.
///
/// The scatter is a sum of plane waves of fixed directions, uniform over the sphere, and random
/// phases (Aulin's model), so that it is a function of the distance driven: its autocorrelation is
/// sin(2πΔ/λ)/(2πΔ/λ), first zero at half a wavelength, and its Doppler spectrum is flat. Like any
/// wave, the line of sight turns its phase with its own Doppler. Where scatter has a delay spread,
/// each ray's delay is exponentially distributed, and the channel varies over the band. Nothing is drawn while driving,
/// and an SSB fades the same whether or not the ones before it were heard.
#[derive(Debug, Clone)]
pub struct RicianFading {
    line_of_sight: f64,
    scatter: f64,
    wavenumber_per_m: f64,
    rays: Vec<Ray>,
    model: ScatterModel,
    /// Whether the scatter is delayed against the line of sight.
    dispersive: bool,
}

/// A plane wave, for one antenna or for all.
#[derive(Debug, Clone, Copy)]
struct Ray {
    /// Cosine of its direction to the forward axis: its Doppler.
    cosine: f64,
    /// Its amplitude at the start.
    start: Complex64,
    /// Phase step from antenna to antenna.
    step: Complex64,
    /// Delay after the line of sight, in seconds.
    delay_s: f64,
}

impl RicianFading {
    /// The fading of radio head number `head`.
    pub fn new(scenario: &Scenario, streams: Streams, head: usize) -> Self {
        let settings = &scenario.channel;
        let mut rng = streams.generator(Purpose::Scatter, head);
        let k = 10f64.powf(0.1 * settings.rician_k_db);
        let per_antenna = usize::from(settings.rays);
        let count = match settings.scatter {
            ScatterModel::PerAntenna => per_antenna * ANTENNAS,
            ScatterModel::Rays => per_antenna,
        };
        let element_rad = TAU * scenario.array.spacing_wavelengths;
        let spread_s = 1e-9 * settings.delay_spread_ns;
        let mut delays = streams.generator(Purpose::ScatterDelay, head);
        let rays = (0..count)
            .map(|_| {
                // Uniform over the sphere is uniform in the cosine to any axis (Archimedes).
                let cosine = 2.0 * rng.random::<f64>() - 1.0;
                Ray {
                    cosine,
                    start: Complex64::cis(rng.random::<f64>() * TAU),
                    step: Complex64::cis(element_rad * cosine),
                    // Exponential: mean and standard deviation are the spread.
                    delay_s: -spread_s * (1.0 - delays.random::<f64>()).ln(),
                }
            })
            .collect();
        Self {
            line_of_sight: (k / (k + 1.0)).sqrt(),
            scatter: ((k + 1.0) * per_antenna as f64).recip().sqrt(),
            wavenumber_per_m: TAU / scenario.ssb.wavelength_m(),
            rays,
            model: settings.scatter,
            dispersive: spread_s > 0.0,
        }
    }

    /// Gains of the antennas at the carrier, of unit mean power, for a line of sight of electrical
    /// angle `phase_rad` after `driven_m`, at `range_m` from the radio head.
    pub fn gains(&self, phase_rad: f64, driven_m: f64, range_m: f64) -> Snapshot {
        let mut gains = [[Complex64::ZERO; ANTENNAS]];
        self.response(phase_rad, driven_m, range_m, 0.0, &mut gains);
        let [gains] = gains;
        gains
    }

    /// The same at frequencies `step_hz` apart, the carrier in their middle (of an even number, just
    /// above it). The line of sight has no delay.
    pub fn response(
        &self,
        phase_rad: f64,
        driven_m: f64,
        range_m: f64,
        step_hz: f64,
        into: &mut [Snapshot],
    ) {
        let direct = Complex64::from_polar(self.line_of_sight, -self.wavenumber_per_m * range_m);
        into.fill(steering_vector(phase_rad).map(|gain| gain * direct));
        let first_hz = -((into.len() / 2) as f64) * step_hz;
        let per_antenna = self.rays.len() / ANTENNAS;
        // Without delays one frequency is like another.
        let count = if self.dispersive { into.len() } else { 1 };
        for (number, ray) in self.rays.iter().enumerate() {
            let doppler = Complex64::cis(self.wavenumber_per_m * driven_m * ray.cosine);
            let mut wave = ray.start * doppler * self.scatter;
            wave *= Complex64::cis(-TAU * first_hz * ray.delay_s);
            let turn = Complex64::cis(-TAU * step_hz * ray.delay_s);
            for gains in into.iter_mut().take(count) {
                match self.model {
                    ScatterModel::PerAntenna => {
                        if let Some(gain) = gains.get_mut(number / per_antenna) {
                            *gain += wave;
                        }
                    }
                    ScatterModel::Rays => {
                        let mut here = wave;
                        for gain in gains {
                            *gain += here;
                            here *= ray.step;
                        }
                    }
                }
                wave *= turn;
            }
        }
        if let (false, Some(&gains)) = (self.dispersive, into.first()) {
            into.fill(gains);
        }
    }
}

fn steering_vector(phase_rad: f64) -> Snapshot {
    let step = Complex64::cis(phase_rad);
    let mut gain = Complex64::ONE;
    [(); ANTENNAS].map(|()| {
        let here = gain;
        gain *= step;
        here
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scenario(k_db: f64, scatter: ScatterModel) -> Scenario {
        let mut scenario = Scenario::load("paper").unwrap();
        scenario.channel.rician_k_db = k_db;
        scenario.channel.scatter = scatter;
        scenario
    }

    /// Mean over runs of f(gains) at antenna 0 of an arriving line of sight at broadside.
    fn mean_power_of_scatter(k_db: f64, model: ScatterModel) -> f64 {
        let scenario = scenario(k_db, model);
        let runs = 4000;
        let scattered = |run| {
            let fading = RicianFading::new(&scenario, Streams::new(1, run), 0);
            let gains = fading.gains(0.3, 1.0, 0.0);
            let line_of_sight = steering_vector(0.3);
            gains
                .iter()
                .zip(line_of_sight)
                .map(|(gain, direct)| (gain - direct * fading.line_of_sight).norm_sqr())
                .sum::<f64>()
        };
        (0..runs).map(scattered).sum::<f64>() / (runs as f64 * ANTENNAS as f64)
    }

    #[test]
    fn k_divides_the_power() {
        for model in [ScatterModel::PerAntenna, ScatterModel::Rays] {
            for k_db in [0.0, 10.0, 20.0] {
                let k = 10f64.powf(0.1 * k_db);
                let scatter = mean_power_of_scatter(k_db, model);
                // Scatter power is exponential: relative error 1/√runs, with 4 antennas alike.
                assert!(
                    (scatter * (k + 1.0) - 1.0).abs() < 4.0 / 4000f64.sqrt(),
                    "{model:?} {k_db}"
                );
            }
        }
    }

    #[test]
    fn scatter_decorrelates_over_half_a_wavelength() {
        for model in [ScatterModel::PerAntenna, ScatterModel::Rays] {
            let scenario = scenario(-30.0, model);
            let wavelength_m = scenario.ssb.wavelength_m();
            // sin(x)/x at 0, π/4, π (its zero) and 3π/2.
            for (wavelengths, sinc) in [(0.0, 1.0), (0.125, 0.9003), (0.5, 0.0), (0.75, -0.2122)] {
                let runs = 4000;
                let product = |run| {
                    let fading = RicianFading::new(&scenario, Streams::new(2, run), 0);
                    let here = fading.gains(0.0, 7.0, 0.0);
                    let there = fading.gains(0.0, 7.0 + wavelengths * wavelength_m, 0.0);
                    here.iter()
                        .zip(there)
                        .map(|(a, b)| (a.conj() * b).re)
                        .sum::<f64>()
                        / 4.0
                };
                let correlation = (0..runs).map(product).sum::<f64>() / runs as f64;
                assert!(
                    (correlation - sinc).abs() < 0.07,
                    "{model:?} {wavelengths}: {correlation}"
                );
            }
        }
    }

    #[test]
    fn antennas_fade_apart_or_together() {
        let product = |model| {
            let scenario = scenario(-30.0, model);
            let runs = 4000;
            let one = |run| {
                let gains =
                    RicianFading::new(&scenario, Streams::new(4, run), 0).gains(0.0, 0.0, 0.0);
                (gains[0].conj() * gains[1]).re
            };
            (0..runs).map(one).sum::<f64>() / runs as f64
        };
        assert!(product(ScatterModel::PerAntenna).abs() < 0.05);
        // Neighbours at λ/2 in an isotropic field: sin(π)/π.
        assert!(product(ScatterModel::Rays).abs() < 0.05);
    }

    #[test]
    fn scatter_decorrelates_over_frequency_as_its_delays_have_it() {
        for model in [ScatterModel::PerAntenna, ScatterModel::Rays] {
            let mut scenario = scenario(-30.0, model);
            scenario.channel.delay_spread_ns = 300.0;
            let (runs, step_hz) = (4000, 250e3);
            let mut sums = [Complex64::ZERO; 4];
            for run in 0..runs {
                let mut gains = [[Complex64::ZERO; ANTENNAS]; 4];
                RicianFading::new(&scenario, Streams::new(5, run), 0)
                    .response(0.0, 3.0, 0.0, step_hz, &mut gains);
                for (sum, there) in sums.iter_mut().zip(&gains) {
                    let pairs = gains[0].iter().zip(there);
                    *sum += pairs.map(|(a, b)| a.conj() * b).sum::<Complex64>() / 4.0;
                }
            }
            for (step, sum) in sums.iter().enumerate() {
                // The characteristic function of an exponential distribution.
                let turns = step as f64 * step_hz * 300e-9;
                let expected = Complex64::new(1.0, TAU * turns).inv();
                // Fourth moments of a sum of eight rays: below two.
                let bound = 4.0 * (2.0 / runs as f64).sqrt();
                let deviation = sum / runs as f64 - expected;
                assert!(deviation.norm() < bound, "{model:?} {step}: {deviation}");
            }
        }
    }
}
