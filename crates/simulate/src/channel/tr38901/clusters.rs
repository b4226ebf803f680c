//! Clusters of plane waves (TR 38.901, 7.5, steps 5 to 8).

use std::f64::consts::TAU;

use num_complex::Complex64;
use rand::{Rng, RngExt};
use rand_distr::StandardNormal;

use super::large_scale::{LargeScale, Parameters};
use crate::phasor::phasor;
use crate::world::{Antennas, LineOfSight};

/// Offsets of the 20 rays of a cluster from its centre, in units of the cluster's spread (table
/// 7.5-3); each offset applies with both signs.
const OFFSETS: [f64; 10] = [
    0.0447, 0.1413, 0.2492, 0.3715, 0.5129, 0.6797, 0.8844, 1.1481, 1.5195, 2.1551,
];
const RAYS: usize = 2 * OFFSETS.len();
/// Minimum power of a cluster relative to the strongest one (−25 dB); weaker clusters are removed.
const FLOOR: f64 = 3.162_277_660_168_379e-3;
/// Sub-clusters of the two strongest clusters: delay in units of the cluster's delay spread, and
/// ray indices (table 7.5-5).
const PARTS: [(f64, &[usize]); 3] = [
    (0.0, &[0, 1, 2, 3, 4, 5, 6, 7, 18, 19]),
    (1.28, &[8, 9, 10, 11, 16, 17]),
    (2.56, &[12, 13, 14, 15]),
];

/// Scatter of unit power as plane waves of fixed directions.
#[derive(Debug, Clone)]
pub struct Clusters {
    groups: Vec<Group>,
}

/// Rays with equal delay and power.
#[derive(Debug, Clone)]
struct Group {
    delay_s: f64,
    /// Amplitude of each ray.
    amplitude: f64,
    rays: Vec<Ray>,
}

/// Plane wave: horizontal part of the unit vector to the source, and phase at the map's origin.
/// Single precision saves memory because there are many rays.
#[derive(Debug, Clone, Copy)]
struct Ray {
    east: f32,
    north: f32,
    phase_rad: f32,
}

