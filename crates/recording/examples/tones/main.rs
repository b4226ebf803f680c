//! SSBs detected through a DC offset and tones, by the search, the scan and both receivers:
//! `cargo run --release -p recording --example tones -- [trials] [search|scan|stream|window|angle]`
//!
//! Every disturbed recording has the noise of an undisturbed one. *lost*: detected without the tones, and not with them;
//! *silent*: lost, and not every tone of −10 dB relative to the noise or more is reported.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::print_stdout,
    reason = "a program"
)]

#[path = "../../../nr-ssb/tests/all/air/mod.rs"]
mod air;
mod detectors;

use std::f64::consts::TAU;

use air::{Cell, add_noise, phasor, raised, rng, silence};
use detectors::{DETECTORS, Detected, angle_rad};
use nr_ssb::{Complex32, SubcarrierSpacing};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

const SPACING: SubcarrierSpacing = SubcarrierSpacing::Khz30;
/// Powers of each tone relative to the SSB, in dB.
const ABOVE_SSB_DB: [f64; 5] = [-10.0, 0.0, 10.0, 15.0, 20.0];
/// Mean power of an SSB in the time domain: 240 subcarriers of unit power, divided by the squared
/// number of samples of the unnormalised 256-point transform.
const SSB_POWER: f64 = 240.0 / 65536.0;
/// Half of the bandwidth of PSS and SSS: 127 subcarriers, Hz.
const PSS_HALF_HZ: f64 = 63.5 * 30e3;

/// Positions of the tones in the band, and number of tones.
const PLACES: [(&str, usize); 5] = [
    ("DC", 1),
    ("anywhere", 1),
    ("in the PSS", 1),
    ("anywhere", 4),
    ("in the PSS", 4),
];

/// Number of antennas, and SNR per resource element in dB.
const SCENES: [(usize, f64); 3] = [(1, 20.0), (2, 0.0), (4, -9.0)];

/// Samples of a cell without DC offset and tones.
pub struct Scene {
    /// The cell.
    pub cell: Cell,
    /// Samples of each antenna.
    pub samples: Vec<Vec<Complex32>>,
    /// Number of input samples per sample at the base rate.
    pub factor: usize,
    /// Frequency of the SSB's centre relative to the centre of the samples, in Hz.
    pub offset_hz: f64,
    /// Number of SSBs, one in each period of 20 ms.
    pub bursts: usize,
}

impl Scene {
    /// Returns the sample rate in samples per second.
    pub fn rate_hz(&self) -> f64 {
        self.factor as f64 * SPACING.base_rate_hz()
    }

    /// Creates one SSB in each of `bursts` periods of 20 ms in white noise. If `is_wide`, the
    /// samples have twice the base rate and the SSB is off their centre.
    fn new(
        seed: u64,
        (antennas, snr_db): (usize, f64),
        bursts: usize,
        is_wide: bool,
    ) -> (Self, ChaCha8Rng) {
        let mut rng = rng(seed);
        let mut cell = Cell::random(&mut rng, SPACING, antennas);
        // One point of the synchronization raster for every frequency range.
        cell.ssb_freq_hz = 3.6e9;
        let mut samples = silence(antennas, bursts * 153_600);
        for number in 0..bursts {
            let burst = Cell {
                delay: cell.delay + (number * 153_600) as f64,
                sfn: (cell.sfn + 2 * number as u16) % 1024,
                ..cell.clone()
            };
            burst.add_to(&mut samples);
        }
        let factor = if is_wide { 2 } else { 1 };
        let offset_hz = if is_wide { 1.44e6 } else { 0.0 };
        let mut scene = Self {
            cell,
            samples,
            factor,
            offset_hz,
            bursts,
        };
        if is_wide {
            let cycles = offset_hz / scene.rate_hz();
            for samples in &mut scene.samples {
                *samples = raised(samples, factor, cycles);
            }
        }
        // Amplitudes do not depend on the rate, so that noise of equal density is stronger.
        let in_band_db = snr_db - 10.0 * (factor as f64).log10();
        add_noise(&mut scene.samples, in_band_db, &mut rng);
        (scene, rng)
    }

    /// Returns the samples with tones of this power, and the frequencies of the tones relative to
    /// the centre of the samples.
    fn disturbed(
        &self,
        (place, count): (&str, usize),
        above_ssb_db: f64,
        rng: &mut ChaCha8Rng,
    ) -> (Vec<Vec<Complex32>>, Vec<f64>) {
        let mut samples = self.samples.clone();
        let amplitude = (10f64.powf(0.1 * above_ssb_db) * SSB_POWER).sqrt() as f32;
        let half_hz = 0.5 * self.rate_hz();
        let frequencies_hz: Vec<f64> = (0..count)
            .map(|_| match place {
                "DC" => 0.0,
                "anywhere" => rng.random_range(-half_hz..half_hz),
                _ => self.offset_hz + rng.random_range(-PSS_HALF_HZ..PSS_HALF_HZ),
            })
            .collect();
        for frequency_hz in &frequencies_hz {
            let cycles = frequency_hz / self.rate_hz();
            for antenna in &mut samples {
                let turn = rng.random_range(0.0..TAU);
                for (n, sample) in antenna.iter_mut().enumerate() {
                    *sample += phasor(turn + TAU * (cycles * n as f64).fract()) * amplitude;
                }
            }
        }
        (samples, frequencies_hz)
    }
}

