//! Faults of time stamps in a live drive: each is rejected or compensated, and reported, and the
//! pose stays correct.

use std::f64::consts::PI;

use onboard::geometry::Pose;
use onboard::live::{AngleObservation, LiveError, Reason, State, TimeDefect};
use onboard::observation::{MeasurementKind, OdometrySample};
use onboard::settings::{Platform, Shipped, Site, TomlFile, Vehicle};
use onboard::{Custom, Live};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

const PERIOD_S: f64 = 0.02;
const SPEED_MPS: f64 = 1.5;
const SIGMA_RAD: f64 = 0.03;
const HEADS: [(u16, [f64; 3]); 4] = [
    (1, [-20.0, 12.0, 5.0]),
    (2, [20.0, -10.0, 5.0]),
    (3, [60.0, 14.0, 5.0]),
    (4, [100.0, -9.0, 5.0]),
];

/// A vehicle that drives along a straight road, with its odometry at 50 Hz and two angles every 0.1 s.
struct Drive {
    live: Live,
    random: ChaCha8Rng,
    step: u32,
    /// Error of the odometry's clock, in seconds.
    odometry_clock_s: f64,
    /// Error of the angles' clock, in seconds.
    angle_clock_s: f64,
    distance_offset_m: f64,
    /// Whether the error exceeded the protection level in state `ok`.
    misled: bool,
}

fn new_live(start: Option<Pose>) -> Live {
    let head = |(pci, position): &(u16, [f64; 3])| {
        format!("[[radio_heads]]\npci = {pci}\nposition_m = {position:?}\n")
    };
    let heads: Vec<String> = HEADS.iter().map(head).collect();
    let lane =
        "name = \"lane\"\n[road]\nwidth_m = 4.0\npolyline_m = [[-30.0, 0.0], [120.0, 0.0]]\n";
    let site = lane.to_owned() + &heads.concat();
    let vehicle = "name = \"cart\"\n[odometer]\nscale_std = 0.003\nnoise_m_per_sqrt_m = 0.01\n\
                   [wake_up]\npolicy = \"fixed\"\ninterval_ms = 1.0\n";
    let site = Site::from_toml(&site, "site", &Shipped).unwrap();
    let vehicle = Vehicle::from_toml(vehicle, "vehicle", &Shipped).unwrap();
    let platform = Platform::from_library(&vehicle.platform.name, &Shipped).unwrap();
    Live::new(&site, &vehicle, &platform, start, None, Custom::default()).unwrap()
}

impl Drive {
    fn new() -> Self {
        Self {
            live: new_live(Some(Pose::default())),
            random: ChaCha8Rng::seed_from_u64(7),
            step: 0,
            odometry_clock_s: 0.0,
            angle_clock_s: 0.0,
            distance_offset_m: 0.0,
            misled: false,
        }
    }

    fn now_s(&self) -> f64 {
        f64::from(self.step) * PERIOD_S
    }

    fn truth_m(&self) -> f64 {
        SPEED_MPS * self.now_s()
    }

    fn sample(&self) -> OdometrySample {
        OdometrySample {
            time_s: self.now_s() + self.odometry_clock_s,
            distance_m: self.truth_m() + self.distance_offset_m,
            speed_mps: SPEED_MPS,
            yaw_rate_radps: None,
        }
    }

    fn odometry(&mut self) -> Result<(), LiveError> {
        self.live.set_arrival(Some(self.now_s()));
        let sample = self.sample();
        self.live.odometry(&sample).map(drop)
    }

