//! The receiver over seconds: different clocks, sleep, lost and returning beams.

use crate::air;
use nr_ssb::{Complex32, Lmax, SubcarrierSpacing};
use num_complex::Complex64;
use onboard::burst::Burst;
use onboard::geometry::Pose;
use onboard::observation::{OdometrySample, SsbObservation};
use onboard::range::RangeQuantity;
use onboard::receive::{Receiver, ReceiverConfig, Window};
use onboard::settings::{
    ArraySettings, Pilots, Platform, SPEED_OF_LIGHT_MPS, Shipped, Site, TomlFile, Vehicle,
};
use onboard::{Custom, Pipeline};
use std::fmt::Write as _;

const PERIOD_S: f64 = 0.02;

/// Cell with eight beams, received by four antennas with a fast clock.
struct Air {
    cell: air::Cell,
    ppm: f64,
    snr_db: f64,
    half_frame: Vec<Complex32>,
    sending: Vec<u8>,
}

impl Air {
    fn new(spacing: SubcarrierSpacing, ppm: f64, snr_db: f64, seed: u64) -> Self {
        let mut cell = air::Cell::random(&mut air::rng(seed), spacing, 4);
        cell.lmax = Lmax::L8;
        cell.ssb_freq_hz = 3.6e9;
        cell.cfo_hz = -1e-6 * ppm * cell.ssb_freq_hz;
        let mut air = Self {
            cell,
            ppm,
            snr_db,
            half_frame: Vec::new(),
            sending: Vec::new(),
        };
        air.send((0..8).collect());
        air
    }

    fn send(&mut self, beams: Vec<u8>) {
        if beams != self.sending {
            self.cell.ssb_indices.clone_from(&beams);
            self.half_frame = self.cell.half_frame_samples();
            self.sending = beams;
        }
    }

    fn receiver(&self) -> Receiver {
        self.receiver_of(&[])
    }

    /// Returns a receiver with known beams.
    fn receiver_of(&self, beams: &[u8]) -> Receiver {
        Receiver::new(self.config(beams)).unwrap()
    }

    fn config(&self, beams: &[u8]) -> ReceiverConfig {
        ReceiverConfig {
            beams: beams.iter().map(|beam| (self.cell.pci, *beam)).collect(),
            ssb_freq_hz: self.cell.ssb_freq_hz,
            spacing: self.cell.spacing,
            period_s: PERIOD_S,
            pilots: Pilots::PssSss,
            snapshots: 20,
            array: ArraySettings::default(),
            cells: None,
            search_every_s: 1.0,
            measures_ranging: false,
        }
    }

    /// Returns the beams that the receiver reports for burst `number`.
    fn received(&self, receiver: &mut Receiver, number: u32) -> Vec<u8> {
        let observed = self.observed(receiver, number);
        let mut beams: Vec<u8> = observed.iter().map(|it| it.ssb.ssb_index).collect();
        beams.sort_unstable();
        beams
    }

    /// Returns the observations of burst `number`.
    fn observed(&self, receiver: &mut Receiver, number: u32) -> Vec<SsbObservation> {
        let rate_hz = self.cell.spacing.base_rate_hz();
        let begin = (1000.0 + f64::from(number) * PERIOD_S * rate_hz) * (1.0 + 1e-6 * self.ppm);
        let start = begin.floor() - 200.0;
        let late = air::delayed(&self.half_frame, begin.fract());
        let step = std::f64::consts::TAU * (self.cell.cfo_hz / rate_hz);
        let turned: Vec<Complex32> = late
            .iter()
            .enumerate()
            .map(|(n, x)| {
                let turn = Complex64::cis(step * (start + 200.0 + n as f64));
                x * Complex32::new(turn.re as f32, turn.im as f32)
            })
            .collect();
        let mut antennas = air::silence(4, self.half_frame.len() + 400);
        for (antenna, gain) in antennas.iter_mut().zip(&self.cell.gains) {
            for (sample, x) in antenna[200..].iter_mut().zip(&turned) {
                *sample = x * gain;
            }
        }
        air::add_noise(
            &mut antennas,
            self.snr_db,
            &mut air::rng(7_000 + u64::from(number)),
        );
        let window = Window {
            start: start as u64,
            time_s: start / rate_hz,
            antennas: &air::slices(&antennas),
        };
        let mut observed = Vec::new();
        receiver
            .receive(&window, &mut |it| observed.push(it.clone()))
            .unwrap();
        observed
    }
}