impl Clusters {
    /// Draws clusters at a position from which the radio head has the given azimuth and zenith
    /// angle.
    pub fn draw(
        parameters: &Parameters,
        large_scale: &LargeScale,
        azimuth_rad: f64,
        zenith_rad: f64,
        rng: &mut impl Rng,
    ) -> Self {
        let k_db = large_scale.k_db;
        let scale = parameters.delay_scaling * large_scale.delay_spread_s;
        let mut delays_s: Vec<f64> = (0..parameters.clusters)
            .map(|_| -scale * (1.0 - rng.random::<f64>()).ln())
            .collect();
        delays_s.sort_by(f64::total_cmp);
        let first_s = delays_s.first().copied().unwrap_or(0.0);

        // Step 6: cluster powers.
        let decay_s = scale / (parameters.delay_scaling - 1.0);
        let mut powers: Vec<f64> = delays_s
            .iter()
            .map(|delay_s| {
                let shadowing_db = parameters.cluster_shadowing_db * normal(rng);
                (-(delay_s - first_s) / decay_s).exp() * 10f64.powf(-0.1 * shadowing_db)
            })
            .collect();
        let strongest = powers.iter().copied().fold(0.0, f64::max);
        for power in &mut powers {
            if *power < FLOOR * strongest {
                *power = 0.0;
            }
        }
        let total: f64 = powers.iter().sum();
        for power in &mut powers {
            *power /= total;
        }

        // With a line of sight, the angles depend on powers that include it (7.5-8).
        let k = 10f64.powf(0.1 * k_db);
        let with_direct = |(number, power): (usize, &f64)| match number {
            0 if parameters.line_of_sight => (power + k) / (k + 1.0),
            _ if parameters.line_of_sight => power / (k + 1.0),
            _ => *power,
        };
        let of_angles: Vec<f64> = powers.iter().enumerate().map(with_direct).collect();
        let most = of_angles.iter().copied().fold(0.0, f64::max);
        let (delay_scale, azimuth_scale, zenith_scale) = if parameters.line_of_sight {
            let of_k = |[a, b, c, d]: [f64; 4]| a + k_db * (b + k_db * (c + k_db * d));
            (
                of_k([0.7705, -0.0433, 0.0002, 0.000_017]),
                parameters.azimuth_scaling * of_k([1.1035, -0.028, -0.002, 0.0001]),
                parameters.zenith_scaling * of_k([1.3086, 0.0339, -0.0077, 0.0002]),
            )
        } else {
            (1.0, parameters.azimuth_scaling, parameters.zenith_scaling)
        };

        // Step 7: azimuths from a wrapped Gaussian, zeniths from a Laplacian.
        let spread = large_scale.azimuth_spread_deg;
        let azimuths_deg = around(&of_angles, parameters.line_of_sight, rng, |power, rng| {
            let away = 2.0 / 1.4 * spread * (-(power / most).max(1e-6).ln()).sqrt();
            sign(rng) * away / azimuth_scale + spread / 7.0 * normal(rng)
        });
        let spread = large_scale.zenith_spread_deg;
        let zeniths_deg = around(&of_angles, parameters.line_of_sight, rng, |power, rng| {
            let away = -spread * (power / most).max(1e-6).ln();
            sign(rng) * away / zenith_scale + spread / 7.0 * normal(rng)
        });
        let excess_s = parameters.excess_delay_s(normal(rng));

        let mut by_power: Vec<usize> = (0..powers.len()).collect();
        by_power.sort_by(|a, b| powers[*b].total_cmp(&powers[*a]));
        let mut groups = Vec::new();
        for (number, power) in powers.iter().enumerate().filter(|(_, power)| **power > 0.0) {
            let delay_s = excess_s + (delays_s[number] - first_s) / delay_scale;
            let parts: &[(f64, &[usize])] = if by_power.iter().take(2).any(|it| *it == number) {
                &PARTS
            } else {
                &[(0.0, &ALL)]
            };
            for (part, rays) in parts {
                // Step 8: random coupling of azimuths and zeniths.
                let mut coupled = rays.to_vec();
                shuffle(&mut coupled, rng);
                let rays = rays.iter().zip(&coupled).map(|(azimuth, zenith)| {
                    let away_deg = parameters.cluster_azimuth_deg * offset(*azimuth);
                    let azimuth_rad = azimuth_rad + (azimuths_deg[number] + away_deg).to_radians();
                    let away_deg = parameters.cluster_zenith_deg * offset(*zenith);
                    let zenith_rad = zenith_rad + (zeniths_deg[number] + away_deg).to_radians();
                    // A zenith angle below zero is mirrored, but the azimuth is retained.
                    let level = zenith_rad.sin().abs();
                    Ray {
                        east: (level * azimuth_rad.cos()) as f32,
                        north: (level * azimuth_rad.sin()) as f32,
                        phase_rad: (TAU * rng.random::<f64>()) as f32,
                    }
                });
                groups.push(Group {
                    delay_s: delay_s + part * parameters.cluster_delay_s,
                    amplitude: (power / RAYS as f64).sqrt(),
                    rays: rays.collect(),
                });
            }
        }
        Self { groups }
    }

