//! Delay and range rate of SSBs in the channels of TR 38.901: errors and NEES (normalised estimation
//! error squared) by K factor, subcarrier spacing and SNR. Run with `cargo run --release -p simulate
//! --example observables_table -- [SSBs of each head and run] [seeds]`.

#![allow(clippy::print_stdout, reason = "this is a program")]

mod common;

use nr_ssb::SubcarrierSpacing::{Khz15, Khz30};
use nr_ssb::observables::Observables;
use nr_ssb::observables::delay::Multipath;
use nr_ssb::observables::range_rate::RateSource;
use nr_ssb::receiver::{ReceiverConfig, Window, WindowReceiver};
use num_complex::Complex64;
use onboard::settings::SPEED_OF_LIGHT_MPS;
use simulate::channel::{HeadChannel, IqAir};
use simulate::random::Streams;
use simulate::truth::World;
use simulate::world::VehicleState;

use common::{Result, arguments, changed};

/// Number of antennas of the scenario.
const ANTENNAS: usize = 4;
/// Frequencies for the measurement of the K factor, far enough apart that scatter is independent.
const FREQUENCIES: usize = 512;
const STEP_HZ: f64 = 7.3e6;
/// Bursts from one evaluated SSB to the next, 0.4 s, and directly before it, for the range rate.
const BURSTS: u64 = 20;
const DIRECTLY: u64 = 3;
/// Limits of the K factor of a row, in dB.
const CLASSES: [(&str, f64, f64); 3] = [
    ("3 to 10", 3.0, 10.0),
    ("above 10", 10.0, f64::INFINITY),
    ("below 3", f64::NEG_INFINITY, 3.0),
];

/// One received SSB.
struct BurstResult {
    k_db: f64,
    seen: Observables,
    delay_error_m: f64,
    delay_sigma_m: f64,
    centroid_error_m: f64,
    rate_error_m_s: f64,
}

fn main() -> Result<()> {
    let (count, seeds) = arguments(20, 1)?;
    println!(
        "channel,spacing_khz,snr_db,k_db,ssbs,uncertain,detected,rms_of_all_paths_m,rms_m,bias_m,\
         sigma_m,nees,rate_from_phase,rate_nees,rate_nees_from_phase"
    );
    for channel in ["inf-sh", "umi"] {
        for khz in [15.0, 30.0] {
            for snr_db in [10.0, 20.0, 30.0] {
                let mut results = Vec::new();
                for seed in &seeds {
                    results.extend(received(channel, khz, snr_db, count as u64, *seed)?);
                }
                for (name, least, most) in CLASSES {
                    let of_class = |it: &&BurstResult| (least..most).contains(&it.k_db);
                    row(
                        &format!("{channel},{khz},{snr_db},{name}"),
                        &results.iter().filter(of_class).collect::<Vec<_>>(),
                    );
                }
            }
        }
    }
    Ok(())
}

fn row(name: &str, all: &[&BurstResult]) {
    let found: Vec<&BurstResult> = all
        .iter()
        .copied()
        .filter(|it| it.seen.delay.multipath != Multipath::Uncertain)
        .collect();
    let mean = |values: Vec<f64>| values.iter().sum::<f64>() / values.len() as f64;
    let of = |of: fn(&BurstResult) -> f64| mean(found.iter().map(|it| of(it)).collect());
    let is_from_phase =
        |it: &&&BurstResult| it.seen.range_rate.source == RateSource::PhaseDifference;
    let from_phase: Vec<f64> = (found.iter().filter(is_from_phase))
        .map(|it| (it.rate_error_m_s / it.seen.range_rate.sigma_m_s).powi(2))
        .collect();
    let share = |is: fn(&BurstResult) -> bool| {
        all.iter().filter(|it| is(it)).count() as f64 / all.len() as f64
    };
    println!(
        "{name},{},{:.2},{:.2},{:.2},{:.2},{:.2},{:.2},{:.2},{:.2},{:.2},{:.2}",
        all.len(),
        share(|it| it.seen.delay.multipath == Multipath::Uncertain),
        share(|it| it.seen.delay.multipath != Multipath::NotDetected),
        of(|it| it.centroid_error_m.powi(2)).sqrt(),
        of(|it| it.delay_error_m.powi(2)).sqrt(),
        of(|it| it.delay_error_m),
        of(|it| it.delay_sigma_m.powi(2)).sqrt(),
        of(|it| (it.delay_error_m / it.delay_sigma_m).powi(2)),
        from_phase.len() as f64 / found.len() as f64,
        of(|it| (it.rate_error_m_s / it.seen.range_rate.sigma_m_s).powi(2)),
        mean(from_phase),
    );
}

