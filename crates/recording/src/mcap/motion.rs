//! Distance and speed from the poses and twists of `nav_msgs/msg/Odometry`.
//!
//! A step of the position counts with its component along the heading of the messages, which is
//! negative in reverse. Drivers fill these messages differently: only the pose, only the twist, a
//! twist in the frame of the pose, or a twist without a sign. The available quantities are
//! determined from the file and reported.

use onboard::geometry::wrap_angle;

use crate::counter_jumps::{Jump, replace_jumps};
use crate::odometry::OdometryFields;

/// Maximum coordinate of a position (m), larger than in any map projection.
pub const MAX_COORDINATE_M: f64 = 1e8;
/// Minimum change of position (m) that counts as motion.
const STANDING_M: f64 = 1e-6;
/// Maximum number of steps caused by a single wrong position; more steps are motion.
const MAX_SPIKE_STEPS: usize = 2;
/// Maximum speed of a step (m/s). A faster step is a jump of the position, which is not used to
/// judge heading and twist.
const MAX_SPEED_MPS: f64 = 50.0;
/// Maximum fraction of the squared steps across the heading (33° RMS); above it, the heading is not
/// the direction of motion.
const MAX_ACROSS: f64 = 0.3;
/// Maximum fraction of the squared steps across a constant heading (1.8° RMS); above it, the
/// heading is not filled.
const MAX_ACROSS_CONSTANT: f64 = 1e-3;
/// Maximum change of a constant heading (rad).
const CONSTANT_RAD: f64 = 1e-6;
/// Minimum fraction of the squared steps across the heading that is reported (8° RMS).
const REPORTED_ACROSS: f64 = 0.02;
/// Minimum path length (m) of a contradiction.
const MIN_PATH_M: f64 = 0.3;
/// Minimum fraction of the path of a contradiction.
const MIN_SHARE: f64 = 0.02;

const POSITION: &str = OdometryFields::ROS.distance;
const SPEED: &str = OdometryFields::ROS.speed;

/// Quantities used from one `nav_msgs/msg/Odometry` message.
#[derive(Debug, Clone, Copy)]
pub struct Reading {
    pub time_s: f64,
    /// Position x and y (m).
    pub position_m: [f64; 2],
    /// Yaw of the orientation (rad); `None` if it is not a unit quaternion.
    pub heading_rad: Option<f64>,
    /// Linear velocity x and y (m/s).
    pub linear_mps: [f64; 2],
    /// Yaw rate (rad/s); `None` if it is marked as unknown.
    pub yaw_rate_radps: Option<f64>,
}

/// Quantities that a file contains.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Filled {
    /// Whether the position changes.
    pub position: bool,
    /// Whether the linear velocity is ever nonzero.
    pub twist: bool,
}

impl Filled {
    /// Determines the quantities from all messages of a topic.
    pub fn new<'a>(readings: impl Iterator<Item = &'a Reading> + Clone) -> Self {
        let is_position = |it: &&Reading| {
            it.position_m
                .iter()
                .all(|value| value.abs() <= MAX_COORDINATE_M)
        };
        let places = readings.clone().filter(is_position).map(|it| it.position_m);
        let mut last = None;
        let is_step = |place: [f64; 2]| {
            let before = last.replace(place);
            before.is_some_and(|before| distance_m(before, place) > STANDING_M)
        };
        let steps = places.map(is_step).filter(|it| *it).count();
        let mut speeds = readings.flat_map(|it| it.linear_mps);
        Self {
            position: steps > MAX_SPIKE_STEPS,
            twist: speeds.any(|it| it.is_finite() && it != 0.0),
        }
    }

    /// Returns the values that must be finite for a usable message, with their fields.
    pub fn required(self, reading: &Reading) -> Vec<(&'static str, f64)> {
        let [x_m, y_m] = reading.position_m;
        let mut values = Vec::with_capacity(3);
        if self.position {
            values.extend([("pose.pose.position.x", x_m), ("pose.pose.position.y", y_m)]);
        } else if self.twist {
            values.push((SPEED, reading.linear_mps[0]));
        }
        values
    }
}

