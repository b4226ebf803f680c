//! Acquisition time of a cell with an oscillator error, and identification of its beams, by two receivers: one of
//! a stream that searches ±20 ppm (default of Python), and one of windows around the bursts that searches ±60 ppm
//! (a vehicle whose receiver sleeps between bursts).
//!
//! ```sh
//! cargo run --release -p nr-ssb --example oscillators -- 5    # trials of each setting
//! ```
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a campaign")]

#[path = "../tests/all/air/mod.rs"]
mod air;

use air::{Cell, add_noise, rng, silence, slices};
use nr_ssb::SubcarrierSpacing::{self, Khz15, Khz30};
use nr_ssb::receiver::{ReceivedBeam, Receiver, ReceiverConfig, Window, WindowReceiver};
use nr_ssb::{Complex32, Lmax};

const ANTENNAS: usize = 2;
const SNR_DB: f64 = 5.0;
/// Maximum number of bursts until a cell is found; `SOON_S` (s) applies if it is longer. The reception then
/// continues for `MORE` bursts.
const SOON: usize = 3;
const SOON_S: f64 = 0.25;
const MORE: usize = 3;
const SSB_FREQ_HZ: f64 = 3.6e9;
/// Searched oscillator error of a receiver on a vehicle (ppm).
const VEHICLE_PPM: f64 = 60.0;

/// Received SSBs: number of the burst, beam.
type Receptions = Vec<(usize, u8)>;

struct Air {
    cell: Cell,
    period: f64,
}

impl Air {
    fn new(spacing: SubcarrierSpacing, period_s: f64, ppm: f64, seed: u64) -> Self {
        let mut cell = Cell::random(&mut rng(seed), spacing, ANTENNAS);
        cell.lmax = Lmax::L8;
        let first = cell.ssb_indices[0] % 4;
        cell.ssb_indices = vec![first, 7 - first];
        cell.ssb_freq_hz = SSB_FREQ_HZ;
        cell.cfo_hz = -1e-6 * ppm * SSB_FREQ_HZ;
        let period = period_s * spacing.base_rate_hz() * (1.0 + 1e-6 * ppm);
        Self { cell, period }
    }

    /// Returns the number of the first sample of a period, and all samples of the period.
    fn period(&self, number: usize, seed: u64) -> (usize, Vec<Vec<Complex32>>) {
        let [start, end] =
            [number, number + 1].map(|it| (it as f64 * self.period).floor() as usize);
        let mut samples = silence(ANTENNAS, end - start);
        let mut burst = self.cell.clone();
        burst.delay += number as f64 * self.period - start as f64;
        burst.add_to(&mut samples);
        add_noise(&mut samples, SNR_DB, &mut rng(seed + number as u64));
        (start, samples)
    }

    /// Returns the burst of an SSB, if the SSB is at a transmission of this beam.
    fn burst_of(&self, sample_start: f64, ssb_index: u8) -> Option<usize> {
        let bursts = (sample_start - self.cell.ssb_start(ssb_index)) / self.period;
        let near = ((bursts - bursts.round()) * self.period).abs() < 20.0;
        (near && bursts > -0.5).then(|| bursts.round() as usize)
    }
}

/// Returns the maximum number of bursts until a cell is found.
fn soon(period_s: f64) -> usize {
    SOON.max((SOON_S / period_s).ceil() as usize)
}

fn trial(
    spacing: SubcarrierSpacing,
    period_s: f64,
    ppm: f64,
    seed: u64,
) -> [(Receptions, usize); 2] {
    let air = Air::new(spacing, period_s, ppm, seed);
    let usual = ReceiverConfig::new(SSB_FREQ_HZ, spacing, ANTENNAS);
    let config = ReceiverConfig { period_s, ..usual };
    let mut stream = Receiver::new(config.clone(), spacing.base_rate_hz(), SSB_FREQ_HZ).unwrap();
    let widest_ppm = ReceiverConfig::widest_ppm(SSB_FREQ_HZ, spacing);
    let of_vehicle = ReceiverConfig {
        oscillator_ppm: VEHICLE_PPM.min(widest_ppm),
        ..config
    };
    let mut windows = WindowReceiver::new(of_vehicle).unwrap();
    let mut received = [(Receptions::new(), 0), (Receptions::new(), 0)];
    let mut note = |which: usize, sample_start: f64, ssb_index: u8| {
        let (right, wrong) = &mut received[which];
        match air.burst_of(sample_start, ssb_index) {
            Some(number) => right.push((number, ssb_index)),
            None => *wrong += 1,
        }
    };
    for number in 0..soon(period_s) + MORE {
        let (start, samples) = air.period(number, 1000 * seed);
        let antennas = slices(&samples);
        for block in 0..antennas[0].len().div_ceil(10_000) {
            let ends = [block, block + 1].map(|it| (it * 10_000).min(antennas[0].len()));
            let blocks: Vec<&[Complex32]> =
                antennas.iter().map(|it| &it[ends[0]..ends[1]]).collect();
            let mut take = |beam: ReceivedBeam<'_>| {
                note(0, beam.ssb.sample_start, beam.ssb.ssb_index);
            };
            stream.push(&blocks, &mut take).unwrap();
        }
        // The receiver is on only around the burst.
        let from = (air.cell.delay as usize).saturating_sub(300);
        let to = (from + (0.0051 * spacing.base_rate_hz()) as usize + 600).min(antennas[0].len());
        let around: Vec<&[Complex32]> = antennas.iter().map(|it| &it[from..to]).collect();
        let window = Window {
            start: (start + from) as i64,
            antennas: &around,
        };
        windows
            .receive(&window, &mut |seen| {
                note(1, seen.ssb.sample_start, seen.ssb.ssb_index);
            })
            .unwrap();
    }
    stream
        .finish(&mut |beam| note(0, beam.ssb.sample_start, beam.ssb.ssb_index))
        .unwrap();
    received
}

fn main() {
    let trials: u64 = std::env::args().nth(1).map_or(2, |it| it.parse().unwrap());
    println!(
        "spacing_khz,period_ms,receiver,trials,found_soon,ssbs,wrong_beams,missed_after_found"
    );
    for spacing in [Khz15, Khz30] {
        for period_s in [0.02, 0.16] {
            let (soon, mut sums) = (soon(period_s), [[0_usize; 5]; 2]);
            for step in -5..=5 {
                let ppm = 4.0 * f64::from(step);
                for number in 0..trials {
                    let seed = number * 11 + (step + 5) as u64 + 1;
                    for (sum, (received, wrong)) in
                        sums.iter_mut().zip(trial(spacing, period_s, ppm, seed))
                    {
                        let first = received.iter().map(|(burst, _)| *burst).min();
                        let found = first.is_some_and(|burst| burst < soon);
                        let after = first.map_or(0, |burst| 2 * (soon + MORE - 1 - burst));
                        let followed = received
                            .iter()
                            .filter(|(burst, _)| Some(*burst) > first)
                            .count();
                        let missed = after.saturating_sub(followed);
                        let counts = [1, usize::from(found), received.len(), wrong, missed];
                        for (total, count) in sum.iter_mut().zip(counts) {
                            *total += count;
                        }
                    }
                }
            }
            for (name, sum) in ["stream", "windows"].iter().zip(sums) {
                let [trials, found, ssbs, wrong, missed] = sum;
                let (khz, ms) = (spacing.khz(), period_s * 1e3);
                println!("{khz},{ms},{name},{trials},{found},{ssbs},{wrong},{missed}");
            }
        }
    }
}