#[test]
fn a_beam_that_vanishes_and_returns_is_received_again() {
    let mut air = Air::new(SubcarrierSpacing::Khz30, 3.0, 8.0, 1);
    let mut receiver = air.receiver();
    let all: Vec<u8> = (0..8).collect();
    let others: Vec<u8> = all.iter().copied().filter(|beam| *beam != 3).collect();
    for number in 0..50 {
        assert_eq!(air.received(&mut receiver, number), all, "burst {number}");
    }
    // Beams are missing for three seconds.
    air.send(others.clone());
    let before = receiver.searches();
    for number in 50..200 {
        assert_eq!(
            air.received(&mut receiver, number),
            others,
            "burst {number}"
        );
    }
    assert!(
        receiver.searches() - before <= 3,
        "{}",
        receiver.searches() - before
    );
    assert_eq!(receiver.tracked(), 7);
    // Beams are received again within the second between two searches.
    air.send(all.clone());
    let back = (200..252).find(|number| air.received(&mut receiver, *number) == all);
    println!("received again in burst {back:?}");
    let back = back.unwrap();
    for number in back + 1..back + 20 {
        assert_eq!(air.received(&mut receiver, number), all, "burst {number}");
    }
}

#[test]
fn no_search_while_all_known_beams_are_received() {
    let mut air = Air::new(SubcarrierSpacing::Khz30, 3.0, 8.0, 1);
    let all: Vec<u8> = (0..8).collect();
    let mut receiver = air.receiver_of(&all);
    for number in 0..150 {
        assert_eq!(air.received(&mut receiver, number), all, "burst {number}");
    }
    assert_eq!(receiver.searches(), 1);
    // One beam is missing until it is removed, and detected again as by a receiver without beams.
    air.send((1..8).collect());
    for number in 150..280 {
        air.received(&mut receiver, number);
    }
    assert_eq!(receiver.tracked(), 7);
    assert!(
        (3..=4).contains(&receiver.searches()),
        "{}",
        receiver.searches()
    );
    air.send(all.clone());
    assert!((280..332).any(|number| air.received(&mut receiver, number) == all));
}

#[test]
fn a_briefly_hidden_beam_causes_no_search() {
    let mut air = Air::new(SubcarrierSpacing::Khz30, -5.0, 8.0, 2);
    let mut receiver = air.receiver();
    let all: Vec<u8> = (0..8).collect();
    for number in 0..10 {
        assert_eq!(air.received(&mut receiver, number), all);
    }
    air.send(vec![0, 7]);
    for number in 10..30 {
        assert_eq!(air.received(&mut receiver, number), [0, 7]);
    }
    air.send(all.clone());
    assert_eq!(air.received(&mut receiver, 30), all);
    assert_eq!(receiver.searches(), 1);
}

#[test]
fn every_oscillator_error_is_found_and_sleep_is_bridged() {
    for spacing in [SubcarrierSpacing::Khz15, SubcarrierSpacing::Khz30] {
        for ppm in [-20.0, -2.0, 7.0, 20.0, 45.0] {
            let air = Air::new(spacing, ppm, 5.0, 3);
            let mut receiver = air.receiver();
            let all: Vec<u8> = (0..8).collect();
            let first = (0..30).find(|number| air.received(&mut receiver, *number) == all);
            let first = first.unwrap();
            println!("{spacing:?} {ppm} ppm: found in burst {first}");
            for number in first + 1..first + 6 {
                assert_eq!(air.received(&mut receiver, number), all);
            }
            // Reception of one burst per second, and of one burst in ten seconds, without
            // additional searches.
            for asleep in [50, 500, 1000] {
                let received = air.received(&mut receiver, first + 6 + asleep);
                assert_eq!(received, all, "{spacing:?} {ppm} ppm, {asleep}");
            }
        }
    }
}

/// Creates a channel with a vehicle clock that is 3 ppm fast, and beams that arrive together.
fn ranging_air() -> Air {
    let mut air = Air::new(SubcarrierSpacing::Khz30, 3.0, 15.0, 3);
    air.cell.gains = vec![Complex32::ONE; 4];
    air
}

