//! The complete receiver: input samples in blocks of any length, output SSBs.

use crate::air::{Cell, add_noise, raised, rng, silence, slices};
use nr_ssb::receiver::{
    ReceivedBeam, Receiver, ReceiverConfig, TrackedSsb, Window, WindowReceiver,
};
use nr_ssb::{Complex32, Lmax, SubcarrierSpacing};

const SPACING: SubcarrierSpacing = SubcarrierSpacing::Khz30;
const RATE_HZ: f64 = 15.36e6;
const PERIODS: usize = 8;

/// Creates eight periods of two beams, the second of which is silent from the fourth to the sixth.
fn cell_and_samples() -> (Cell, Vec<Vec<Complex32>>) {
    let mut cell = Cell::random(&mut rng(4), SPACING, 3);
    (cell.lmax, cell.ssb_indices, cell.ssb_freq_hz) = (Lmax::L8, vec![2, 5], 3.6e9);
    cell.cfo_hz = 3000.0;
    let period = 0.02 * SPACING.base_rate_hz();
    let mut base = silence(3, PERIODS * period as usize);
    for number in 0..PERIODS {
        let ssb_indices = if (3..6).contains(&number) {
            vec![2]
        } else {
            vec![2, 5]
        };
        let burst = Cell {
            ssb_indices,
            sfn: (cell.sfn + 2 * number as u16) % 1024,
            delay: cell.delay + number as f64 * period,
            ..cell.clone()
        };
        burst.add_to(&mut base);
    }
    add_noise(&mut base, 10.0, &mut rng(5));
    // The SSB is 2 MHz above the centre of the recording.
    let samples = base.iter().map(|it| raised(it, 2, 2e6 / RATE_HZ)).collect();
    (cell, samples)
}

fn tracked_ssbs(
    config: ReceiverConfig,
    samples: &[Vec<Complex32>],
    block: usize,
) -> Vec<TrackedSsb> {
    let mut receiver = Receiver::new(config, RATE_HZ, 3.6e9 - 2e6).unwrap();
    let mut tracked_ssbs = Vec::new();
    let mut take = |mut beam: ReceivedBeam<'_>| tracked_ssbs.push(beam.tracked_ssb());
    for first in (0..samples[0].len()).step_by(block) {
        let end = samples[0].len().min(first + block);
        let slices: Vec<&[Complex32]> = samples.iter().map(|it| &it[first..end]).collect();
        receiver.push(&slices, &mut take).unwrap();
    }
    receiver.finish(&mut take).unwrap();
    receiver.reset();
    assert_eq!(receiver.windows().tracked(), 0);
    tracked_ssbs
}

#[test]
fn every_ssb_of_a_stream_is_received_once_with_its_channel() {
    let (cell, samples) = cell_and_samples();
    let config = ReceiverConfig::new(cell.ssb_freq_hz, SPACING, 3);
    let all = tracked_ssbs(config.clone(), &samples, 1_000_000_000);
    let beams: Vec<u8> = all.iter().map(|ssb| ssb.ssb_index).collect();
    assert_eq!(beams, [2, 5, 2, 5, 2, 5, 2, 2, 2, 2, 5, 2, 5]);
    assert!(all.iter().skip(2).all(|ssb| ssb.tracked), "one search");
    for ssb in &all {
        assert_eq!((ssb.pci.get(), ssb.lmax), (cell.pci, Some(Lmax::L8)));
        let payload = ssb.payload.unwrap();
        let number = ((ssb.sample_start / RATE_HZ - 1e-3) / 0.02).round();
        assert_eq!(payload.sfn(), (cell.sfn + 2 * number as u16) % 1024);
        let sent = 2.0 * (cell.ssb_start(ssb.ssb_index) + number * 0.02 * SPACING.base_rate_hz());
        assert!((ssb.sample_start - sent).abs() < 0.2);
        // Four standard deviations of the phase from PSS to SSS, 127 elements at three antennas.
        assert!((ssb.cfo_hz - cell.cfo_hz).abs() < 150.0, "{}", ssb.cfo_hz);
        assert!((ssb.snr_db - 10.0).abs() < 1.0, "{}", ssb.snr_db);
        let (channel, noise) = (&ssb.channel, &ssb.noise_variance);
        assert_eq!(
            (channel.len(), noise.len(), ssb.measurements.len()),
            (3, 3, 3)
        );
        for antenna in 0..3 {
            // With one path, the ratio of two antennas is equal on every subcarrier, and the power
            // agrees with the SNR.
            let expected = cell.gains[antenna] / cell.gains[0];
            for (h, first) in channel[antenna].iter().zip(&channel[0]) {
                assert!((h / first - expected).norm() < 0.25);
            }
            let power: f32 = channel[antenna].iter().map(Complex32::norm_sqr).sum();
            let snr_db = 10.0 * (f64::from(power) / 240.0 / noise[antenna]).log10();
            assert!((snr_db - 10.0).abs() < 1.5, "{snr_db}");
        }
    }
    // The result does not depend on the block boundaries.
    for block in [1000, 76_800, 500_001] {
        assert_eq!(
            tracked_ssbs(config.clone(), &samples, block),
            all,
            "{block}"
        );
    }
}