/// Distances and speeds, one per message.
#[derive(Debug, Clone, Default)]
pub struct Motion {
    pub distances_m: Vec<f64>,
    pub speeds_mps: Vec<f64>,
    /// Properties of the file as sentences.
    pub notes: Vec<String>,
    /// Properties of the file that may cause a position error, as sentences.
    pub warnings: Vec<String>,
    /// Whether the position moves along a constant heading.
    pub is_straight: bool,
    /// Replaced steps of the distance.
    pub jumps: Vec<Jump>,
    /// Whether distance and speed are from different fields.
    pub has_both: bool,
}

/// Computes distance and speed from usable messages with strictly increasing times.
pub fn motion(readings: &[Reading], filled: Filled) -> Motion {
    if filled.position {
        Path::new(readings).motion(filled.twist)
    } else {
        of_twist(readings, filled.twist)
    }
}

/// Computes the motion from messages whose position is constant.
fn of_twist(readings: &[Reading], is_filled: bool) -> Motion {
    if !is_filled {
        let zeros = vec![0.0; readings.len()];
        let doubt = format!(
            "the vehicle does not move: {POSITION} never changes by more than {STANDING_M} m, and {SPEED} is always 0 or \
             not finite; one of them must be filled, in m or m/s"
        );
        return Motion {
            distances_m: zeros.clone(),
            speeds_mps: zeros,
            warnings: vec![doubt],
            ..Motion::default()
        };
    }
    let mut notes = vec![format!(
        "{POSITION} never changes; the distance is taken from {SPEED}"
    )];
    let mut warnings = Vec::new();
    // Compare the motion across the vehicle for a velocity in the vehicle's frame and in the frame
    // of the pose.
    let steps = || {
        readings
            .windows(2)
            .filter_map(|pair| <&[Reading; 2]>::try_from(pair).ok())
    };
    let across_m = |across_mps: fn(&Reading) -> f64| -> f64 {
        let across = steps().map(|[a, b]| across_mps(b).abs() * (b.time_s - a.time_s));
        across.filter(|it| it.is_finite()).sum()
    };
    let own_m = across_m(|it| it.linear_mps[1]);
    let map_m = across_m(|it| it.in_vehicle(it.linear_mps)[1]);
    let along_m = across_m(|it| it.linear_mps[0]);
    let is_of_map = is_contradiction(own_m, along_m + own_m) && map_m < 0.5 * own_m;
    if is_of_map {
        notes.push(twist_in_map());
    } else if is_contradiction(own_m, along_m) {
        warnings.push(linear_y(own_m));
    }
    let speed = |it: &Reading| {
        if is_of_map {
            it.in_vehicle(it.linear_mps)[0]
        } else {
            it.linear_mps[0]
        }
    };
    let speeds_mps: Vec<f64> = readings.iter().map(speed).collect();
    let mut distance_m = 0.0;
    let mut distances_m = vec![distance_m; readings.len().min(1)];
    for ([a, b], speeds) in steps().zip(speeds_mps.windows(2)) {
        distance_m += 0.5 * speeds.iter().sum::<f64>() * (b.time_s - a.time_s);
        distances_m.push(distance_m);
    }
    Motion {
        distances_m,
        speeds_mps,
        notes,
        warnings,
        ..Motion::default()
    }
}

impl Reading {
    /// Transforms a vector from the frame of the pose to the vehicle: forward and left components.
    /// Without a heading, the vector is unchanged.
    fn in_vehicle(&self, vector: [f64; 2]) -> [f64; 2] {
        rotated(vector, self.heading_rad.unwrap_or(0.0))
    }
}