    fn angles(&mut self) -> Result<(), LiveError> {
        let x_m = self.truth_m();
        let mut near = HEADS;
        near.sort_by(|(_, a), (_, b)| (a[0] - x_m).abs().total_cmp(&(b[0] - x_m).abs()));
        for (pci, [head_x_m, head_y_m, head_z_m]) in near.into_iter().take(2) {
            let forward_m = head_x_m - x_m;
            let range_m = forward_m.hypot(head_y_m).hypot(head_z_m);
            let noise: f64 = self.random.sample(StandardNormal);
            self.live.angle(&AngleObservation {
                kind: MeasurementKind::Angle,
                pci,
                ssb_index: 0,
                time_s: self.now_s() + self.angle_clock_s,
                phase_rad: PI * forward_m / range_m + SIGMA_RAD * noise,
                sigma_rad: SIGMA_RAD,
                snr_db: None,
                resolved: true,
            })?;
        }
        Ok(())
    }

    /// Drives on, and returns the errors of odometry and angles.
    fn drive(&mut self, duration_s: f64) -> Vec<LiveError> {
        let mut errors = Vec::new();
        for _ in 0..(duration_s / PERIOD_S).round() as u32 {
            self.step += 1;
            errors.extend(self.odometry().err());
            if self.step.is_multiple_of(5) {
                errors.extend(self.angles().err());
            }
            let (state, error_m, level_m) = self.status();
            self.misled |= state == State::Ok && error_m > level_m;
        }
        errors
    }

    /// Returns the state, the position error and the protection level.
    fn status(&self) -> (State, f64, f64) {
        let status = self
            .live
            .status(self.now_s() + self.odometry_clock_s)
            .unwrap();
        let pose = status.pose.unwrap_or_default();
        let error_m = (pose.x_m - self.truth_m()).hypot(pose.y_m);
        let level_m = status.protection_level_m.unwrap_or(f64::INFINITY);
        (status.state, error_m, level_m)
    }

    fn reason(&self) -> Reason {
        self.live
            .status(self.now_s() + self.odometry_clock_s)
            .unwrap()
            .reason
    }

    /// Asserts that the pose is correct and `ok`, and that no wrong pose was `ok`.
    fn assert_fine(&self) {
        let (state, error_m, level_m) = self.status();
        assert_eq!(state, State::Ok, "{}", self.reason());
        assert!(error_m < level_m.min(1.0), "{error_m} {level_m}");
        assert!(!self.misled);
    }
}

#[test]
fn a_given_start_is_ok_after_confirmation_by_angles() {
    let mut drive = Drive::new();
    drive.odometry().unwrap();
    assert_eq!(drive.reason(), Reason::Unconfirmed);
    assert_eq!(drive.status().0, State::Unavailable);
    assert!(drive.drive(1.0).is_empty());
    assert_ne!(drive.reason(), Reason::Unconfirmed);
    // The start is confirmed at once. The protection level of a start with a standard deviation of
    // 0.5 m falls below the alert limit after more angles.
    assert!(drive.drive(4.0).is_empty());
    drive.assert_fine();
    // A wrong start is never confirmed.
    let mut drive = Drive::new();
    let elsewhere = Pose {
        x_m: 25.0,
        ..Pose::default()
    };
    drive.live = new_live(Some(elsewhere));
    drive.drive(3.0);
    assert!(!drive.misled);
}

#[test]
fn one_implausible_odometry_message_is_rejected_and_harmless() {
    let mut drive = Drive::new();
    assert!(drive.drive(5.0).is_empty());
    let before = drive.live.status(drive.now_s()).unwrap();
    let good = drive.sample();
    for (time_s, name) in [
        (good.time_s + 2.02, "time in the future"),
        (1e300, "time out of range"),
        (f64::NAN, "time not finite"),
        (good.time_s, "time repeated"),
        (good.time_s - 0.01, "time backward"),
        (0.0, "time backward"),
        (1.7e12, "time out of range"),
    ] {
        let sample = OdometrySample { time_s, ..good };
        let error = drive.live.odometry(&sample).unwrap_err();
        assert_eq!(error.cause(), name, "{error}");
        assert_eq!(drive.live.status(good.time_s).unwrap(), before);
        // The next good message is accepted.
    }
    for _ in 0..1000 {
        let error = drive.live.odometry(&good).unwrap_err();
        assert!(matches!(
            error,
            LiveError::Time {
                defect: TimeDefect::Repeated { is_copy: true, .. },
                ..
            }
        ));
    }
    assert_eq!(drive.live.status(good.time_s).unwrap(), before);
    assert!(drive.drive(3.0).is_empty());
    assert_eq!(drive.live.take_odometry_step(), None);
    drive.assert_fine();
}

