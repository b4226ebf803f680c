//! Drives whose data are processed as they arrive.

use std::path::Path;

use num_complex::Complex32;
use onboard::live::{
    AngleObservation, AngleRecord, Continuity, LiveError, Reason, State, StreamConfig,
};
use onboard::observation::{MeasurementKind, OdometrySample};
use onboard::settings::{FixedSettings, Platform, Site, Vehicle, WakeUpSettings};
use onboard::{AngleResult, Custom, Live};
use recording::replay::{StartChoice, locate_angles, locate_recording};
use recording::{Datatype, OdometryLog, Recording, load, read_odometry_csv};
use simulate::scenario::Scenario;
use simulate::{SynthSettings, synthesize};

use crate::common::{self, changed, logs, shipped, value};
use crate::counting::allocations;

const RATE_HZ: f64 = 3.84e6;

/// Recorded drive with all samples.
struct Recorded {
    site: Site,
    vehicle: Vehicle,
    platform: Platform,
    odometry: OdometryLog,
    recording: Recording,
    centre_hz: f64,
}

/// Returns a scenario without a time offset, because the replay of a log searches for one.
fn scenario() -> Scenario {
    changed(
        "paper-real-odometry-2",
        [
            (
                "site.road.segments",
                value("[{ length_m = 60.0, turn_rad = 0.1 }]"),
            ),
            ("site.radio_heads[1].ssb_index", 2.into()),
            ("vehicle.receiver.angle_time_offset_std_s", 0.0.into()),
        ],
    )
}

fn record(dir: &Path, duration_s: f64) -> Recorded {
    let settings = SynthSettings {
        seed: 1,
        run: 0,
        duration_s: Some(duration_s),
        continuous: true,
        datatype: Datatype::Ci16Le,
    };
    let made = synthesize(&scenario(), &settings, dir, &mut |_| true).unwrap();
    let path = |name: &str| dir.join(name).display().to_string();
    let site: Site = load(&path("site.toml")).unwrap();
    let mut vehicle: Vehicle = load(&path("vehicle.toml")).unwrap();
    vehicle.wake_up = Some(WakeUpSettings::EVERY_SSB);
    Recorded {
        platform: load(&vehicle.platform.name).unwrap(),
        odometry: read_odometry_csv(&dir.join("odometry.csv")).unwrap(),
        recording: Recording::open(&made.recording).unwrap(),
        centre_hz: site.carrier_mhz * 1e6,
        site,
        vehicle,
    }
}

impl Recorded {
    fn live(&self) -> Live {
        let stream = StreamConfig {
            rate_hz: RATE_HZ,
            centre_hz: self.centre_hz,
        };
        let (site, vehicle) = (&self.site, &self.vehicle);
        let custom = Custom::default();
        Live::new(site, vehicle, &self.platform, None, Some(stream), custom).unwrap()
    }

    fn samples(&mut self) -> Vec<Vec<Complex32>> {
        let length = self.recording.length() as usize;
        let mut samples = Vec::new();
        self.recording.read(0, length, &mut samples).unwrap();
        samples
    }
}

fn slices(samples: &[Vec<Complex32>], from: usize, to: usize) -> Vec<&[Complex32]> {
    samples
        .iter()
        .map(|it| &it[from..to.min(it.len())])
        .collect()
}

/// Processes blocks of the given length. Odometry up to the end of a block precedes the block.
fn drive(
    live: &mut Live,
    odometry: &OdometryLog,
    samples: &[Vec<Complex32>],
    block: usize,
) -> Vec<AngleRecord> {
    let mut outcomes = Vec::new();
    let mut odometry = odometry.samples.iter().peekable();
    let mut from = 0;
    while from < samples[0].len() {
        let end_s = (from + block) as f64 / RATE_HZ;
        while let Some(sample) = odometry.next_if(|it| it.time_s <= end_s) {
            live.odometry(sample).unwrap();
        }
        let taken = live.samples(from as f64 / RATE_HZ, &slices(samples, from, from + block));
        let first = if from == 0 {
            Continuity::First
        } else {
            Continuity::Contiguous
        };
        assert_eq!(taken.unwrap(), first);
        from += block;
        outcomes.extend(std::iter::from_fn(|| live.next_angle_record()));
    }
    live.flush().unwrap();
    outcomes.extend(std::iter::from_fn(|| live.next_angle_record()));
    outcomes
}

