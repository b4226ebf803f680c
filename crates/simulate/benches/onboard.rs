//! Single-threaded processing time of an SSB on the vehicle: from samples to angle, and from angle
//! to pose. Run with `cargo bench -p simulate`.
#![allow(clippy::unwrap_used, reason = "this is a benchmark")]

use std::f64::consts::TAU;

use nr_ssb::{BchPayload, Beam, Burst, Case, Complex32, Lmax, Mib, Numerology, Ofdm, Pci};
use onboard::estimator::{EstimatedAngle, built_in};
use onboard::localize::InitialPose;
use onboard::localize::ekf::EkfConfig;
use onboard::localize::{AngleMeasurement, Ekf, MeasurementKind};
use onboard::observation::OdometrySample;
use onboard::radio_head::RadioHead;
use onboard::receive::{Receiver, ReceiverConfig, Window};
use onboard::settings::{IntegritySettings, Shipped, Site, TomlFile, Vehicle};
use rand_distr::{Distribution, StandardNormal};
use simulate::random::{Purpose, Streams};

const ANTENNAS: usize = 4;
/// Samples in 20 ms at 3.84 Msps.
const PERIOD: usize = 76_800;

fn main() {
    divan::main();
}

fn nominal(site: &str) -> (Site, Vehicle) {
    let site = Site::from_library(site, &Shipped).unwrap();
    (
        site,
        Vehicle::from_library("paper-carrier", &Shipped).unwrap(),
    )
}

/// Returns 20 ms of the site's first cell at four antennas, with an SNR of 20 dB per resource
/// element.
fn samples(site: &Site) -> Vec<Vec<Complex32>> {
    let burst = Burst {
        pci: Pci::new(site.radio_heads[0].pci).unwrap(),
        case: Case::A,
        lmax: Lmax::L8,
        payload: BchPayload::new(Mib::default(), 7, false, 0).unwrap(),
        beams: vec![Beam::new(0)],
        ssb_freq_hz: Some(site.carrier_mhz * 1e6),
    };
    let numerology = Numerology::new(burst.case.spacing(), 256).unwrap();
    let sent = burst.iq(&mut Ofdm::new(numerology)).unwrap();
    let mut random = Streams::new(1, 0).generator(Purpose::SampleNoise, 0);
    // A resource element of unit power has the power 1/256 in a sample.
    let noise = (0.5 * 0.01 / 256.0_f32).sqrt();
    let mut draw = || -> f32 { StandardNormal.sample(&mut random) };
    (0..ANTENNAS)
        .map(|antenna| {
            let gain = Complex32::cis(0.2 * TAU as f32 * antenna as f32);
            let quiet = vec![Complex32::ZERO; PERIOD - sent.len()];
            let received = quiet.iter().chain(&sent);
            received
                .map(|sample| sample * gain + Complex32::new(draw(), draw()) * noise)
                .collect()
        })
        .collect()
}

#[divan::bench(args = ["pss", "pss+sss", "ssb"])]
fn samples_to_angle(bencher: divan::Bencher, pilots: &str) {
    let (site, vehicle) = nominal("trip-1");
    let vehicle = vehicle
        .with_overrides([("receiver.pilots", pilots.into())], &Shipped)
        .unwrap();
    let samples = samples(&site);
    let antennas: [&[Complex32]; ANTENNAS] = std::array::from_fn(|n| samples[n].as_slice());
    let mut receiver = Receiver::new(ReceiverConfig {
        search_every_s: f64::INFINITY,
        measures_ranging: false,
        ..ReceiverConfig::new(&site, &vehicle)
    })
    .unwrap();
    let mut estimator = built_in(&vehicle).unwrap();
    let mut number = 0;
    let mut next = || {
        let window = Window {
            start: (number * PERIOD) as u64,
            time_s: 0.0,
            antennas: &antennas,
        };
        number += 1;
        let mut phase_rad = None;
        let mut take = |observation: &_| {
            if let Some(EstimatedAngle::Angle {
                phase_rad: found, ..
            }) = estimator.estimate(observation).unwrap()
            {
                phase_rad = Some(found);
            }
        };
        receiver.receive(&window, &mut take).unwrap();
        phase_rad.unwrap()
    };
    next();
    bencher.bench_local(next);
}