#[test]
fn a_step_of_the_odometry_clock_resumes_the_pose() {
    for step_s in [-5.0, 60.0, -1.7e9, 0.0 - 0.3] {
        let mut drive = Drive::new();
        assert!(drive.drive(5.0).is_empty());
        drive.odometry_clock_s = step_s;
        let errors = drive.drive(0.4);
        assert!(
            (4..20).contains(&errors.len()),
            "{step_s}: {}",
            errors.len()
        );
        let step = drive.live.take_odometry_step().unwrap();
        assert!((step.step_s - step_s).abs() < 1e-6, "{step:?}");
        // The previous pose is resumed with the new time, and has to be confirmed.
        let (_, error_m, level_m) = drive.status();
        assert!(error_m < 1.0, "{step_s}: {error_m} {level_m}");
        assert!(drive.drive(3.0).is_empty());
        drive.assert_fine();
        // The clock steps back.
        drive.odometry_clock_s = 0.0;
        drive.drive(4.0);
        drive.assert_fine();
    }
}

#[test]
fn steps_of_both_clocks_or_of_the_angle_clock_are_compensated() {
    for (odometry_s, angles_s) in [(-5.0, -5.0), (60.0, 60.0), (0.0, -5.0), (0.0, 60.0)] {
        let mut drive = Drive::new();
        assert!(drive.drive(5.0).is_empty());
        (drive.odometry_clock_s, drive.angle_clock_s) = (odometry_s, angles_s);
        drive.drive(2.0);
        assert!(
            drive.live.take_angle_step().is_some(),
            "{odometry_s} {angles_s}"
        );
        assert!(drive.drive(3.0).is_empty());
        drive.assert_fine();
    }
}

#[test]
fn a_restarted_source_counts_time_and_distance_from_zero() {
    let mut drive = Drive::new();
    assert!(drive.drive(10.0).is_empty());
    drive.odometry_clock_s = -drive.now_s();
    drive.distance_offset_m = -drive.truth_m();
    drive.drive(4.0);
    drive.assert_fine();
}

#[test]
fn clocks_that_differ_at_the_start_are_reported_and_the_pose_is_not_localized() {
    for offset_s in [60.0, -60.0, 3.0] {
        let mut drive = Drive::new();
        drive.odometry_clock_s = offset_s;
        drive.drive(2.0);
        let found_s = drive.live.clock_disagreement_s().unwrap();
        assert!((found_s + offset_s).abs() < 0.1, "{found_s}");
        assert!(matches!(drive.reason(), Reason::ClocksDisagree { .. }));
        for _ in 0..200 {
            drive.drive(0.1);
            assert!(!drive.status().0.is_localized());
        }
        // The clock is set to another time.
        drive.odometry_clock_s = 0.0;
        drive.drive(4.0);
        assert!(!drive.misled);
    }
}

#[test]
fn wrong_units_are_reported() {
    for (factor, unit) in [
        (1e3, "milliseconds"),
        (1e6, "microseconds"),
        (1e9, "nanoseconds"),
    ] {
        let mut drive = Drive::new();
        let mut named = false;
        for _ in 0..50 {
            drive.step += 1;
            drive.live.set_arrival(Some(drive.now_s()));
            let mut sample = drive.sample();
            sample.time_s *= factor;
            if let Err(error) = drive.live.odometry(&sample) {
                named |= error.to_string().contains(unit);
            }
        }
        assert!(named, "{unit}");
    }
}