#[test]
fn delays_and_rates_follow_the_clock() {
    let air = ranging_air();
    let mut receiver = Receiver::new(ReceiverConfig {
        measures_ranging: true,
        ..air.config(&[])
    })
    .unwrap();
    let (mut count, mut delay_square, mut rates) = (0, 0.0, 0);
    let mut origin_s = None;
    for number in 0..60 {
        for it in air.observed(&mut receiver, number) {
            let ranging = it.ranging.unwrap();
            // All beams have the same delay, which grows by 3 µs per second.
            let expected_s = 3e-6 * PERIOD_S * f64::from(number);
            let offset_s = ranging.delay_s - expected_s;
            let from_s = *origin_s.get_or_insert(offset_s);
            if number < 10 {
                continue;
            }
            count += 1;
            delay_square += ((offset_s - from_s) / ranging.delay_sigma_s).powi(2);
            if ranging.is_rate_of_phases {
                rates += 1;
                assert!((ranging.rate_interval_s - PERIOD_S).abs() < 1e-4);
                let error_mps = ranging.rate_mps - 3e-6 * SPEED_OF_LIGHT_MPS;
                assert!(
                    error_mps.abs() < 5.0 * ranging.rate_sigma_mps,
                    "{error_mps}"
                );
            }
        }
    }
    let nees = delay_square / f64::from(count);
    println!("{count} delays, NEES {nees:.2}, {rates} rates of phase differences");
    assert!(count > 350 && rates > 300);
    // The origin is one delay with the same noise.
    assert!((0.5..6.0).contains(&nees), "{nees}");
}

#[test]
fn delays_measured_by_the_receiver_update_the_filter() {
    let air = ranging_air();
    let mut site = format!(
        "name = \"hall\"\ncarrier_mhz = {:?}\n",
        1e-6 * air.cell.ssb_freq_hz
    );
    for beam in 0..8 {
        // Left of the vehicle, at 50 m.
        let x_m = 0.1 * f64::from(beam);
        writeln!(
            site,
            "[[radio_heads]]\npci = {}\nssb_index = {beam}\nposition_m = [{x_m:?}, 50.0, 0.0]",
            air.cell.pci
        )
        .unwrap();
    }
    let located = |ranging: &str| {
        let vehicle = format!(
            "name = \"cart\"\ndrive = \"differential\"\n[start]\npose = [0.0, 0.0, 0.0]\n\
             position_std_m = 0.5\nheading_std_rad = 0.02\n\
             [wake_up]\npolicy = \"fixed\"\ninterval_ms = 1.0\n{ranging}"
        );
        let site = Site::from_toml(&site, "site", &Shipped).unwrap();
        let vehicle = Vehicle::from_toml(&vehicle, "vehicle", &Shipped).unwrap();
        let platform = Platform::from_library(&vehicle.platform.name, &Shipped).unwrap();
        let mut receiver = Receiver::new(ReceiverConfig {
            measures_ranging: vehicle.has_one_way_ranging(),
            ..air.config(&[])
        })
        .unwrap();
        let start = Pose::default();
        let mut onboard =
            Pipeline::new(&site, &vehicle, &platform, start, Custom::default()).unwrap();
        let mut verdicts = Vec::new();
        for number in 0..60 {
            let observed = air.observed(&mut receiver, number);
            let Some(first) = observed.first() else {
                continue;
            };
            let time_s = first.ssb.time_s;
            // Odometry that is newer than the burst: the delays are late.
            for late_s in [0.0, 0.01] {
                let sample = OdometrySample {
                    distance_m: 0.0,
                    ..OdometrySample::of_speed(time_s + late_s, 0.0, Some(0.0))
                };
                onboard.odometry(&sample).unwrap().unwrap();
            }
            onboard
                .process_burst(time_s, &mut Burst(&observed))
                .unwrap();
            verdicts.extend(
                onboard
                    .ranges()
                    .iter()
                    .map(|it| (it.measured.quantity, it.verdict)),
            );
        }
        (onboard.pose(1.2).unwrap(), verdicts)
    };
    let (_, without) = located("");
    assert!(without.is_empty());
    let (estimate, verdicts) = located("[ranging]\nkind = \"one-way\"\n");
    let delays = verdicts.iter().filter(|it| it.0 == RangeQuantity::Range);
    let accepted = verdicts.iter().filter(|it| it.1.accepted).count();
    println!("{accepted} of {} accepted", verdicts.len());
    assert!(delays.count() > 50 && verdicts.len() > 100);
    assert!(accepted as f64 > 0.95 * verdicts.len() as f64);
    assert!(estimate.pose.point().distance_m(Pose::default().point()) < 0.5);
}