/// Step between two messages.
#[derive(Debug, Clone, Copy)]
struct Step {
    duration_s: f64,
    /// Change of the position (m).
    change_m: [f64; 2],
    length_m: f64,
    /// Change of position in forward and left direction (m); `None` without a heading.
    in_vehicle_m: Option<[f64; 2]>,
    /// Mean linear velocity of both messages (m/s).
    linear_mps: [f64; 2],
    /// Whether the position jumps; such a step is not used to judge heading and twist.
    jumps: bool,
}

impl Step {
    fn new(from: &Reading, to: &Reading) -> Self {
        let duration_s = to.time_s - from.time_s;
        let [x0, y0] = from.position_m;
        let [x1, y1] = to.position_m;
        let change_m = [x1 - x0, y1 - y0];
        // The chord of an arc has the mean heading of its ends.
        let heading_rad = match (from.heading_rad, to.heading_rad) {
            (Some(before), Some(after)) => Some(before + 0.5 * wrap_angle(after - before)),
            (before, after) => after.or(before),
        };
        let length_m = change_m[0].hypot(change_m[1]);
        let mean = |a: f64, b: f64| match (a.is_finite(), b.is_finite()) {
            (true, true) => 0.5 * (a + b),
            (true, false) => a,
            _ => b,
        };
        let [vx0, vy0] = from.linear_mps;
        let [vx1, vy1] = to.linear_mps;
        Self {
            duration_s,
            change_m,
            length_m,
            in_vehicle_m: heading_rad.map(|heading_rad| rotated(change_m, heading_rad)),
            linear_mps: [mean(vx0, vx1), mean(vy0, vy1)],
            jumps: length_m > MAX_SPEED_MPS * duration_s,
        }
    }

    /// Returns velocity times duration (m).
    fn by_twist_m(&self) -> [f64; 2] {
        self.linear_mps.map(|it| it * self.duration_s)
    }
}

/// Interpretation of `twist.twist.linear`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum TwistMeaning {
    /// Velocity in the vehicle's frame (REP-147).
    OfVehicle,
    /// Velocity in the frame of the pose.
    OfMap,
    /// Speed without a sign.
    Unsigned,
    /// Not filled.
    Unfilled,
}

/// Messages with a changing position.
struct Path<'a> {
    readings: &'a [Reading],
    steps: Vec<Step>,
    /// Whether the position moves along the heading.
    follows_heading: bool,
    length_m: f64,
    notes: Vec<String>,
    warnings: Vec<String>,
}

impl<'a> Path<'a> {
    fn new(readings: &'a [Reading]) -> Self {
        let pairs = readings
            .windows(2)
            .filter_map(|pair| <&[Reading; 2]>::try_from(pair).ok());
        let steps: Vec<Step> = pairs.map(|[from, to]| Step::new(from, to)).collect();
        Self {
            readings,
            steps,
            follows_heading: false,
            length_m: 0.0,
            warnings: Vec::new(),
            notes: Vec::new(),
        }
    }

    fn motion(mut self, has_twist: bool) -> Motion {
        self.compare_heading();
        let meaning = if has_twist {
            self.twist_meaning()
        } else {
            TwistMeaning::Unfilled
        };
        let mut distances_m = self.distances_m(has_twist);
        let times_s: Vec<f64> = self.readings.iter().map(|it| it.time_s).collect();
        let jumps = replace_jumps(&times_s, &mut distances_m);
        if meaning == TwistMeaning::Unfilled {
            self.notes.push(format!(
                "{SPEED} is not filled; the speed is taken from {POSITION}"
            ));
        }
        let speeds_mps = self.speeds_mps(meaning, &distances_m);
        let known = || self.readings.iter().map(|it| it.heading_rad);
        let is_straight =
            self.follows_heading && self.length_m > MIN_PATH_M && known().all(|it| it.is_some());
        Motion {
            distances_m,
            speeds_mps,
            notes: self.notes,
            warnings: self.warnings,
            is_straight,
            jumps,
            has_both: has_twist,
        }
    }

