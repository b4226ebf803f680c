//! SSBs of one beam with a known pseudorange, between sleeps: errors of the observables, and their
//! Cramér–Rao bounds.
#![allow(dead_code, reason = "each user needs its part")]

use std::f64::consts::TAU;

use nr_ssb::burst::ssb_grid;
use nr_ssb::observables::delay::Multipath;
use nr_ssb::observables::range_rate::RateSource;
use nr_ssb::ofdm::symbol_phase;
use nr_ssb::search::{SearchConfig, Searcher};
use nr_ssb::track::Tracker;
use nr_ssb::{BchPayload, Complex32, Lmax, Numerology, Ofdm, Pci, SsbGrid, SubcarrierSpacing};
use num_complex::Complex64;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use crate::air;

pub const ANTENNAS: usize = 4;
pub const LIGHT_M_S: f64 = 299_792_458.0;
const SSB_FREQ_HZ: f64 = 3.6e9;
/// Number of received samples around an SSB.
const WINDOW: usize = 2048;
/// Number of received samples before an SSB.
const MARGIN: f64 = 400.0;
const BEAM: u8 = 3;

/// Error of one quantity with its reported standard deviation and its bound.
#[derive(Debug, Clone, Copy)]
pub struct Error {
    pub value: f64,
    pub sigma: f64,
    pub bound: f64,
}

/// Root mean square error divided by the bound, normalised estimation error squared, and mean error
/// in standard deviations, of some errors.
#[derive(Debug, Clone, Copy)]
pub struct Summary {
    pub count: usize,
    pub ratio: f64,
    pub nees: f64,
    pub bias_sigmas: f64,
}

pub fn summary(errors: &[Error]) -> Summary {
    let mean = |of: fn(&Error) -> f64| errors.iter().map(of).sum::<f64>() / errors.len() as f64;
    Summary {
        count: errors.len(),
        ratio: mean(|it| (it.value / it.bound).powi(2)).sqrt(),
        nees: mean(|it| (it.value / it.sigma).powi(2)),
        bias_sigmas: mean(|it| it.value / it.sigma),
    }
}

/// Errors of one SSB.
#[derive(Debug, Clone, Copy)]
pub struct SsbErrors {
    /// Delay of the first path in seconds.
    pub delay: Error,
    pub multipath: Multipath,
    /// Phase of the array in rad.
    pub phase: Error,
    /// Range rate in m/s.
    pub rate: Error,
    pub source: RateSource,
    /// SS-RSRP in dB.
    pub power: Error,
    /// Time since the previous SSB in seconds.
    pub sleep_s: f64,
}

fn grid(cell: &air::Cell) -> SsbGrid {
    let payload = BchPayload::new(cell.mib, cell.sfn, cell.half_frame, BEAM).unwrap();
    ssb_grid(Pci::new(cell.pci).unwrap(), cell.lmax, &payload).unwrap()
}

/// Bounds of the standard deviations of delay (s), phase (rad) and frequency (Hz) for unit gain at
/// all antennas: Fisher information `2 Σ SNR g gᵀ` of PSS, SSS and DM-RS.
fn bounds(cell: &air::Cell, snr_db: f64) -> [f64; 3] {
    let grid = grid(cell);
    let pbch = nr_ssb::grid::pbch_indices(Pci::new(cell.pci).unwrap());
    let scs_hz = cell.spacing.hz();
    let known = (0..960).filter(|index| grid.elements()[*index].norm() > 0.0);
    let known: Vec<usize> = known.filter(|index| !pbch.contains(index)).collect();
    assert_eq!(known.len(), 398);
    let frequency = |index: usize| ((index % 240) as f64 - 120.0) * scs_hz;
    let time = |index: usize| (index / 240) as f64 * 274.0 / (256.0 * scs_hz);
    let spread = |of: &dyn Fn(usize) -> f64| {
        let mean = known.iter().map(|it| of(*it)).sum::<f64>() / known.len() as f64;
        known.iter().map(|it| (of(*it) - mean).powi(2)).sum::<f64>()
    };
    let snr = 2.0 * 10f64.powf(0.1 * snr_db) * ANTENNAS as f64;
    let sigma = |information: f64| 1.0 / (snr * information).sqrt();
    [
        sigma(TAU * TAU * spread(&frequency)),
        sigma(known.len() as f64),
        sigma(TAU * TAU * spread(&time)),
    ]
}

/// Multipath that changes from one SSB to the next.
#[derive(Debug, Clone, Copy)]
pub struct Echoes {
    /// Power of the first path relative to that of all echoes.
    pub k_db: f64,
    /// Mean excess delay of an echo.
    pub mean_delay_s: f64,
    pub count: usize,
}

