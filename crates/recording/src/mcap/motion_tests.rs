//! Each variant of filling odometry messages gives the motion of the vehicle or is reported.

use super::motion::{Filled, Motion, Reading, motion};

const STEP_S: f64 = 0.05;
/// Tolerance of a speed: above the maximum difference to the mean over a step at 1 m/s² and 20 Hz.
const SPEED_TOLERANCE_MPS: f64 = 0.06;

/// Simulates a drive: ahead, along a bend, stop, and reverse along another bend. Returns distances
/// (m) and correct messages.
fn driven() -> (Vec<f64>, Vec<Reading>) {
    let (mut x_m, mut y_m, mut heading_rad, mut distance_m) = (3.0, -2.0, 0.4, 0.0);
    let mut last_mps = 0.0_f64;
    let rows = (0..800).map(|k| {
        let time_s = STEP_S * f64::from(k);
        let wanted_mps = match k {
            0..20 | 380..420 => 0.0,
            20..380 => 1.0,
            _ => -0.6,
        };
        let speed_mps = last_mps + (wanted_mps - last_mps).clamp(-STEP_S, STEP_S);
        let turn_radps = match k {
            100..200 => 0.5,
            500..600 => -0.4,
            _ => 0.0,
        };
        let step_m = 0.5 * (last_mps + speed_mps) * if k == 0 { 0.0 } else { STEP_S };
        let turn_rad = if k == 0 { 0.0 } else { turn_radps * STEP_S };
        let middle_rad: f64 = heading_rad + 0.5 * turn_rad;
        // Chord of the arc.
        let half_rad = 0.5 * turn_rad;
        let chord_m = if half_rad == 0.0 {
            step_m
        } else {
            step_m * half_rad.sin() / half_rad
        };
        x_m += chord_m * middle_rad.cos();
        y_m += chord_m * middle_rad.sin();
        heading_rad += turn_rad;
        distance_m += step_m;
        last_mps = speed_mps;
        let reading = Reading {
            time_s: 1.7e9 + time_s,
            position_m: [x_m, y_m],
            heading_rad: Some(heading_rad),
            linear_mps: [speed_mps, 0.0],
            yaw_rate_radps: Some(turn_radps),
        };
        (distance_m, reading)
    });
    rows.unzip()
}

/// Returns the motion of the drive after a change of each message.
fn found(change: impl Fn(usize, &mut Reading)) -> Motion {
    let (_, mut readings) = driven();
    for (k, reading) in readings.iter_mut().enumerate() {
        change(k, reading);
    }
    motion(&readings, Filled::new(readings.iter()))
}

/// Asserts that distances (m) and speeds equal those of the drive.
fn assert_right(motion: &Motion, tolerance_m: f64, what: &str) {
    let (distances_m, readings) = driven();
    for (k, (found, given)) in motion.distances_m.iter().zip(&distances_m).enumerate() {
        assert!(
            (found - given).abs() < tolerance_m,
            "{what}: {found} m is {given} m at {k}"
        );
    }
    for (k, (found, given)) in motion.speeds_mps.iter().zip(&readings).enumerate() {
        let given = given.linear_mps[0];
        assert!(
            (found - given).abs() < SPEED_TOLERANCE_MPS,
            "{what}: {found} m/s is {given} m/s at {k}"
        );
    }
    assert_eq!(motion.distances_m.len(), readings.len());
    assert_eq!(motion.speeds_mps.len(), readings.len());
}

fn assert_remark(motion: &Motion, expected: &str) {
    let remarks: Vec<&String> = motion.notes.iter().chain(&motion.warnings).collect();
    assert!(
        remarks.iter().any(|it| it.contains(expected)),
        "{expected}: {remarks:?}"
    );
}