/// Counts of one condition.
#[derive(Default)]
struct Counts {
    trials: usize,
    undisturbed: usize,
    disturbed: usize,
    lost: usize,
    silent: usize,
    unreported: usize,
    false_tones: usize,
}

impl Counts {
    fn add(&mut self, clean: &Detected, found: &Detected, tones_hz: &[f64], is_weak: bool) {
        let (before, after) = (clean.ssbs, found.ssbs);
        self.trials += found.bursts;
        self.undisturbed += before;
        self.disturbed += after;
        let lost = before.saturating_sub(after);
        self.lost += lost;
        let near = |a: f64, b: &f64| (a - b).abs() < 4e3;
        let is_reported = |hz: &f64| found.tones_hz.iter().any(|it| near(*it, hz));
        let missing = tones_hz.iter().filter(|hz| !is_reported(hz)).count();
        let extra = found.tones_hz.iter();
        let extra = extra.filter(|it| !tones_hz.iter().any(|hz| near(**it, hz)));
        self.false_tones += extra.count();
        if !is_weak {
            self.unreported += missing;
            if missing == tones_hz.len() {
                self.silent += lost;
            }
        }
    }
}

fn main() {
    let mut arguments = std::env::args().skip(1);
    let trials: u64 = arguments
        .next()
        .map_or(40, |it| it.parse().expect("trials"));
    let only = arguments.next();
    let is_wanted = |name: &str| only.as_ref().is_none_or(|it| it == name);
    println!(
        "detector antennas snr_db tones where tone_db ssbs undisturbed disturbed lost silent unreported false"
    );
    for (name, is_wide, bursts, detect) in DETECTORS {
        if !is_wanted(name) {
            continue;
        }
        for scene in SCENES {
            let mut counts: Vec<Counts> = Vec::new();
            counts.resize_with(PLACES.len() * ABOVE_SSB_DB.len(), Counts::default);
            for seed in 0..trials {
                let (undisturbed, mut rng) = Scene::new(1000 + seed, scene, bursts, is_wide);
                let clean = detect(&undisturbed, &undisturbed.samples);
                for (number, counts) in counts.iter_mut().enumerate() {
                    let place = PLACES[number / ABOVE_SSB_DB.len()];
                    let above_ssb_db = ABOVE_SSB_DB[number % ABOVE_SSB_DB.len()];
                    let (samples, tones_hz) = undisturbed.disturbed(place, above_ssb_db, &mut rng);
                    let found = detect(&undisturbed, &samples);
                    counts.add(&clean, &found, &tones_hz, scene.1 + above_ssb_db < -10.0);
                }
            }
            for (number, counts) in counts.iter().enumerate() {
                let (place, tones) = PLACES[number / ABOVE_SSB_DB.len()];
                let above_ssb_db = ABOVE_SSB_DB[number % ABOVE_SSB_DB.len()];
                let Counts {
                    trials,
                    undisturbed,
                    disturbed,
                    lost,
                    silent,
                    unreported,
                    false_tones,
                } = counts;
                let (antennas, snr_db) = scene;
                println!(
                    "{name:6} {antennas} {snr_db:5} {tones} {place:10} {above_ssb_db:5} {trials:5} {undisturbed:5} \
                     {disturbed:5} {lost:4} {silent:4} {unreported:4} {false_tones:4}"
                );
            }
        }
    }
    if is_wanted("angle") {
        angles(trials);
    }
}

/// Prints the RMS errors of angles, with and without a DC offset, at a CFO of 3 kHz.
fn angles(trials: u64) {
    println!(
        "angle: DC offset above the SSB in dB, RMS error in degrees; CFO 3 kHz, four antennas, 20 dB"
    );
    let mut squares = [0.0; 5];
    let levels = [-300.0, -10.0, 0.0, 10.0, 15.0];
    for seed in 0..10 * trials {
        let mut rng = rng(5000 + seed);
        let mut cell = Cell::random(&mut rng, SPACING, 4);
        cell.ssb_freq_hz = 3.6e9;
        cell.cfo_hz = 3000.0;
        cell.delay = 400.0;
        let truth: f64 = rng.random_range(1.0..2.1);
        cell.gains = (0..4)
            .map(|n| phasor(std::f64::consts::PI * truth.cos() * f64::from(n)))
            .collect();
        let mut samples = silence(4, 38_400);
        cell.add_to(&mut samples);
        add_noise(&mut samples, 20.0, &mut rng);
        let scene = Scene {
            cell,
            samples,
            factor: 1,
            offset_hz: 0.0,
            bursts: 1,
        };
        for (square, above_ssb_db) in squares.iter_mut().zip(levels) {
            let (samples, _) = scene.disturbed(("DC", 1), above_ssb_db, &mut rng);
            let found = angle_rad(&scene, &samples).expect("an SSB of 20 dB");
            *square += (found - truth).to_degrees().powi(2) / (10 * trials) as f64;
        }
    }
    for (square, above_ssb_db) in squares.iter().zip(levels) {
        println!("{above_ssb_db:6} {:.4}", square.sqrt());
    }
}