#[test]
fn live_samples_give_the_poses_of_the_recording() {
    let mut recorded = record(&common::scratch("live"), 2.0);
    let (site, vehicle) = (&recorded.site, &recorded.vehicle);
    let (start, odometry) = (StartChoice::AsSet, &recorded.odometry);
    let recording = &mut recorded.recording;
    let located = locate_recording(site, vehicle, start, odometry, recording, 0.0, false).unwrap();
    let samples = recorded.samples();
    assert!(
        located.aoa_estimates.len() > 190,
        "{}",
        located.aoa_estimates.len()
    );
    let mut live = recorded.live();
    let mut outcomes = Vec::new();
    for block in [76_800, 19_200, 5_003] {
        live = recorded.live();
        outcomes = drive(&mut live, &recorded.odometry, &samples, block);
        let aoa_estimates: Vec<AngleResult> = outcomes.iter().map(|it| it.angle_result).collect();
        assert_eq!(aoa_estimates, located.aoa_estimates, "{block}");
    }
    let aoa_estimates = &located.aoa_estimates;
    let status = live.status(2.0).unwrap();
    assert_eq!(status.tracked, 2);
    assert_eq!(status.state, State::Unmonitored);
    for (head, outcome) in live.heads().iter().zip(&outcomes[outcomes.len() - 2..]) {
        assert!(head.accepted > 80 && head.refused < 5, "{head:?}");
        assert!(outcome.residual_rad.unwrap().abs() < 0.5);
    }
    let energy = live.energy();
    assert_eq!(energy.aoa_estimates, aoa_estimates.len());
    assert!((energy.duration_s - 2.0).abs() < 0.1, "{energy:?}");
}

#[test]
fn live_angles_give_the_poses_of_the_log() {
    let scenario = shipped("paper-real-odometry-4");
    let (odometry, angles, _) = logs(&scenario, 3);
    let (site, mut vehicle) = (scenario.site.clone(), scenario.vehicle.clone());
    vehicle.wake_up = Some(WakeUpSettings::EVERY_SSB);
    // The replay of a log searches for a time offset; disable this.
    vehicle.receiver.angle_time_offset_std_s = Some(0.0);
    vehicle.start.pose = Some(
        scenario
            .path(onboard::settings::Check { file: "test" })
            .unwrap()
            .pose(0.0),
    );
    let start = StartChoice::AsSet;
    let located = locate_angles(&site, &vehicle, start, &odometry, &angles, false).unwrap();
    let platform: Platform = load(&vehicle.platform.name).unwrap();
    let mut live = Live::new(&site, &vehicle, &platform, None, None, Custom::default()).unwrap();
    let mut angles = angles.angles.iter().peekable();
    for (sample, pose) in odometry.samples.iter().zip(&located.poses) {
        while let Some(angle) = angles.next_if(|it| it.ssb.time_s < sample.time_s) {
            live.angle(&AngleObservation {
                kind: MeasurementKind::Angle,
                pci: angle.ssb.pci,
                ssb_index: angle.ssb.ssb_index,
                time_s: angle.ssb.time_s,
                phase_rad: angle.measured.phase_rad,
                sigma_rad: angle.measured.phase_sigma_rad,
                snr_db: Some(angle.ssb.snr_db),
                resolved: angle.measured.resolved,
            })
            .unwrap();
        }
        live.odometry(sample).unwrap();
        let status = live.status(sample.time_s).unwrap();
        assert_eq!(status.pose, Some(pose.estimate.pose), "{}", sample.time_s);
        assert_eq!(status.covariance, pose.estimate.covariance);
    }
}