/// One echo: excess delay, amplitude, phase step from one antenna to the next.
struct Echo {
    delay_s: f64,
    gain: Complex32,
    phase_step_rad: f64,
}

impl Echoes {
    /// Draws the amplitude of the first path, and echoes with exponential delays and powers.
    fn draw(&self, rng: &mut ChaCha8Rng) -> (f32, Vec<Echo>) {
        let k = 10f64.powf(0.1 * self.k_db);
        let mut exponential = || -rng.random_range(f64::MIN_POSITIVE..1.0).ln();
        let powers: Vec<f64> = (0..self.count).map(|_| exponential()).collect();
        let delays: Vec<f64> = (0..self.count).map(|_| exponential()).collect();
        let total: f64 = powers.iter().sum();
        let echoes = powers.iter().zip(delays).map(|(power, delay)| Echo {
            delay_s: delay * self.mean_delay_s,
            gain: air::phasor(rng.random_range(0.0..TAU))
                * (power / total / (1.0 + k)).sqrt() as f32,
            phase_step_rad: rng.random_range(0.0..TAU),
        });
        let echoes = echoes.collect();
        ((k / (1.0 + k)).sqrt() as f32, echoes)
    }
}

/// One beam that moves.
pub struct Moving {
    cell: air::Cell,
    grid: SsbGrid,
    ofdm: Ofdm,
    echoes: Option<Echoes>,
    tracker: Option<Tracker>,
    /// Pseudorange at time zero, in seconds.
    pseudorange_s: f64,
    /// Rate of the pseudorange, in seconds per second.
    rate: f64,
    snr_db: f64,
    bounds: [f64; 3],
    rng: ChaCha8Rng,
    /// Transmission time of the half frame, in samples.
    sent_at: f64,
}

impl Moving {
    /// Detects the cell by a search in its first window.
    pub fn new(spacing: SubcarrierSpacing, snr_db: f64, echoes: Option<Echoes>, seed: u64) -> Self {
        let mut rng = air::rng(seed);
        let mut cell = air::Cell::random(&mut rng, spacing, ANTENNAS);
        cell.lmax = Lmax::L8;
        cell.ssb_freq_hz = SSB_FREQ_HZ;
        cell.ssb_indices = vec![BEAM];
        cell.half_frame = false;
        cell.delay = 0.0;
        // An oscillator of 1 ppm, and a vehicle of 5 m/s.
        let rate = 1e-6 * rng.random_range(-1.0..1.0) + rng.random_range(-5.0..5.0) / LIGHT_M_S;
        let config = SearchConfig {
            ssb_freq_hz: Some(SSB_FREQ_HZ),
            ..SearchConfig::new(spacing, ANTENNAS)
        };
        let mut moving = Self {
            grid: grid(&cell),
            ofdm: Ofdm::new(Numerology::new(spacing, 256).unwrap()),
            pseudorange_s: rng.random_range(1e-4..2e-4),
            rate,
            snr_db,
            bounds: bounds(&cell, snr_db),
            tracker: None,
            echoes,
            rng,
            sent_at: 0.0,
            cell,
        };
        // The search has 10 dB at least, so that it succeeds.
        let snr_db = moving.snr_db;
        moving.snr_db = snr_db.max(10.0);
        let (samples, start) = moving.window();
        moving.snr_db = snr_db;
        moving.tracker = detected(&config, &moving.cell, &samples, start);
        moving
    }

    /// Returns the reception time of the SSB's first sample, in samples.
    fn start(&self) -> f64 {
        let rate_hz = self.cell.spacing.base_rate_hz();
        let sent = self.sent_at + self.cell.ssb_start(BEAM);
        (sent + self.pseudorange_s * rate_hz) / (1.0 - self.rate)
    }

    /// Returns the phase of the carrier at a reception time in samples.
    fn phase(&self, sample: f64) -> f64 {
        let time_s = sample / self.cell.spacing.base_rate_hz();
        -TAU * (SSB_FREQ_HZ * (self.pseudorange_s + self.rate * time_s)).fract()
    }