    /// Returns the steps that are used to judge heading and twist.
    fn smooth(&self) -> impl Iterator<Item = &Step> {
        self.steps.iter().filter(|step| !step.jumps)
    }

    /// Determines whether the position moves along the heading of its messages.
    fn compare_heading(&mut self) {
        let known = || self.smooth().filter_map(|step| step.in_vehicle_m);
        let all2: f64 = self.smooth().map(|step| step.length_m.powi(2)).sum();
        let known2: f64 = known()
            .map(|[along, across]| along * along + across * across)
            .sum();
        let across2: f64 = known().map(|[_, across]| across * across).sum();
        if known2 < 0.5 * all2 || known2 == 0.0 {
            return; // no orientation
        }
        let explained2 = |step: &Step| {
            let [along, across] = step.in_vehicle_m?;
            let [by_x, by_y] = step.by_twist_m();
            Some((along - by_x).powi(2) + (across - by_y).powi(2))
        };
        let misfit2: f64 = self
            .smooth()
            .filter_map(explained2)
            .filter(|it| it.is_finite())
            .sum();
        let mut headings = self.readings.iter().filter_map(|it| it.heading_rad);
        let first_rad = headings.next().unwrap_or(0.0);
        let is_constant = headings.all(|it| wrap_angle(it - first_rad).abs() < CONSTANT_RAD);
        let max_across = if is_constant {
            MAX_ACROSS_CONSTANT
        } else {
            MAX_ACROSS
        };
        // A vehicle that really moves sideways also has a lateral velocity.
        let is_explained =
            self.smooth().any(|it| it.linear_mps[1] != 0.0) && misfit2 < MAX_ACROSS * across2;
        let across_m: f64 = known().map(|[_, across]| across.abs()).sum();
        let path_m: f64 = self.smooth().map(|step| step.length_m).sum();
        self.follows_heading = across2 < max_across * known2 || is_explained;
        self.length_m = path_m;
        if !self.follows_heading {
            self.warnings.push(format!(
                "{POSITION} does not move along the heading of pose.pose.orientation ({across_m:.1} m of {path_m:.1} m \
                 across it); the distance is the length of the path, backwards if {SPEED} is below 0; check whether \
                 pose.pose.orientation is filled and both are in one frame"
            ));
        } else if across2 > REPORTED_ACROSS * known2 && is_contradiction(across_m, path_m) {
            self.warnings.push(format!(
                "{POSITION} moves {across_m:.1} m of {path_m:.1} m across the heading of pose.pose.orientation; only the \
                 motion along the heading is used"
            ));
        }
    }

    /// Determines the interpretation of the twist by comparison with the steps of the position.
    fn twist_meaning(&mut self) -> TwistMeaning {
        if !self.follows_heading {
            return TwistMeaning::OfVehicle;
        }
        let path_m: f64 = self.smooth().map(|step| step.length_m).sum();
        let sum = |misfit_m: &dyn Fn(&Step, [f64; 2]) -> f64| -> f64 {
            let known = self
                .smooth()
                .filter_map(|step| Some(misfit_m(step, step.in_vehicle_m?)));
            known.filter(|it| it.is_finite()).sum()
        };
        let of_vehicle_m = sum(&|step, [along, _]| (step.by_twist_m()[0] - along).abs());
        let of_map_m = sum(&|step, _| distance_m(step.by_twist_m(), step.change_m));
        let unsigned_m = sum(&|step, [along, _]| {
            let [by_x, _] = step.by_twist_m();
            (by_x.abs() - along.abs()).abs()
        });
        let sideways_m = sum(&|step, _| step.by_twist_m()[1].abs());
        let against_m = sum(&|step, [along, _]| {
            let [by_x, _] = step.by_twist_m();
            if by_x * along < 0.0 { along.abs() } else { 0.0 }
        });
        let is_contradicted = is_contradiction(of_vehicle_m, path_m);
        let explains = |misfit_m: f64| is_contradicted && misfit_m < 0.5 * of_vehicle_m;
        if explains(of_map_m) && of_map_m <= unsigned_m + 0.1 * of_vehicle_m && sideways_m > 0.0 {
            self.notes.push(twist_in_map());
            TwistMeaning::OfMap
        } else if explains(unsigned_m) {
            self.notes.push(format!(
                "{SPEED} has the wrong sign for {against_m:.1} m: {POSITION} moves against the heading of \
                 pose.pose.orientation where {SPEED} is above 0, or along it where it is below; the sign of the position's \
                 motion is used"
            ));
            TwistMeaning::Unsigned
        } else {
            if is_contradiction(sideways_m, path_m) {
                self.warnings.push(linear_y(sideways_m));
            }
            TwistMeaning::OfVehicle
        }
    }