#[test]
fn live_processing_allocates_nothing_after_initialisation() {
    let mut recorded = record(&common::scratch("live-allocation"), 1.2);
    let samples = recorded.samples();
    let mut live = recorded.live();
    let block = 19_200;
    let half = samples[0].len() / block / 2;
    let mut odometry = recorded.odometry.samples.iter().peekable();
    let mut feed = |from: usize, to: usize| {
        let mut received = 0;
        for number in from..to {
            let (from, to) = (number * block, (number + 1) * block);
            let end_s = to as f64 / RATE_HZ;
            while let Some(sample) = odometry.next_if(|it| it.time_s <= end_s) {
                live.odometry(sample).unwrap();
            }
            let mut antennas: [&[Complex32]; 4] = [&[]; 4];
            for (antenna, samples) in antennas.iter_mut().zip(&samples) {
                *antenna = &samples[from..to];
            }
            live.samples(from as f64 / RATE_HZ, &antennas).unwrap();
            while live.next_angle_record().is_some() {
                received += 1;
            }
            std::hint::black_box(live.status(end_s).unwrap());
        }
        received
    };
    feed(0, half);
    let mut received = 0;
    let count = allocations(|| received = feed(half, 2 * half));
    assert!(received > 40, "{received}");
    assert_eq!(count, 0);
}

#[test]
fn rejected_inputs_change_nothing() {
    let mut recorded = record(&common::scratch("live-refusals"), 0.2);
    let samples = recorded.samples();
    let mut live = recorded.live();
    assert_eq!(live.status(0.0).unwrap().reason, Reason::NoOdometry);
    drive(&mut live, &recorded.odometry, &samples, 19_200);
    let before = live.status(0.2).unwrap();
    let four = slices(&samples, 0, 100);
    assert!(matches!(
        live.samples(f64::NAN, &four),
        Err(LiveError::Time { .. })
    ));
    assert!(matches!(
        live.samples(0.3, &four[..3]),
        Err(LiveError::Receive(_))
    ));
    let unequal = [four[0], four[1], four[2], &four[3][..50]];
    assert!(matches!(
        live.samples(0.3, &unequal),
        Err(LiveError::Receive(_))
    ));
    for (time_s, speed_mps) in [
        (0.1, 1.0),
        (f64::NAN, 1.0),
        (0.4, f64::NAN),
        (0.4, f64::INFINITY),
    ] {
        let sample = OdometrySample::of_speed(time_s, speed_mps, None);
        assert!(matches!(
            live.odometry(&sample),
            Err(LiveError::Odometry(_) | LiveError::Time { .. })
        ));
    }
    let angle = AngleObservation {
        kind: MeasurementKind::Angle,
        pci: 1,
        ssb_index: 0,
        time_s: 0.2,
        phase_rad: 0.1,
        sigma_rad: 0.0,
        snr_db: None,
        resolved: true,
    };
    assert!(matches!(live.angle(&angle), Err(LiveError::Value { .. })));
    assert!(matches!(
        live.exclude(999),
        Err(LiveError::UnknownCell { pci: 999 })
    ));
    let pose = before.pose.unwrap();
    assert!(live.set_pose(0.2, pose, Some([[f64::NAN; 3]; 3])).is_err());
    assert!(live.set_pose(9.0, pose, None).is_err());
    assert!(live.listens(f64::INFINITY).is_err());
    assert_eq!(live.status(0.2).unwrap(), before);
}

#[test]
fn a_pose_can_be_set_and_cleared_and_cells_can_be_excluded() {
    let mut recorded = record(&common::scratch("live-given"), 0.6);
    let samples = recorded.samples();
    let mut live = recorded.live();
    let outcomes = drive(&mut live, &recorded.odometry, &samples, 19_200);
    let newest = *recorded.odometry.samples.last().unwrap();
    let now_s = newest.time_s;
    let mut elsewhere = live.status(now_s).unwrap().pose.unwrap();
    elsewhere.x_m += 1.0;
    let covariance = [[0.25, 0.0, 0.0], [0.0, 0.25, 0.0], [0.0, 0.0, 1e-4]];
    live.set_pose(now_s, elsewhere, Some(covariance)).unwrap();
    let given = live.status(now_s).unwrap();
    assert!(given.pose.unwrap().point().distance_m(elsewhere.point()) < 0.2);
    let pci = outcomes[0].angle_result.ssb.pci;
    live.exclude(pci).unwrap();
    assert!(
        live.heads()
            .iter()
            .all(|it| it.is_excluded == (it.head.pci == pci))
    );
    live.readmit(pci).unwrap();
    assert!(live.next_wake_up_s(now_s).unwrap() > now_s);
    live.reset().unwrap();
    assert_eq!(live.status(now_s).unwrap().state, State::Waiting);
    live.odometry(&OdometrySample::of_speed(0.0, 1.0, None))
        .unwrap();
    let status = live.status(0.0).unwrap();
    assert_eq!(
        (status.state, status.reason),
        (State::Searching, Reason::NoAngle)
    );
    assert_eq!(live.next_wake_up_s(0.0).unwrap(), 0.0);
}

