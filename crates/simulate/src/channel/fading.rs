//! Rician fading across the array and shadowing. The scatter is constant during an SSB.

use std::f64::consts::TAU;

use num_complex::Complex64;
use onboard::observation::MAX_ELEMENTS;
use rand::RngExt;

use super::blockage::Blockage;
use super::propagation::{Link, Propagation};
use super::shadowing::Shadowing;
use crate::phasor::phasor;
use crate::random::Purpose;
use crate::scenario::{ChannelSettings, ScatterModel};
use crate::world::{Antennas, LineOfSight};

/// Propagation from one radio head in one run.
///
/// The scatter is a sum of plane waves with fixed directions, uniform over the sphere, and random
/// phases (Aulin's model). It is a function of the distance driven. Its autocorrelation is
/// sin(2πΔ/λ)/(2πΔ/λ), with the first zero at half a wavelength, and its Doppler spectrum is flat.
/// The phase of the line of sight rotates with its own Doppler shift. With a delay spread, each ray
/// has an exponentially distributed delay, which makes the channel frequency-selective.
#[derive(Debug, Clone)]
pub struct RicianPropagation {
    shadowing: Shadowing,
    blockage: Blockage,
    line_of_sight: f64,
    scatter: f64,
    wavenumber_per_m: f64,
    rays: Vec<Ray>,
    model: ScatterModel,
    /// Whether the scatter has a delay spread.
    dispersive: bool,
}

/// Plane wave at one antenna or at all antennas.
#[derive(Debug, Clone, Copy)]
struct Ray {
    /// Cosine of the angle to the forward axis, which determines the Doppler shift.
    cosine: f64,
    /// Complex amplitude at the start of the road.
    start: Complex64,
    /// Cosine of the angle to the left axis.
    left: f64,
    /// Delay relative to the line of sight in seconds.
    delay_s: f64,
}

impl RicianPropagation {
    /// Draws the propagation of a link.
    pub fn new(settings: &ChannelSettings, link: &Link<'_>) -> Self {
        let &Link {
            site,
            vehicle,
            head,
            streams,
            ..
        } = link;
        let mut rng = streams.generator(Purpose::Scatter, head);
        let k = 10f64.powf(0.1 * site.rician_k_db);
        let per_antenna = usize::from(settings.rays);
        let count = match settings.scatter {
            ScatterModel::PerAntenna => per_antenna * usize::from(vehicle.array.elements),
            ScatterModel::Rays => per_antenna,
        };
        let spread_s = 1e-9 * settings.delay_spread_ns;
        let mut delays = streams.generator(Purpose::ScatterDelay, head);
        let mut turns = streams.generator(Purpose::ScatterTurn, head);
        let rays = (0..count)
            .map(|_| {
                // A uniform direction on the sphere has a uniform cosine to any axis (Archimedes).
                let cosine = 2.0 * rng.random::<f64>() - 1.0;
                let sine = (1.0 - cosine * cosine).sqrt();
                Ray {
                    cosine,
                    start: Complex64::cis(rng.random::<f64>() * TAU),
                    left: sine * (TAU * turns.random::<f64>()).cos(),
                    // An exponential distribution has equal mean and standard deviation, both the
                    // delay spread.
                    delay_s: -spread_s * (1.0 - delays.random::<f64>()).ln(),
                }
            })
            .collect();
        Self {
            shadowing: Shadowing::new(settings, streams, head),
            blockage: Blockage::new(settings.blockage, link),
            line_of_sight: (k / (k + 1.0)).sqrt(),
            scatter: ((k + 1.0) * per_antenna as f64).recip().sqrt(),
            wavenumber_per_m: TAU / site.wavelength_m(),
            rays,
            model: settings.scatter,
            dispersive: spread_s > 0.0,
        }
    }
}

impl Propagation for RicianPropagation {
    fn next_gain_db(&mut self, sight: &LineOfSight) -> f64 {
        self.shadowing.next_db(sight.along_m)
    }