    /// Returns the distance driven at each message (m).
    fn distances_m(&self, has_twist: bool) -> Vec<f64> {
        let mut distance_m = 0.0;
        let mut distances_m = vec![distance_m; self.readings.len().min(1)];
        let ends = self.readings.iter().skip(1);
        for (step, to) in self.steps.iter().zip(ends) {
            distance_m += match step.in_vehicle_m {
                Some([along_m, _]) if self.follows_heading => along_m,
                _ if has_twist && to.linear_mps[0] < 0.0 => -step.length_m,
                _ => step.length_m,
            };
            distances_m.push(distance_m);
        }
        distances_m
    }

    /// Returns the speed at each message (m/s).
    fn speeds_mps(&mut self, meaning: TwistMeaning, distances_m: &[f64]) -> Vec<f64> {
        let driven = distances_m
            .windows(2)
            .zip(&self.steps)
            .map(|(pair, step)| match pair {
                [a, b] => (b - a) / step.duration_s,
                _ => 0.0,
            });
        let mut by_position: Vec<f64> = driven.collect();
        by_position.insert(0, by_position.first().copied().unwrap_or(0.0));
        let mut missing = 0;
        let mut last_sign = 1.0_f64;
        let all = self.readings.iter().zip(&by_position);
        let speeds = all.map(|(reading, &by_position)| {
            let [x_mps, _] = reading.linear_mps;
            if by_position != 0.0 {
                last_sign = by_position.signum();
            }
            let speed_mps = match meaning {
                TwistMeaning::OfVehicle => x_mps,
                TwistMeaning::OfMap => reading.in_vehicle(reading.linear_mps)[0],
                TwistMeaning::Unsigned => x_mps.abs() * last_sign,
                TwistMeaning::Unfilled => by_position,
            };
            if speed_mps.is_finite() {
                speed_mps
            } else {
                missing += 1;
                by_position
            }
        });
        let speeds_mps = speeds.collect();
        if missing > 0 {
            self.notes.push(format!(
                "{SPEED} is not finite in {missing} messages; the speed is taken from {POSITION} there"
            ));
        }
        speeds_mps
    }
}

/// Whether a part of a path is long enough for a contradiction.
fn is_contradiction(part_m: f64, path_m: f64) -> bool {
    part_m > MIN_PATH_M && part_m > MIN_SHARE * path_m
}

fn twist_in_map() -> String {
    format!(
        "twist.twist.linear is in the frame of the pose (header.frame_id) and not in that of the vehicle (child_frame_id); \
         its component along the heading of pose.pose.orientation is used in place of {SPEED}"
    )
}

fn linear_y(length_m: f64) -> String {
    format!(
        "twist.twist.linear.y is not 0, {length_m:.1} m altogether; only motion along the vehicle ({SPEED}) is used"
    )
}

fn distance_m([x0, y0]: [f64; 2], [x1, y1]: [f64; 2]) -> f64 {
    (x1 - x0).hypot(y1 - y0)
}

/// Rotates a vector into a frame with the given heading.
fn rotated([x, y]: [f64; 2], heading_rad: f64) -> [f64; 2] {
    let (sin, cos) = heading_rad.sin_cos();
    [cos * x + sin * y, cos * y - sin * x]
}