#[test]
fn invalid_settings_are_rejected() {
    let config = ReceiverConfig::new(3.6e9, SPACING, 2);
    for (name, wrong) in [
        (
            "period_s",
            ReceiverConfig {
                period_s: 0.0,
                ..config.clone()
            },
        ),
        (
            "oscillator_ppm",
            ReceiverConfig {
                oscillator_ppm: 130.0,
                ..config.clone()
            },
        ),
        (
            "search_every_s",
            ReceiverConfig {
                search_every_s: f64::NAN,
                ..config.clone()
            },
        ),
        (
            "lost_after_s",
            ReceiverConfig {
                lost_after_s: -1.0,
                ..config.clone()
            },
        ),
    ] {
        let error = Receiver::new(wrong, RATE_HZ, 3.6e9)
            .err()
            .unwrap()
            .to_string();
        assert!(error.starts_with(name), "{error}");
    }
    let many = ReceiverConfig::new(3.6e9, SPACING, 17);
    assert!(Receiver::new(many, RATE_HZ, 3.6e9).is_err());
    let mut receiver = Receiver::new(config, RATE_HZ, 3.6e9).unwrap();
    let one: &[Complex32] = &[];
    assert!(receiver.push(&[one], &mut |_| {}).is_err());
}

#[test]
fn an_oscillator_error_of_20_ppm_is_found_within_three_bursts_of_the_longest_period() {
    for (spacing, ppm) in [
        (SubcarrierSpacing::Khz15, -20.0),
        (SubcarrierSpacing::Khz30, 20.0),
    ] {
        let mut cell = Cell::random(&mut rng(6), spacing, 2);
        (cell.lmax, cell.ssb_indices, cell.ssb_freq_hz) = (Lmax::L8, vec![2, 5], 3.6e9);
        cell.cfo_hz = -1e-6 * ppm * cell.ssb_freq_hz;
        let config = ReceiverConfig {
            period_s: 0.16,
            ..ReceiverConfig::new(cell.ssb_freq_hz, spacing, 2)
        };
        let rate_hz = spacing.base_rate_hz();
        let period = 0.16 * rate_hz * (1.0 + 1e-6 * ppm);
        let mut receiver = WindowReceiver::new(config).unwrap();
        let mut beams = Vec::new();
        for number in 0..5 {
            // The receiver is on around the bursts only.
            let begin = cell.delay + f64::from(number) * period;
            let mut samples = silence(2, (0.006 * rate_hz) as usize);
            let burst = Cell {
                delay: 300.0 + begin.fract(),
                ..cell.clone()
            };
            burst.add_to(&mut samples);
            add_noise(&mut samples, 5.0, &mut rng(7 + u64::from(number as u32)));
            let window = Window {
                start: begin.floor() as i64 - 300,
                antennas: &slices(&samples),
            };
            let mut tracked_ssbs = Vec::new();
            receiver
                .receive(&window, &mut |seen| tracked_ssbs.push(seen.ssb.ssb_index))
                .unwrap();
            beams.push(tracked_ssbs);
        }
        println!("{spacing:?} {ppm}: {beams:?}");
        assert!(
            beams[2..]
                .iter()
                .all(|tracked_ssbs| *tracked_ssbs == [2, 5]),
            "{beams:?}"
        );
    }
}

#[test]
fn unreported_gaps_are_inferred_from_the_beams() {
    let (cell, samples) = cell_and_samples();
    let config = ReceiverConfig {
        lost_after_s: 10.0,
        ..ReceiverConfig::new(cell.ssb_freq_hz, SPACING, 3)
    };
    let mut receiver = Receiver::new(config, RATE_HZ, 3.6e9 - 2e6).unwrap();
    // Remove 7 ms in the third period, then repeat all periods so that the search restarts.
    let cut = (0.05 * RATE_HZ) as usize..(0.057 * RATE_HZ) as usize;
    let mut unreported_gap = Vec::new();
    let mut push = |range: std::ops::Range<usize>| {
        let block: Vec<&[Complex32]> = samples.iter().map(|it| &it[range.clone()]).collect();
        receiver
            .push(&block, &mut |seen| unreported_gap.push(seen.unreported_gap))
            .unwrap();
    };
    push(0..cut.start);
    push(cut.end..samples[0].len());
    let lost = 0.007 * SPACING.base_rate_hz();
    assert_eq!(unreported_gap[..6], [0.0; 6]);
    let last = *unreported_gap.last().unwrap();
    assert!((last - lost).abs() < 1.0, "{unreported_gap:?}");
}