/// Measures the time from angle to pose, with and without a map, and with an estimate of correlated
/// angle errors.
#[divan::bench(args = [(true, false), (false, false), (true, true)])]
fn angle_to_pose(bencher: divan::Bencher, (map, estimates_bias): (bool, bool)) {
    let (site, mut vehicle) = nominal("trip-2");
    vehicle.receiver.multipath_bias_probability = Some(if estimates_bias { 0.75 } else { 0.0 });
    let road = site.build_road().unwrap().unwrap();
    let heads = RadioHead::received_by(&site, &vehicle);
    let config = EkfConfig::new(&site, &vehicle);
    let start = InitialPose {
        pose: road.pose(0.0),
        position_std_m: 1.0,
        heading_std_rad: 0.05,
    };
    let known = map.then(|| std::sync::Arc::new(road));
    let mut tracker = Ekf::new(config, known, &heads, &start);
    let mut at = |metres: f64| {
        tracker.odometry(&OdometrySample {
            time_s: 0.25 * metres,
            distance_m: metres,
            speed_mps: 4.0,
            yaw_rate_radps: None,
        });
    };
    at(0.0);
    at(1.0);
    let bearing = start.pose.point().bearing_rad(heads[0].position) - start.pose.heading_rad;
    let measured = AngleMeasurement {
        kind: MeasurementKind::Angle,
        time_s: 0.25,
        phase_rad: 0.5 * TAU * bearing.cos(),
        phase_sigma_rad: 0.05,
        angle_rad: bearing,
        snr_db: 20.0,
        resolved: true,
    };
    // Each iteration starts from a copy of the tracker, because a second equal angle carries little
    // information. The time of the copy is excluded.
    bencher
        .with_inputs(|| tracker.clone())
        .bench_local_refs(|tracker| tracker.update(&heads[0], divan::black_box(&measured)));
}

/// Measures the time for one SSB of each of four radio heads, an odometry sample and the position
/// query, with and without integrity monitoring.
#[divan::bench(args = [true, false])]
fn burst_to_pose(bencher: divan::Bencher, guarded: bool) {
    let (site, mut vehicle) = nominal("trip-4");
    vehicle.integrity = Some(IntegritySettings {
        enabled: guarded,
        ..IntegritySettings::default()
    });
    let road = site.build_road().unwrap().unwrap();
    let heads = RadioHead::received_by(&site, &vehicle);
    let mut localizer = onboard::localize::built_in(&site, &vehicle, road.pose(0.0)).unwrap();
    let mut number = 0;
    let mut next = || {
        // The vehicle drives back and forth, so that the road does not end.
        let time_s = 0.02 * f64::from(number);
        let along_m = 100.0 - 100.0 * (0.04 * time_s).cos();
        number += 1;
        let odometry = localizer.odometry(&OdometrySample {
            time_s,
            distance_m: along_m,
            speed_mps: 4.0 * (0.04 * time_s).sin(),
            yaw_rate_radps: None,
        });
        odometry.unwrap();
        let pose = road.pose(along_m);
        for head in &heads {
            let angle_rad = pose.point().bearing_rad(head.position) - pose.heading_rad;
            let measured = AngleMeasurement {
                kind: MeasurementKind::Angle,
                time_s,
                phase_rad: 0.5 * TAU * angle_rad.cos(),
                phase_sigma_rad: 0.05,
                angle_rad,
                snr_db: 20.0,
                resolved: true,
            };
            localizer.update(head, &measured).unwrap();
        }
        localizer.pose(time_s).unwrap()
    };
    for _ in 0..1000 {
        next();
    }
    bencher.bench_local(next);
}