    fn response(
        &self,
        sight: &LineOfSight,
        antennas: &Antennas,
        step_hz: f64,
        into: &mut [Complex64],
    ) {
        let elements = antennas.elements();
        let turn = -self.wavenumber_per_m * sight.distance_m;
        let passing = self.blockage.amplitude(sight);
        let direct = Complex64::from_polar(self.line_of_sight * passing, turn);
        into.fill(Complex64::ZERO);
        for gains in into.chunks_exact_mut(elements) {
            antennas.add(direct, sight.towards, gains);
        }
        let first_hz = -((into.len() / elements / 2) as f64) * step_hz;
        let per_antenna = self.rays.len() / elements;
        // Without delays, the channel is equal at all frequencies.
        let count = if self.dispersive {
            into.len() / elements
        } else {
            1
        };
        for (number, ray) in self.rays.iter().enumerate() {
            let doppler = phasor(self.wavenumber_per_m * sight.along_m * ray.cosine);
            let mut wave = ray.start * doppler * self.scatter;
            let mut turn = Complex64::ONE;
            if self.dispersive {
                wave *= phasor(-TAU * first_hz * ray.delay_s);
                turn = phasor(-TAU * step_hz * ray.delay_s);
            }
            let mut response = [Complex64::ZERO; MAX_ELEMENTS];
            if let (ScatterModel::Rays, Some(response)) = (self.model, response.get_mut(..elements))
            {
                antennas.add(Complex64::ONE, [ray.cosine, ray.left], response);
            }
            for gains in into.chunks_exact_mut(elements).take(count) {
                match self.model {
                    ScatterModel::PerAntenna => {
                        if let Some(gain) = gains.get_mut(number / per_antenna) {
                            // Assignment operators of complex numbers are not inlined.
                            let sum = *gain + wave;
                            *gain = sum;
                        }
                    }
                    ScatterModel::Rays => {
                        for (gain, response) in gains.iter_mut().zip(&response) {
                            let sum = *gain + wave * response;
                            *gain = sum;
                        }
                    }
                }
                let next = wave * turn;
                wave = next;
            }
        }
        if !self.dispersive && into.len() > elements {
            let (first, others) = into.split_at_mut(elements);
            for gains in others.chunks_exact_mut(elements) {
                gains.copy_from_slice(first);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::LazyLock;

    use onboard::geometry::{Point, Pose};
    use onboard::road::{Road, Segment};
    use onboard::settings::{Shipped, Site, TomlFile, Vehicle};

    use super::*;
    use crate::random::Streams;

    const ELEMENTS: usize = 4;

    /// Vehicle of all runs. Reading it takes longer than a run.
    static VEHICLE: LazyLock<Vehicle> =
        LazyLock::new(|| Vehicle::from_library("paper", &Shipped).unwrap());

    fn site(k_db: f64) -> Site {
        let mut site = Site::from_library("paper", &Shipped).unwrap();
        site.rician_k_db = k_db;
        site
    }

    fn fading(
        site: &Site,
        scatter: ScatterModel,
        delay_spread_ns: f64,
        streams: Streams,
    ) -> RicianPropagation {
        let settings = ChannelSettings {
            scatter,
            delay_spread_ns,
            ..ChannelSettings::default()
        };
        let segment = Segment {
            length_m: 10.0,
            turn_rad: 0.0,
            surveyed: true,
        };
        let road = Road::from_segments(Pose::default(), &[segment], 5.0).unwrap();
        let link = Link {
            site,
            vehicle: &VEHICLE,
            road: &road,
            duration_s: 10.0,
            head: 0,
            streams,
        };
        RicianPropagation::new(&settings, &link)
    }

    fn sight(phase_rad: f64, along_m: f64) -> LineOfSight {
        let along = phase_rad / (0.5 * TAU);
        LineOfSight {
            towards: [along, (1.0 - along * along).sqrt()],
            distance_m: 0.0,
            place: Point::default(),
            axis_rad: 0.0,
            along_m,
            time_s: 0.0,
        }
    }

    fn row() -> Antennas {
        Antennas::new(&VEHICLE.array)
    }

    /// Returns the antenna gains at the carrier frequency.
    fn gains(fading: &RicianPropagation, phase_rad: f64, along_m: f64) -> [Complex64; ELEMENTS] {
        let mut gains = [Complex64::ZERO; ELEMENTS];
        fading.response(&sight(phase_rad, along_m), &row(), 0.0, &mut gains);
        gains
    }

    /// Returns the mean power of the scatter over runs and antennas.
    fn mean_power_of_scatter(k_db: f64, model: ScatterModel) -> f64 {
        let site = site(k_db);
        let runs = 4000;
        let scattered = |run| {
            let fading = fading(&site, model, 0.0, Streams::new(1, run));
            let direct = |n: usize| Complex64::from_polar(fading.line_of_sight, 0.3 * n as f64);
            let gains = gains(&fading, 0.3, 1.0);
            let scatter = gains.iter().enumerate().map(|(n, gain)| gain - direct(n));
            scatter.map(|gain| gain.norm_sqr()).sum::<f64>()
        };
        (0..runs).map(scattered).sum::<f64>() / (runs as f64 * ELEMENTS as f64)
    }

    #[test]
    fn rician_k_divides_the_power_between_line_of_sight_and_scatter() {
        for model in [ScatterModel::PerAntenna, ScatterModel::Rays] {
            for k_db in [0.0, 10.0, 20.0] {
                let k = 10f64.powf(0.1 * k_db);
                let scatter = mean_power_of_scatter(k_db, model);
                // The scatter power is exponentially distributed, so that the relative error is
                // 1/√runs.
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
            let site = site(-30.0);
            let wavelength_m = site.wavelength_m();
            // sin(x)/x at 0, π/4, π (its zero) and 3π/2.
            for (wavelengths, sinc) in [(0.0, 1.0), (0.125, 0.9003), (0.5, 0.0), (0.75, -0.2122)] {
                let runs = 4000;
                let product = |run| {
                    let fading = fading(&site, model, 0.0, Streams::new(2, run));
                    let here = gains(&fading, 0.0, 7.0);
                    let there = gains(&fading, 0.0, 7.0 + wavelengths * wavelength_m);
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
    fn scatter_is_independent_or_common_to_the_antennas_as_configured() {
        let product = |model| {
            let site = site(-30.0);
            let runs = 4000;
            let one = |run| {
                let fading = fading(&site, model, 0.0, Streams::new(4, run));
                let gains = gains(&fading, 0.0, 0.0);
                (gains[0].conj() * gains[1]).re
            };
            (0..runs).map(one).sum::<f64>() / runs as f64
        };
        assert!(product(ScatterModel::PerAntenna).abs() < 0.05);
        // Antennas at a distance of λ/2 in an isotropic field have the correlation sin(π)/π.
        assert!(product(ScatterModel::Rays).abs() < 0.05);
    }

    #[test]
    fn scatter_decorrelates_over_frequency_according_to_the_delay_spread() {
        for model in [ScatterModel::PerAntenna, ScatterModel::Rays] {
            let site = site(-30.0);
            let (runs, step_hz) = (4000, 250e3);
            let mut sums = [Complex64::ZERO; 4];
            for run in 0..runs {
                let mut gains = [Complex64::ZERO; 4 * ELEMENTS];
                fading(&site, model, 300.0, Streams::new(5, run)).response(
                    &sight(0.0, 3.0),
                    &row(),
                    step_hz,
                    &mut gains,
                );
                for (sum, there) in sums.iter_mut().zip(gains.chunks_exact(ELEMENTS)) {
                    let pairs = gains.iter().zip(there);
                    *sum += pairs.map(|(a, b)| a.conj() * b).sum::<Complex64>() / 4.0;
                }
            }
            for (step, sum) in sums.iter().enumerate() {
                // Characteristic function of an exponential distribution.
                let turns = step as f64 * step_hz * 300e-9;
                let expected = Complex64::new(1.0, TAU * turns).inv();
                // The fourth moment of a sum of eight rays is below two.
                let bound = 4.0 * (2.0 / runs as f64).sqrt();
                let deviation = sum / runs as f64 - expected;
                assert!(deviation.norm() < bound, "{model:?} {step}: {deviation}");
            }
        }
    }
}
