//! Delay, carrier phase, range rate and power of SSBs after sleeps, against the Cramér–Rao bound, in
//! multipath, and across gaps of a stream.

use nr_ssb::observables::delay::Multipath;
use nr_ssb::observables::range_rate::RateSource;
use nr_ssb::receiver::{ReceivedBeam, Receiver, ReceiverConfig};
use nr_ssb::{Complex32, Lmax, SubcarrierSpacing};

use crate::air;
use crate::moving::{Echoes, Error, LIGHT_M_S, Moving, SsbErrors, summary};

/// Number of SSBs of one run.
const RUN: usize = 30;
/// Number of SSBs at the start of a run that are not evaluated.
const SETTLE: usize = 6;

/// Returns SSBs at 3.6 and 7.2 MHz after sleeps of 20 ms to 5 s.
fn received(snrs_db: &[f64], runs: u64, echoes: Option<Echoes>) -> Vec<SsbErrors> {
    let mut all = Vec::new();
    for spacing in [SubcarrierSpacing::Khz15, SubcarrierSpacing::Khz30] {
        for (number, snr_db) in snrs_db.iter().enumerate() {
            for run in 0..runs {
                let seed = u64::from(spacing.khz());
                let mut moving = Moving::new(
                    spacing,
                    *snr_db,
                    echoes,
                    seed * 100 + run + 10 * number as u64,
                );
                let sleeps_s = [0.02, 0.02, 0.02, 0.16, 1.0, 5.0];
                for (ssb, sleep_s) in sleeps_s.into_iter().cycle().take(RUN).enumerate() {
                    let settling = ssb < SETTLE;
                    let ssbs = moving.next(if settling { 0.02 } else { sleep_s });
                    all.extend(ssbs.filter(|_| !settling));
                }
            }
        }
    }
    all
}

/// Selection of a quantity.
type Select = fn(&SsbErrors) -> Error;

fn errors(ssbs: &[SsbErrors], of: Select) -> Vec<Error> {
    ssbs.iter().map(of).collect()
}

#[test]
fn errors_attain_the_bound_and_agree_with_their_standard_deviations() {
    let ssbs = received(&[0.0, 15.0, 30.0], 5, None);
    assert_eq!(ssbs.len(), 2 * 3 * 5 * (RUN - SETTLE));
    let quantities: [(&str, Select); 4] = [
        ("delay", |it| it.delay),
        ("phase", |it| it.phase),
        ("rate", |it| it.rate),
        ("power", |it| it.power),
    ];
    for (name, of) in quantities {
        let it = summary(&errors(&ssbs, of));
        // Four standard deviations of a mean of squares of standard normal variables, and of their
        // mean.
        let margin = 4.0 * (2.0 / it.count as f64).sqrt();
        assert!((it.ratio.powi(2) - 1.0).abs() < margin, "{name}: {it:?}");
        assert!((it.nees - 1.0).abs() < margin, "{name}: {it:?}");
        assert!(
            it.bias_sigmas.abs() < 4.0 / (it.count as f64).sqrt(),
            "{name}: {it:?}"
        );
    }
    // No false detection of multipath in most SSBs, and no wrong number of cycles.
    let single = ssbs
        .iter()
        .filter(|it| it.multipath == Multipath::NotDetected);
    assert!(single.count() * 100 > ssbs.len() * 97);
    let from_phase: Vec<_> = ssbs
        .iter()
        .filter(|it| it.source == RateSource::PhaseDifference)
        .collect();
    assert!(
        from_phase
            .iter()
            .all(|it| it.rate.value.abs() < 6.0 * it.rate.sigma)
    );
    // At 15 dB, the phase difference is used after every sleep of 20 ms, and never after 1 or 5 s.
    assert!(from_phase.len() * 4 > ssbs.len());
    assert!(from_phase.iter().all(|it| it.sleep_s < 1.0));
}

#[test]
fn a_first_path_is_found_in_multipath_or_reported_as_uncertain() {
    for (k_db, mean_delay_s) in [(10.0, 30e-9), (5.0, 60e-9)] {
        let echoes = Echoes {
            k_db,
            mean_delay_s,
            count: 12,
        };
        let ssbs = received(&[10.0, 20.0], 3, Some(echoes));
        let detected = ssbs
            .iter()
            .filter(|it| it.multipath != Multipath::NotDetected);
        assert!(detected.count() * 10 > ssbs.len() * 9, "K {k_db} dB");
        let found: Vec<SsbErrors> = ssbs
            .iter()
            .filter(|it| it.multipath != Multipath::Uncertain)
            .copied()
            .collect();
        assert!(found.len() * 2 > ssbs.len(), "K {k_db} dB: {}", found.len());
        for (name, of) in [
            ("delay", (|it| it.delay) as Select),
            ("phase", |it| it.phase),
            ("rate", |it| it.rate),
        ] {
            let it = summary(&errors(&found, of));
            assert!(it.nees < 1.5, "K {k_db} dB, {name}: {it:?}");
        }
        // The delay of the centroid of the paths is 1/(K + 1) of the mean delay of the echoes.
        let late = mean_delay_s / (1.0 + 10f64.powf(0.1 * k_db));
        let bias = found.iter().map(|it| it.delay.value).sum::<f64>() / found.len() as f64;
        assert!(bias.abs() < 0.6 * late, "K {k_db} dB: {bias} of {late}");
    }
    // A first path 10 dB below the echoes.
    let blocked = Echoes {
        k_db: -10.0,
        mean_delay_s: 60e-9,
        count: 12,
    };
    let ssbs = received(&[20.0], 2, Some(blocked));
    let uncertain = ssbs
        .iter()
        .filter(|it| it.multipath == Multipath::Uncertain);
    assert!(uncertain.count() * 10 > ssbs.len() * 9);
}