    /// Returns the samples of every antenna with the SSB at `MARGIN` plus a fraction of a sample,
    /// which is a phase ramp over the subcarriers: the signal of a receiver whose band is wider than
    /// the SSB.
    fn sent(&mut self, fraction: f64) -> Vec<Vec<Complex32>> {
        let numerology = self.ofdm.numerology();
        let first = self.cell.case().start_symbol(BEAM).unwrap();
        let length = numerology.ssb_symbol_len();
        let echoes = self.echoes.map(|it| it.draw(&mut self.rng));
        let ramp = |samples: f64| -> [Complex32; 240] {
            std::array::from_fn(|k| air::phasor(-TAU * (k as f64 - 120.0) * samples / 256.0))
        };
        let mut antennas = vec![vec![Complex32::ZERO; WINDOW]; ANTENNAS];
        for (antenna, samples) in antennas.iter_mut().enumerate() {
            let mut channel = [Complex32::ONE; 240];
            if let Some((direct, echoes)) = &echoes {
                channel = [Complex32::new(*direct, 0.0); 240];
                for echo in echoes {
                    let gain = echo.gain * air::phasor(echo.phase_step_rad * antenna as f64);
                    let ramp = ramp(echo.delay_s * numerology.sample_rate_hz());
                    channel
                        .iter_mut()
                        .zip(ramp)
                        .for_each(|(h, x)| *h += gain * x);
                }
            }
            let late = ramp(fraction);
            for (l, known) in self.grid.symbols().enumerate() {
                let gain = self.cell.gains[antenna];
                let phase = symbol_phase(numerology, first + l, SSB_FREQ_HZ) * gain;
                let received = std::array::from_fn(|k| known[k] * late[k] * channel[k] * phase);
                let start = MARGIN as usize + l * length;
                let place = &mut samples[start..start + length];
                self.ofdm.modulate(&received, place).unwrap();
            }
        }
        antennas
    }

    fn window(&mut self) -> (Vec<Vec<Complex32>>, f64) {
        let start = self.start();
        let window_start = (start - MARGIN).floor();
        let mut antennas = self.sent(start - MARGIN - window_start);
        for n in 0..WINDOW {
            let phasor = air::phasor(self.phase(window_start + n as f64));
            for samples in &mut antennas {
                samples[n] *= phasor;
            }
        }
        air::add_noise(&mut antennas, self.snr_db, &mut self.rng);
        (antennas, window_start)
    }

    /// Receives the SSB that is transmitted `sleep_s` after the last one.
    pub fn next(&mut self, sleep_s: f64) -> Option<SsbErrors> {
        let rate_hz = self.cell.spacing.base_rate_hz();
        let elapsed = (sleep_s * rate_hz).round();
        self.sent_at += elapsed;
        let (samples, window_start) = self.window();
        let antennas: [&[Complex32]; ANTENNAS] = std::array::from_fn(|it| samples[it].as_slice());
        let tracker = self.tracker.as_mut()?;
        let expected = tracker.expected_start(elapsed);
        let seen = tracker.track(&antennas, window_start, expected, false);
        let ssb = seen.unwrap()?;
        let observed = tracker.observe(&ssb).expect("a known carrier");
        let seen = observed.observables;
        let [delay_bound, phase_bound, frequency_bound] = self.bounds;

        let response = self.cell.gains.iter();
        let response = response.map(|gain| Complex64::new(gain.re.into(), gain.im.into()));
        let (phase_rad, phase_sigma_rad) =
            observed.phase_for_response(&response.collect::<Vec<_>>());
        let turn = phase_rad - self.phase(seen.phase.reference_start);
        let wavelength_m = LIGHT_M_S / SSB_FREQ_HZ;
        let frequency_bound = match seen.range_rate.source {
            RateSource::WithinSsb => frequency_bound,
            RateSource::PhaseDifference => 2f64.sqrt() * phase_bound / (TAU * sleep_s),
        };
        // A power of unity is −20 lg 256 dB of full scale.
        let power_bound = 10.0 / std::f64::consts::LN_10 * 2.0 * phase_bound;
        Some(SsbErrors {
            delay: Error {
                value: (seen.delay.first_path_start - self.start()) / rate_hz,
                sigma: seen.delay.sigma_s,
                bound: delay_bound,
            },
            multipath: seen.delay.multipath,
            phase: Error {
                value: turn - TAU * (turn / TAU).round(),
                sigma: phase_sigma_rad,
                bound: phase_bound,
            },
            rate: Error {
                value: seen.range_rate.rate_m_s - self.rate * LIGHT_M_S,
                sigma: seen.range_rate.sigma_m_s,
                bound: wavelength_m * frequency_bound,
            },
            source: seen.range_rate.source,
            power: Error {
                value: seen.power.ss_rsrp_dbfs + 20.0 * 256f64.log10(),
                sigma: seen.power.ss_rsrp_sigma_db,
                bound: power_bound,
            },
            sleep_s,
        })
    }
}

/// Returns a tracker of the cell that a search detects in these samples.
fn detected(
    config: &SearchConfig,
    cell: &air::Cell,
    samples: &[Vec<Complex32>],
    start: f64,
) -> Option<Tracker> {
    let mut searcher = Searcher::new(config.clone()).unwrap();
    let found = searcher.search(&air::slices(samples)).unwrap();
    let mut found = found.iter().find(|it| it.pci.get() == cell.pci)?.clone();
    found.sample_start += start;
    Some(Tracker::new(config, &found).unwrap())
}