#[test]
fn correctly_filled_messages_are_not_reported() {
    let motion = found(|_, _| {});
    // Relative difference of chord and arc: square of half the turn in a step, divided by six.
    assert_right(&motion, 2e-3, "right");
    assert!(motion.notes.is_empty() && motion.warnings.is_empty() && motion.jumps.is_empty());
    let (_, readings) = driven();
    let given = readings.iter().map(|it| it.linear_mps[0]);
    assert!(
        motion.speeds_mps.iter().copied().eq(given),
        "the speeds are those of the twist"
    );
}

#[test]
fn a_twist_without_a_sign_gets_the_sign_of_the_pose() {
    let motion = found(|_, it| it.linear_mps[0] = it.linear_mps[0].abs());
    assert_right(&motion, 2e-3, "unsigned");
    assert_remark(&motion, "twist.twist.linear.x has the wrong sign");
    let motion = found(|_, it| it.linear_mps[0] = -it.linear_mps[0]);
    assert_right(&motion, 2e-3, "opposite sign");
    assert_remark(&motion, "twist.twist.linear.x has the wrong sign");
}

#[test]
fn a_twist_in_the_frame_of_the_pose_is_rotated() {
    let turned_by = |more_rad: f64| {
        found(move |_, it| {
            let heading_rad = it.heading_rad.unwrap() + more_rad;
            let (sin, cos) = heading_rad.sin_cos();
            let speed_mps = it.linear_mps[0];
            it.heading_rad = Some(heading_rad);
            it.linear_mps = [speed_mps * cos, speed_mps * sin];
            let [x, y] = it.position_m;
            let (sin, cos) = more_rad.sin_cos();
            it.position_m = [cos * x - sin * y, sin * x + cos * y];
        })
    };
    for more_rad in [0.0, 1.2, 2.7, -1.9] {
        let motion = turned_by(more_rad);
        assert_right(&motion, 2e-3, "of the map");
        assert_remark(&motion, "twist.twist.linear is in the frame of the pose");
    }
}

#[test]
fn speeds_are_derived_from_poses_and_distances_from_twists() {
    let motion = found(|_, it| it.linear_mps = [0.0, 0.0]);
    assert_right(&motion, 2e-3, "pose alone");
    assert_remark(&motion, "twist.twist.linear.x is not filled");
    let motion = found(|_, it| it.linear_mps = [f64::NAN; 2]);
    assert_right(&motion, 2e-3, "pose alone, twist not a number");
    for place in [[0.0; 2], [7.0, 5.0], [f64::NAN; 2]] {
        let motion = found(|_, it| (it.position_m, it.heading_rad) = (place, Some(0.0)));
        assert_right(&motion, 2e-3, "twist alone");
        assert_remark(&motion, "pose.pose.position never changes");
        assert!(!motion.has_both);
    }
    let motion = found(|k, it| it.position_m = if k == 99 { [500.0, 0.0] } else { [0.0; 2] });
    assert_right(&motion, 2e-3, "twist alone, one position elsewhere");
    let motion = found(|_, it| {
        let (sin, cos) = it.heading_rad.unwrap().sin_cos();
        it.position_m = [0.0; 2];
        it.linear_mps = [it.linear_mps[0] * cos, it.linear_mps[0] * sin];
    });
    assert_right(&motion, 2e-3, "twist alone, of the map");
}

#[test]
fn single_invalid_values_are_ignored() {
    let motion = found(|k, it| {
        if k % 50 == 7 {
            it.linear_mps[0] = f64::NAN;
        }
        it.linear_mps[1] = f64::NAN;
    });
    assert_right(&motion, 2e-3, "speeds missing");
    assert_remark(&motion, "not finite in 16 messages");
    let motion = found(|k, it| {
        if k % 3 == 1 {
            it.heading_rad = None;
        }
    });
    // With the heading of one end only, the direction is wrong by half of the turn in the step.
    assert_right(&motion, 1e-2, "headings missing");
}

