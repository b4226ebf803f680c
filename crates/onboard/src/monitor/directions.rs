//! Number of directions from which the signal of each radio head arrives.
//!
//! A second radio head with the same PCI and SSB index, or a reflection of similar power, adds a
//! second plane wave. One and two plane waves are fitted to the covariance of the snapshots over a
//! window of SSBs. Diffuse scatter has no direction: averaged over its fading, two waves explain
//! little more of it than one. The errors of the array are equal for both waves and part of the
//! residual.

use std::f64::consts::TAU;

use num_complex::Complex64;

use super::fault::Fault;
use crate::observation::{MAX_ELEMENTS, SsbObservation};
use crate::settings::{Site, Vehicle};

/// Number of SSBs in a window.
const WINDOW: u32 = 8;
/// Number of consecutive windows with a second direction after which it is reported.
const BEGINS: u32 = 2;
/// Number of consecutive windows without a second direction after which the report ends.
const ENDS: u32 = 4;
/// Minimum motion in metres between two SSBs in a window. The fading changes within half a
/// wavelength. At standstill, scatter is as constant as a second wave.
const FADING_M: f64 = 0.03;
/// Minimum SNR of an SSB with all its snapshots, in dB.
const MIN_SNR_DB: f64 = 13.0;
/// Minimum fraction of the power in the second wave.
const MIN_SHARE: f64 = 0.15;
/// Minimum ratio of the power of the second wave to the residual of both waves. Scatter has a ratio
/// of about 1, because the second wave explains at most half of the three dimensions that the first
/// wave leaves.
const MIN_RATIO: f64 = 4.0;
/// Number of steering vectors.
const DIRECTIONS: usize = 64;
/// Maximum squared correlation between the steering vectors of both directions.
const MAX_CORRELATION: f64 = 0.8;
/// Minimum Rician K of the site in dB. With stronger scatter, up to one false report per run was
/// measured, because reflections resemble a second radio head over 16 SSBs.
const MIN_K_DB: f64 = 13.0;
/// Minimum number of antennas.
const MIN_ANTENNAS: usize = 3;
/// Maximum number of antennas.
const MAX_ANTENNAS: usize = 8;

type Vector = [Complex64; MAX_ELEMENTS];

/// Window of the SSBs of one radio head and SSB index.
#[derive(Debug, Clone, Copy)]
struct Window {
    pci: u16,
    ssb_index: u8,
    distance_m: f64,
    count: u32,
    covariance: [Vector; MAX_ELEMENTS],
    /// Number of consecutive windows with a second direction.
    with: u32,
    /// Number of consecutive windows without a second direction.
    without: u32,
    is_reported: bool,
}

/// Monitor of the number of directions of each radio head.
#[derive(Debug)]
pub struct DirectionMonitor {
    elements: usize,
    /// Steering vectors; empty if the array or the site does not support this test.
    steering: Vec<Vector>,
    /// Products of the covariance and the steering vectors.
    products: Vec<Vector>,
    windows: Vec<Window>,
}

impl DirectionMonitor {
    /// Creates the monitor for the array of a vehicle at a site with this number of radio heads.
    pub fn new(site: &Site, vehicle: &Vehicle, heads: usize) -> Self {
        let elements = usize::from(vehicle.array.elements);
        let is_used = site.rician_k_db >= MIN_K_DB
            && vehicle.array.shape.is_row()
            && (MIN_ANTENNAS..=MAX_ANTENNAS).contains(&elements);
        let phase_rad = |number: usize| TAU * number as f64 / DIRECTIONS as f64;
        let vector = |number: usize| {
            std::array::from_fn(|antenna| Complex64::cis(phase_rad(number) * antenna as f64))
        };
        let steering: Vec<Vector> = if is_used {
            (0..DIRECTIONS).map(vector).collect()
        } else {
            Vec::new()
        };
        Self {
            elements,
            products: steering.clone(),
            steering,
            windows: Vec::with_capacity(heads),
        }
    }