    /// Adds the antennas' response to the clusters at each frequency, multiplied by `weight`.
    pub fn add(
        &self,
        weight: Complex64,
        sight: &LineOfSight,
        antennas: &Antennas,
        wavenumber_per_m: f64,
        step_hz: f64,
        into: &mut [Complex64],
    ) {
        let elements = antennas.elements();
        let first_hz = -((into.len() / elements / 2) as f64) * step_hz;
        let (sin, cos) = sight.axis_rad.sin_cos();
        let [x, y] = [sight.place.x_m, sight.place.y_m].map(|part_m| wavenumber_per_m * part_m);
        let mut sum = [Complex64::ZERO; onboard::observation::MAX_ELEMENTS];
        for group in &self.groups {
            let Some(sum) = sum.get_mut(..elements) else {
                return;
            };
            sum.fill(Complex64::ZERO);
            for ray in &group.rays {
                let [towards_x, towards_y] = [ray.east, ray.north].map(f64::from);
                let wave = phasor(f64::from(ray.phase_rad) + x * towards_x + y * towards_y);
                let along = cos * towards_x + sin * towards_y;
                let left = cos * towards_y - sin * towards_x;
                antennas.add(wave, [along, left], sum);
            }
            let mut turn = weight * group.amplitude * phasor(-TAU * first_hz * group.delay_s);
            let turn_step = phasor(-TAU * step_hz * group.delay_s);
            for gains in into.chunks_exact_mut(elements) {
                for (gain, sum) in gains.iter_mut().zip(&*sum) {
                    // Assignment operators of complex numbers are not inlined.
                    let next = *gain + turn * sum;
                    *gain = next;
                }
                let next = turn * turn_step;
                turn = next;
            }
        }
    }

    /// Returns the RMS delay spread in seconds, including a line of sight with the Rician factor
    /// `k`.
    pub fn delay_spread_s(&self, k: f64) -> f64 {
        let scatter = 1.0 / (k + 1.0);
        let powers = (self.groups.iter())
            .map(|group| scatter * group.amplitude * group.amplitude * group.rays.len() as f64);
        let delays_s = self.groups.iter().map(|group| group.delay_s);
        let [mut first, mut second] = [0.0; 2];
        for (power, delay_s) in powers.zip(delays_s) {
            first += power * delay_s;
            second += power * delay_s * delay_s;
        }
        (second - first * first).max(0.0).sqrt()
    }

    /// Returns the circular azimuth spread in radians (annex A.1), including a line of sight from
    /// `azimuth_rad` with the Rician factor `k`.
    pub fn azimuth_spread_rad(&self, k: f64, azimuth_rad: f64) -> f64 {
        let mut sum = Complex64::cis(azimuth_rad) * k;
        for group in &self.groups {
            let power = group.amplitude * group.amplitude;
            for ray in &group.rays {
                let towards = Complex64::new(ray.east.into(), ray.north.into());
                sum += towards * (power / towards.norm().max(f64::MIN_POSITIVE));
            }
        }
        (-2.0 * (sum.norm() / (k + 1.0)).ln()).max(0.0).sqrt()
    }
}

const ALL: [usize; RAYS] = [
    0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19,
];

/// Returns the offset of a ray from the centre of its cluster, in units of the cluster's spread.
fn offset(ray: usize) -> f64 {
    let magnitude = OFFSETS[ray / 2];
    if ray.is_multiple_of(2) {
        magnitude
    } else {
        -magnitude
    }
}

/// Returns the angles of the clusters relative to the line of sight as a function of their powers.
/// With a line of sight, the angles are shifted so that the first cluster has the angle zero.
fn around<R: Rng>(
    powers: &[f64],
    line_of_sight: bool,
    rng: &mut R,
    angle: impl Fn(f64, &mut R) -> f64,
) -> Vec<f64> {
    let mut angles: Vec<f64> = powers.iter().map(|power| angle(*power, rng)).collect();
    if let (true, Some(&first)) = (line_of_sight, angles.first()) {
        for angle in &mut angles {
            *angle -= first;
        }
    }
    angles
}

fn normal(rng: &mut impl Rng) -> f64 {
    rng.sample(StandardNormal)
}

fn sign(rng: &mut impl Rng) -> f64 {
    if rng.random::<f64>() < 0.5 { -1.0 } else { 1.0 }
}

/// Shuffles the values (Fisher and Yates).
fn shuffle(values: &mut [usize], rng: &mut impl Rng) {
    for last in (1..values.len()).rev() {
        let with = (rng.random::<f64>() * (last + 1) as f64) as usize;
        values.swap(last, with);
    }
}