/// Receives SSBs of a drive in one channel model.
fn received(
    channel: &str,
    khz: f64,
    snr_db: f64,
    count: u64,
    seed: u64,
) -> Result<Vec<BurstResult>> {
    let scenario = changed(
        "yard",
        [
            ("channel.model", channel.into()),
            ("site.ssb.subcarrier_spacing_khz", khz.into()),
        ],
    )?;
    let streams = Streams::new(seed, 0);
    let mut drawn = World::new(&scenario)?.draw(streams);
    let mut channels = HeadChannel::all(&mut drawn, streams);
    let path = drawn.path;
    let mut air = IqAir::new(&scenario, streams)?;
    let ssb_freq_hz = scenario.site.carrier_mhz * 1e6;
    let spacing = if khz == 15.0 { Khz15 } else { Khz30 };
    let period_s = scenario.site.ssb.period_s();
    let config = ReceiverConfig {
        period_s,
        decode_pbch: false,
        ..ReceiverConfig::new(ssb_freq_hz, spacing, ANTENNAS)
    };
    let mut receiver = WindowReceiver::new(config)?;
    let snrs_db = vec![snr_db; channels.len()];
    let wavelength_m = SPEED_OF_LIGHT_MPS / ssb_freq_hz;
    let state = |time_s: f64| path.at(time_s);
    let mut results = Vec::new();
    for number in (1..count * BURSTS).filter(|it| it % BURSTS < DIRECTLY) {
        let time_s = number as f64 * period_s;
        if time_s > path.duration_s() {
            break;
        }
        let here = state(time_s);
        for channel in &mut channels {
            // Moves the array along the drive.
            channel.next_snr_db(&here);
        }
        let cfos_hz: Vec<f64> = (0..channels.len()).map(|head| air.cfo_hz(head)).collect();
        let burst = air.receive(number, state, &channels, &snrs_db)?;
        let antennas: Vec<_> = burst.antennas.iter().map(Vec::as_slice).collect();
        let window = Window {
            start: burst.start as i64,
            antennas: &antennas,
        };
        receiver.receive(&window, &mut |received| {
            let Some(observed) = received.tracker.observe(received.ssb) else {
                return;
            };
            let seen = observed.observables;
            let is_it = |it: &HeadChannel| {
                let head = it.head();
                (head.pci, head.ssb_index) == (received.ssb.pci.get(), received.ssb.ssb_index)
            };
            let head = channels.iter().position(is_it);
            let Some((head, channel)) = head.and_then(|it| Some((it, channels.get(it)?))) else {
                return;
            };
            if number % BURSTS + 1 != DIRECTLY {
                return;
            }
            let start = burst.ssb_starts.get(head).copied().unwrap_or(f64::NAN);
            let metre = SPEED_OF_LIGHT_MPS / spacing.base_rate_hz();
            let distance_m = |time_s: f64| {
                let sight = channel
                    .array()
                    .line_of_sight(&state(time_s), channel.head());
                sight.distance_m
            };
            // Mean rate of the interval, or of the SSB.
            let interval_s = match seen.range_rate.source {
                RateSource::PhaseDifference => seen.range_rate.interval_s,
                RateSource::WithinSsb => 1e-4,
            };
            let moved_m = distance_m(time_s) - distance_m(time_s - interval_s);
            let cfo_hz = cfos_hz.get(head).copied().unwrap_or(0.0);
            let rate_m_s = moved_m / interval_s - wavelength_m * cfo_hz;
            results.push(BurstResult {
                k_db: k_db(channel, &here),
                seen,
                delay_error_m: (seen.delay.first_path_start - start) * metre,
                delay_sigma_m: seen.delay.sigma_s * SPEED_OF_LIGHT_MPS,
                centroid_error_m: (received.ssb.sample_start - start) * metre,
                rate_error_m_s: seen.range_rate.rate_m_s - rate_m_s,
            });
        })?;
    }
    Ok(results)
}

/// Returns the power of the direct path relative to the scatter, in dB. The direct path is constant
/// over the frequencies.
fn k_db(channel: &HeadChannel, here: &VehicleState) -> f64 {
    let mut gains = vec![Complex64::ZERO; FREQUENCIES * ANTENNAS];
    channel.response(here, 0.0, STEP_HZ, &mut gains);
    let (mut direct, mut total) = (0.0, 0.0);
    for antenna in 0..ANTENNAS {
        let of_antenna = gains.iter().skip(antenna).step_by(ANTENNAS);
        let mean = of_antenna.clone().sum::<Complex64>() / FREQUENCIES as f64;
        direct += mean.norm_sqr();
        total += of_antenna.map(Complex64::norm_sqr).sum::<f64>() / FREQUENCIES as f64;
    }
    10.0 * (direct / (total - direct).max(f64::MIN_POSITIVE)).log10()
}