    /// Processes an SSB that was received at the driven distance `distance_m`. Calls `change` for
    /// each fault that begins or ends.
    pub fn ssb(
        &mut self,
        observation: &SsbObservation,
        distance_m: f64,
        change: &mut dyn FnMut(Fault, bool),
    ) {
        let (values, elements) = (observation.values(), self.elements);
        let power: f64 = values.iter().map(Complex64::norm_sqr).sum();
        let noise = (observation.noise_variance).map(|it| it * values.len() as f64);
        let snr_db = noise.map_or(observation.ssb.snr_db, |it| 10.0 * (power / it).log10());
        let is_usable = observation.elements() == elements && power.is_finite() && power > 0.0;
        if self.steering.is_empty() || !is_usable || snr_db < MIN_SNR_DB {
            return;
        }
        let Some(place) = self.window(observation, distance_m) else {
            return;
        };
        let Some(window) = self.windows.get_mut(place) else {
            return;
        };
        // Add the normalized covariance of the snapshots.
        for snapshot in values.chunks_exact(elements) {
            for (row, a) in window.covariance.iter_mut().zip(snapshot) {
                for (value, b) in row.iter_mut().zip(snapshot) {
                    *value += a * b.conj() / power;
                }
            }
        }
        window.count += 1;
        if window.count < WINDOW {
            return;
        }
        window.count = 0;
        let covariance = std::mem::take(&mut window.covariance);
        let [one, two] = self.residuals(&covariance);
        let second = one - two;
        let is_double = second >= MIN_SHARE && second >= MIN_RATIO * two;
        let Some(window) = self.windows.get_mut(place) else {
            return;
        };
        (window.with, window.without) = if is_double {
            (window.with + 1, 0)
        } else {
            (0, window.without + 1)
        };
        let is_reported = if window.is_reported {
            window.without < ENDS
        } else {
            window.with >= BEGINS
        };
        if std::mem::replace(&mut window.is_reported, is_reported) != is_reported {
            let (pci, ssb_index) = (window.pci, window.ssb_index);
            change(Fault::DuplicatePci { pci, ssb_index }, is_reported);
        }
    }

    /// Returns the index of the SSB's window; `None` if its fading is not independent of the
    /// previous SSB.
    fn window(&mut self, observation: &SsbObservation, distance_m: f64) -> Option<usize> {
        let ssb = observation.ssb;
        let is_same = |it: &Window| (it.pci, it.ssb_index) == (ssb.pci, ssb.ssb_index);
        let Some(place) = self.windows.iter().position(is_same) else {
            if self.windows.len() == self.windows.capacity() {
                return None;
            }
            self.windows.push(Window {
                pci: ssb.pci,
                ssb_index: ssb.ssb_index,
                distance_m,
                count: 0,
                covariance: Default::default(),
                with: 0,
                without: 0,
                is_reported: false,
            });
            return Some(self.windows.len() - 1);
        };
        let window = self.windows.get_mut(place)?;
        let is_independent = (distance_m - window.distance_m).abs() >= FADING_M;
        if is_independent {
            window.distance_m = distance_m;
        }
        is_independent.then_some(place)
    }