#[test]
fn angles_ahead_of_the_odometry_or_received_twice_are_rejected() {
    let mut drive = Drive::new();
    assert!(drive.drive(5.0).is_empty());
    let before = drive.live.status(drive.now_s()).unwrap();
    for time_s in [drive.now_s() + 2.0, 1e300, f64::NAN, -1e300] {
        let angle = AngleObservation {
            kind: MeasurementKind::Angle,
            pci: 1,
            ssb_index: 0,
            time_s,
            phase_rad: 0.1,
            sigma_rad: SIGMA_RAD,
            snr_db: None,
            resolved: true,
        };
        assert!(drive.live.angle(&angle).is_err(), "{time_s}");
    }
    assert_eq!(drive.live.status(drive.now_s()).unwrap(), before);
    // The angle is received twice in its burst, and again after it.
    let angle = AngleObservation {
        kind: MeasurementKind::Angle,
        pci: 2,
        ssb_index: 0,
        time_s: drive.now_s() + 0.01,
        phase_rad: 0.1,
        sigma_rad: SIGMA_RAD,
        snr_db: None,
        resolved: true,
    };
    drive.live.angle(&angle).unwrap();
    let again = drive.live.angle(&angle);
    assert!(matches!(again, Err(LiveError::AngleRepeated { pci: 2 })));
    drive.live.flush().unwrap();
    let again = drive.live.angle(&angle);
    assert!(matches!(again, Err(LiveError::AngleRepeated { pci: 2 })));
}

#[test]
fn a_gap_of_all_messages_adds_the_odometry_error_of_the_driven_distance() {
    for gap_s in [1.0, 8.0, 20.0] {
        let mut drive = Drive::new();
        assert!(drive.drive(10.0).is_empty());
        let (_, _, before_m) = drive.status();
        drive.step += (gap_s / PERIOD_S) as u32;
        drive.step += 1;
        drive.odometry().unwrap();
        let (_, error_m, after_m) = drive.status();
        assert!(error_m < after_m, "{error_m} {after_m}");
        // The odometer's scale is known to 0.3 % or better; a level is 5.3 standard deviations, with slip as a fault.
        let distance_m = SPEED_MPS * gap_s;
        println!("{gap_s} s: {before_m} -> {after_m}");
        assert!(
            after_m < before_m + 0.1 * distance_m + 0.5,
            "{gap_s}: {before_m} {after_m}"
        );
        drive.drive(3.0);
        drive.assert_fine();
    }
}

#[test]
fn a_saved_state_is_resumed_and_requires_confirmation() {
    for (down_s, has_counter) in [(1.0, true), (1.0, false), (60.0, true)] {
        let mut drive = Drive::new();
        assert!(drive.drive(20.0).is_empty());
        let saved = drive.live.saved_state().unwrap().unwrap();
        // A new program at the configured start, 30 m away.
        drive.step += (down_s / PERIOD_S) as u32;
        if !has_counter {
            drive.distance_offset_m = -drive.truth_m();
        }
        drive.live = new_live(Some(Pose::default()));
        let first = drive.sample();
        let by = drive.live.resume(&saved, down_s, &first).unwrap();
        let Some(by) = by else {
            assert_eq!(down_s, 60.0);
            continue;
        };
        assert_eq!(by.driven_m.is_some(), has_counter);
        drive.odometry().unwrap();
        assert_eq!(drive.reason(), Reason::Unconfirmed);
        let status = drive.live.status(drive.now_s()).unwrap();
        let [[variance, ..], ..] = status.covariance.unwrap();
        let error_m = status.pose.unwrap().x_m - drive.truth_m();
        assert!(
            error_m.abs() < 3.0 * variance.sqrt(),
            "{error_m} {variance}"
        );
        // The standard deviation of the position is 1 m or more at first.
        drive.drive(15.0);
        drive.assert_fine();
    }
}

#[test]
fn without_a_pose_no_state_is_saved() {
    let mut live = new_live(None);
    assert_eq!(live.saved_state().unwrap(), None);
    live.odometry(&OdometrySample::of_speed(0.0, 1.0, None))
        .unwrap();
    assert_eq!(live.saved_state().unwrap(), None);
}