/// Feeds samples like a radio that is off between the required bursts, one millisecond at a time.
/// From sample number `from` on, `lost` samples are missing and not counted. Returns the times of
/// the received bursts.
fn drive_asleep(
    live: &mut Live,
    odometry: &OdometryLog,
    samples: &[Vec<Complex32>],
    [from, lost]: [usize; 2],
    resumes: bool,
) -> Vec<f64> {
    const STEP: usize = 3840;
    // Either of the two radio heads may be the first that was received: their SSBs are 1 ms apart.
    const GUARD_S: f64 = 2e-3;
    const LENGTH_S: f64 = 3e-3;
    let (mut odometry, mut received) = (odometry.samples.iter().peekable(), Vec::new());
    let (mut number, mut counted) = (0, 0);
    let mut window: Option<[f64; 2]> = None;
    while number + STEP <= samples[0].len() {
        if (from..from + STEP).contains(&number) {
            number += lost;
            if resumes {
                live.samples_resumed();
                window = None;
            }
        }
        let (block_s, end_s) = (counted as f64 / RATE_HZ, (counted + STEP) as f64 / RATE_HZ);
        while let Some(sample) =
            odometry.next_if(|it| it.time_s <= (number + STEP) as f64 / RATE_HZ)
        {
            live.odometry(sample).unwrap();
        }
        let wanted = window.is_none_or(|[from_s, until_s]| end_s > from_s && block_s < until_s);
        if wanted {
            live.samples(block_s, &slices(samples, number, number + STEP))
                .unwrap();
        }
        if window.is_none_or(|[_, until_s]| end_s >= until_s) {
            if window.is_some() {
                live.end_segment().unwrap();
                live.process_until(f64::INFINITY).unwrap();
            }
            let next_s = live.next_wake_up_s(end_s).unwrap();
            let was_open = window.is_none();
            window = (next_s > end_s).then_some([next_s - GUARD_S, next_s + LENGTH_S]);
            if was_open && window.is_some() {
                live.end_segment().unwrap();
            }
        }
        received.extend(
            std::iter::from_fn(|| live.next_angle_record()).map(|it| it.angle_result.ssb.time_s),
        );
        number += STEP;
        counted += STEP;
    }
    received
}

#[test]
fn the_receiver_opens_after_empty_windows_and_after_missing_samples() {
    let mut recorded = record(&common::scratch("live-asleep"), 3.0);
    recorded.vehicle.wake_up = Some(WakeUpSettings::Fixed(FixedSettings {
        interval_ms: Some(80.0),
        ..FixedSettings::default()
    }));
    let samples = recorded.samples();
    // At 0.3 s, samples of 7.3 ms are missing. Windows placed relative to the last SSB miss all
    // following SSBs.
    let (from, lost) = ((0.3 * RATE_HZ) as usize, (7.3e-3 * RATE_HZ) as usize);
    for (resumes, max_s) in [(false, 1.25), (true, 0.2)] {
        let mut live = recorded.live();
        let received = drive_asleep(
            &mut live,
            &recorded.odometry,
            &samples,
            [from, lost],
            resumes,
        );
        let after = received.iter().copied().find(|it| *it > 0.31).unwrap();
        assert!(after < 0.3 + max_s, "{after}");
        // After re-acquisition, the receiver sleeps again and every window contains its SSBs: two
        // per 80 ms.
        let later = received.iter().filter(|it| **it > after + 0.1).count();
        let expected = 2.0 * (3.0 - after - 0.1) / 0.08;
        assert!(
            (later as f64 - expected).abs() < 4.0,
            "{later}, not {expected}"
        );
        let counts = live.stream_counts();
        assert_eq!((counts.inferred_gaps, counts.gaps), (1, 0));
        assert!(
            (counts.unreported_gap_s - 7.3e-3).abs() < 1e-5,
            "{counts:?}"
        );
        assert!(counts.taken_s < 2.0, "{counts:?}");
    }
}