    /// Returns the fractions of the power that remain after the best fit of one and of two plane
    /// waves.
    fn residuals(&mut self, covariance: &[Vector; MAX_ELEMENTS]) -> [f64; 2] {
        let elements = self.elements;
        let dot = |a: &Vector, b: &Vector| -> Complex64 {
            let pairs = a.iter().zip(b).take(elements);
            pairs.map(|(a, b)| a.conj() * b).sum()
        };
        let total: f64 = (covariance.iter().enumerate())
            .filter_map(|(index, row)| row.get(index))
            .map(|it| it.re)
            .sum();
        for (product, vector) in self.products.iter_mut().zip(&self.steering) {
            for (value, row) in product.iter_mut().zip(covariance) {
                *value = row.iter().zip(vector).map(|(r, a)| r * a).sum();
            }
        }
        let norm = elements as f64;
        let (mut one, mut two) = (0.0_f64, 0.0_f64);
        for (index, (a, of_a)) in self.steering.iter().zip(&self.products).enumerate() {
            let power_a = dot(a, of_a).re / norm;
            one = one.max(power_a);
            for (b, of_b) in self.steering.iter().zip(&self.products).take(index) {
                // Power in the plane of both vectors, calculated with the inverse of their Gram
                // matrix.
                let correlation = dot(a, b) / norm;
                let independent = 1.0 - correlation.norm_sqr();
                if independent < 1.0 - MAX_CORRELATION {
                    continue;
                }
                let power_b = dot(b, of_b).re / norm;
                let cross = dot(b, of_a) / norm;
                let power = (power_a + power_b - 2.0 * (correlation * cross).re) / independent;
                two = two.max(power);
            }
        }
        [one, two.max(one)].map(|it| (1.0 - it / total.max(f64::MIN_POSITIVE)).max(0.0))
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::observation::SsbDetection;
    use crate::settings::{Shipped, TomlFile};

    /// Normal random numbers (linear congruential generator).
    struct Noise(u64);

    impl Noise {
        fn uniform(&mut self) -> f64 {
            self.0 = self
                .0
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            ((self.0 >> 33) as f64 + 0.5) / f64::from(1_u32 << 31)
        }

        fn normal(&mut self) -> Complex64 {
            let radius = (-self.uniform().ln()).sqrt();
            Complex64::from_polar(radius, TAU * self.uniform())
        }
    }

    /// Returns the changes within 400 SSBs, for given amplitudes of a second wave and of scatter.
    /// The vehicle moves by 4 cm between two SSBs.
    fn changes(second: f64, scatter: f64) -> Vec<(u32, Fault, bool)> {
        let vehicle = Vehicle::from_library("tugger", &Shipped).unwrap();
        let mut site = Site::from_library("yard", &Shipped).unwrap();
        site.rician_k_db = 20.0;
        let mut monitor = DirectionMonitor::new(&site, &vehicle, 4);
        let mut noise = Noise(5);
        let mut found = Vec::new();
        for number in 0..400_u32 {
            let mut observation = SsbObservation::new(4);
            let ssb = SsbDetection {
                pci: 11,
                ssb_index: 2,
                time_s: 0.02 * f64::from(number),
                snr_db: 20.0,
            };
            observation.restart(ssb);
            let (turn, slow) = (
                Complex64::cis(TAU * noise.uniform()),
                f64::from(number) * 1e-3,
            );
            let fading: [Complex64; 4] = std::array::from_fn(|_| noise.normal() * scatter);
            for _ in 0..4 {
                let snapshot: [Complex64; 4] = std::array::from_fn(|antenna| {
                    let wave = |phase_rad: f64| Complex64::cis(phase_rad * antenna as f64);
                    wave(0.5 + slow)
                        + turn * wave(0.5 + slow + 0.6 * PI) * second
                        + fading[antenna]
                        + noise.normal() * 0.1
                });
                observation.push(&snapshot);
            }
            monitor.ssb(
                &observation,
                0.04 * f64::from(number),
                &mut |fault, begins| {
                    found.push((number, fault, begins));
                },
            );
        }
        found
    }

    #[test]
    fn a_second_transmitter_is_reported_within_twenty_ssbs() {
        for second in [0.5, 0.8, 1.0] {
            let found = changes(second, 0.1);
            let [(number, fault, true)] = found[..] else {
                panic!("{second}: {found:?}");
            };
            assert!(number < 20, "{second}: {number}");
            let (pci, ssb_index) = (11, 2);
            assert_eq!(fault, Fault::DuplicatePci { pci, ssb_index });
        }
    }

    #[test]
    fn scatter_of_any_power_is_not_a_second_source() {
        for scatter in [0.0, 0.1, 0.3, 0.6, 1.0, 3.0] {
            assert_eq!(changes(0.0, scatter), [], "{scatter}");
        }
    }
}