#[test]
fn without_an_orientation_the_twist_gives_the_sign() {
    let motion = found(|_, it| it.heading_rad = None);
    assert_right(&motion, 2e-3, "no orientation");
    for heading_rad in [0.0, 1.5, -2.5] {
        let motion = found(|_, it| it.heading_rad = Some(heading_rad));
        assert_right(&motion, 2e-3, "constant orientation");
        assert_remark(&motion, "does not move along the heading");
    }
    let motion = found(|_, it| it.heading_rad = it.heading_rad.map(|it| it + 1.57));
    assert_right(&motion, 2e-3, "orientation off by a quarter of a turn");
}

/// An unfilled orientation has a heading of 0, which may resemble a road along x.
#[test]
fn a_constant_orientation_on_a_winding_road_is_not_used() {
    let step = |k: i32| {
        let x_m = 0.05 * f64::from(k);
        Reading {
            time_s: f64::from(k),
            position_m: [x_m, 0.3 * x_m.sin()],
            heading_rad: Some(0.0),
            linear_mps: [0.05, 0.0],
            yaw_rate_radps: None,
        }
    };
    let readings: Vec<Reading> = (0..1000).map(step).collect();
    let motion = motion(&readings, Filled::new(readings.iter()));
    assert_remark(&motion, "does not move along the heading");
    // Length of a sine: mean of the root of 1 + 0.09 cos², approximately 1 + 0.09/4 − 3 · 0.09²/64.
    let length_m = motion.distances_m.last().unwrap() / (0.05 * 999.0);
    assert!(
        (length_m - (1.0 + 0.09 / 4.0 - 0.09 * 0.09 * 3.0 / 64.0)).abs() < 1e-3,
        "{length_m}"
    );
    assert!(!motion.is_straight);
}

#[test]
fn lateral_motion_is_reported() {
    // The vehicle slides sideways at 0.5 m/s for 5 s.
    let motion = found(|k, it| {
        // Heading after the first bend.
        let (sin, cos) = 2.9_f64.sin_cos();
        let side_m = 0.5 * STEP_S * (k.clamp(300, 400) - 300) as f64;
        it.position_m[0] -= sin * side_m;
        it.position_m[1] += cos * side_m;
        if (300..400).contains(&k) {
            it.linear_mps[1] = 0.5;
        }
    });
    assert_right(&motion, 5e-2, "sideways");
    assert_remark(&motion, "across the heading");
    assert_remark(&motion, "twist.twist.linear.y is not 0");
}

#[test]
fn a_pose_in_front_of_the_axle_gives_equal_distances() {
    let motion = found(|_, it| {
        let (sin, cos) = it.heading_rad.unwrap().sin_cos();
        it.position_m[0] += 0.8 * cos;
        it.position_m[1] += 0.8 * sin;
    });
    // In a bend, the point moves on an arc with a lateral component. The chord deviates forward by
    // 0.8 m · (turn in a step)² / 2.
    assert_right(&motion, 2e-2, "lever arm");
}

#[test]
fn jumps_of_the_pose_do_not_change_the_speed() {
    let resets = |no_twist: bool| {
        found(move |k, it| {
            if no_twist {
                it.linear_mps = [0.0; 2];
            }
            if k >= 250 {
                it.position_m = [it.position_m[0] - 9.0, it.position_m[1] - 9.0];
            }
            if k == 320 {
                it.position_m[0] += 70.0;
            }
        })
    };
    let motion = resets(true);
    assert_right(&motion, 2e-3, "reset");
    assert_eq!(motion.jumps.len(), 3);
    // A separate speed does not change the distances.
    let motion = resets(false);
    assert_right(&motion, 2e-3, "reset with twist");
    assert_eq!(motion.jumps.len(), 3);
}

#[test]
fn a_stationary_vehicle_has_no_motion() {
    let motion = found(|_, it| (it.position_m, it.linear_mps) = ([5.0, 6.0], [0.0; 2]));
    assert!(
        motion
            .distances_m
            .iter()
            .chain(&motion.speeds_mps)
            .all(|it| *it == 0.0)
    );
    let none = motion_of_none();
    assert!(none.distances_m.is_empty() && none.speeds_mps.is_empty());
}

fn motion_of_none() -> Motion {
    motion(&[], Filled::new([].iter()))
}