/// A reflection from the ground arrives a few nanoseconds later, with nearly the power of the first path.
#[test]
fn two_strong_paths_that_the_band_does_not_separate_are_not_a_single_path() {
    let reflection = Echoes {
        k_db: 2.0,
        mean_delay_s: 3e-9,
        count: 1,
    };
    let ssbs = received(&[40.0], 10, Some(reflection));
    let is_late = |it: &&SsbErrors| it.delay.value.abs() * LIGHT_M_S > 0.15;
    let late = ssbs.iter().filter(is_late);
    let single = late
        .clone()
        .filter(|it| it.multipath == Multipath::NotDetected)
        .count();
    let late = late.count();
    assert!(late * 5 > ssbs.len(), "{late} of {}", ssbs.len());
    assert!(single * 50 < late, "{single} of {late}");
}

/// Observed SSB: beam, start and phase reference in input samples, phases of both antennas.
type Phases = (u8, f64, [f64; 2]);

/// Receives two beams at 11.52 Msps, 1.1 MHz from the centre, without the samples of some ranges.
fn receive_with_gaps(gaps: &[(usize, usize)]) -> Vec<Phases> {
    let spacing = SubcarrierSpacing::Khz30;
    let mut cell = air::Cell::random(&mut air::rng(7), spacing, 2);
    (cell.lmax, cell.ssb_freq_hz, cell.ssb_indices) = (Lmax::L8, 3.6e9, vec![1, 6]);
    (cell.delay, cell.cfo_hz) = (1000.3, 0.0);
    let period = 153_600;
    let mut burst = air::silence(2, period);
    cell.add_to(&mut burst);
    let rate_hz = 1.5 * spacing.base_rate_hz();
    let offset_hz = 1.1e6;
    let recording: Vec<Vec<Complex32>> = burst
        .iter()
        .map(|base| {
            let wide = air::resampled(base, 3, 2);
            let all = wide.iter().cycle().take(4 * wide.len()).enumerate();
            let cycles = offset_hz / rate_hz;
            all.map(|(n, x)| x * air::phasor(std::f64::consts::TAU * (cycles * n as f64).fract()))
                .collect()
        })
        .collect();
    let config = ReceiverConfig::new(cell.ssb_freq_hz, spacing, 2);
    let mut receiver = Receiver::new(config, rate_hz, cell.ssb_freq_hz - offset_hz).unwrap();
    let mut found = Vec::new();
    let mut take = |seen: ReceivedBeam<'_>| {
        let observed = seen.tracker.observe(seen.ssb).unwrap();
        let start = observed.observables.delay.first_path_start;
        found.push((
            seen.ssb.ssb_index,
            start,
            [0, 1].map(|antenna| observed.amplitudes[antenna].arg()),
        ));
    };
    let mut from = 0;
    for (gap_start, gap_end) in gaps.iter().copied().chain([(recording[0].len(), 0)]) {
        let part: Vec<_> = recording.iter().map(|it| &it[from..gap_start]).collect();
        receiver.push(&part, &mut take).unwrap();
        if gap_end > 0 {
            receiver.gap_to(gap_end as u64, &mut take).unwrap();
        }
        from = gap_end;
    }
    receiver.finish(&mut take).unwrap();
    found
}

#[test]
fn delay_and_phase_continue_after_gaps_and_agree_between_beams() {
    let whole = receive_with_gaps(&[]);
    assert_eq!(whole.len(), 8);
    // Both beams have one antenna port: their phases are equal once the carrier resets are removed.
    for (_, _, phases) in &whole {
        for (phase, expected) in phases.iter().zip(whole[0].2) {
            assert!((phase - expected).sin().abs() < 2e-3, "{whole:?}");
            assert!((phase - expected).cos() > 0.0, "{whole:?}");
        }
    }
    // Gaps in the silence of the second and third period, which end between output samples.
    let period = 230_400;
    for shift in 0..3 {
        let gaps = [
            (period + 120_000, period + 180_000 + shift),
            (2 * period + 120_001, 2 * period + 190_001 + shift),
        ];
        let with_gaps = receive_with_gaps(&gaps);
        assert_eq!(with_gaps.len(), whole.len());
        for ((beam, start, phases), (_, expected, expected_phases)) in with_gaps.iter().zip(&whole)
        {
            assert!(
                (start - expected).abs() < 1e-3,
                "beam {beam}: {start} {expected}"
            );
            for (phase, expected) in phases.iter().zip(expected_phases) {
                assert!(
                    (phase - expected).sin().abs() < 2e-3,
                    "beam {beam}: {phase} {expected}"
                );
                assert!(
                    (phase - expected).cos() > 0.0,
                    "beam {beam}: {phase} {expected}"
                );
            }
        }
    }
}
