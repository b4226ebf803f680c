//! Configuration hypotheses: common errors in the files of a drive, and their corrections.
//!
//! One table contains the hypotheses about the whole drive, about each radio head and about each
//! pair of radio heads.

use std::borrow::Cow;
use std::f64::consts::{FRAC_PI_2, PI};

use onboard::geometry::{Point, Pose};
use onboard::observation::OdometrySample;
use onboard::settings::{DriveKind, RadioHeadSettings, Site, Vehicle};

use crate::angle_log::LoggedAngle;
use crate::odometry::OdometryLog;

/// Log-likelihood penalty of a hypothesis with a free parameter: a fitted position may be anywhere
/// within 100 m and is determined to a few metres; a robot may turn arbitrarily.
pub const FREEDOM_LOG_ODDS: f64 = 8.0;

/// Drive with the given files or with corrected ones.
#[derive(Clone)]
pub struct Drive<'a> {
    pub site: Cow<'a, Site>,
    pub vehicle: Cow<'a, Vehicle>,
    pub odometry: Cow<'a, OdometryLog>,
    /// Angles in order of time; the electrical angle is NaN if the angle from the array's axis is
    /// given.
    pub angles: Cow<'a, [LoggedAngle]>,
}

/// Subject of a hypothesis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Subject {
    /// Whole drive.
    Drive,
    /// Start only.
    Start,
    /// One or two radio heads.
    RadioHeads,
}

/// Hypothesis about the configuration of a drive.
pub struct Hypothesis {
    /// Text after "the angles fit if …".
    pub text: String,
    /// Text after "check …".
    pub check: String,
    pub subject: Subject,
    /// Minimum log-likelihood advantage because of free parameters.
    pub penalty: f64,
    correction: Correction,
}

enum Correction {
    Angle(fn(&mut LoggedAngle, &Vehicle)),
    Odometry(fn(&mut OdometrySample)),
    /// Complete odometry.
    Log(Box<OdometryLog>),
    Heads(fn([f64; 3]) -> [f64; 3]),
    /// Position of the radio head with this index.
    Head(usize, [f64; 2]),
    /// Exchanged positions of the radio heads with these indices.
    Exchange(usize, usize),
    Mounting(f64),
    Vehicle(fn(&mut Vehicle)),
    Start(fn(&Site, Pose) -> Pose),
}

impl Hypothesis {
    fn new(text: impl Into<String>, check: impl Into<String>, correction: Correction) -> Self {
        let subject = match correction {
            Correction::Start(_) => Subject::Start,
            Correction::Head(..) | Correction::Exchange(..) => Subject::RadioHeads,
            _ => Subject::Drive,
        };
        Self {
            text: text.into(),
            check: check.into(),
            subject,
            penalty: 0.0,
            correction,
        }
    }

    /// Creates a hypothesis with a different odometry and its penalty.
    pub fn of_odometry(
        text: String,
        check: &'static str,
        penalty: f64,
        odometry: OdometryLog,
    ) -> Self {
        Self {
            penalty,
            ..Self::new(text, check, Correction::Log(Box::new(odometry)))
        }
    }

    /// Returns the corrected drive.
    pub fn correct<'a>(&self, given: &Drive<'a>) -> Drive<'a> {
        let mut drive = given.clone();
        match self.correction {
            Correction::Log(ref log) => drive.odometry = Cow::Owned(log.as_ref().clone()),
            Correction::Angle(text) => {
                let angles = drive.angles.to_mut().iter_mut();
                angles.for_each(|angle| text(angle, &given.vehicle));
            }
            Correction::Odometry(text) => {
                drive.odometry.to_mut().samples.iter_mut().for_each(text);
            }
            Correction::Heads(text) => {
                for head in &mut drive.site.to_mut().radio_heads {
                    head.position_m = text(head.position_m);
                }
            }
            Correction::Head(number, [x_m, y_m]) => {
                if let Some(head) = drive.site.to_mut().radio_heads.get_mut(number) {
                    let [_, _, z_m] = head.position_m;
                    head.position_m = [x_m, y_m, z_m];
                }
            }
            Correction::Exchange(one, other) => {
                let heads = &mut drive.site.to_mut().radio_heads;
                let place = |number: usize| given.site.radio_heads.get(number);
                for (number, from) in [(one, place(other)), (other, place(one))] {
                    if let (Some(head), Some(from)) = (heads.get_mut(number), from) {
                        head.position_m = from.position_m;
                        head.position_std_m = from.position_std_m;
                    }
                }
            }
            Correction::Mounting(by_rad) => drive.vehicle.to_mut().array.mounting_rad += by_rad,
            Correction::Vehicle(text) => text(drive.vehicle.to_mut()),
            Correction::Start(text) => {
                let start = &mut drive.vehicle.to_mut().start;
                start.pose = start.pose.map(|pose| text(&given.site, pose));
            }
        }
        drive
    }
}

/// Returns the name of a radio head: its PCI, and its SSB index if the PCI is ambiguous.
pub fn name_of(site: &Site, head: &RadioHeadSettings) -> String {
    let with_same_pci = site.radio_heads.iter().filter(|it| it.pci == head.pci);
    if with_same_pci.count() > 1 {
        format!("pci {} (ssb_index {})", head.pci, head.ssb_index)
    } else {
        format!("pci {}", head.pci)
    }
}

/// Returns the hypotheses about single radio heads and pairs of radio heads.
pub fn of_radio_heads(site: &Site) -> Vec<Hypothesis> {
    let mut hypotheses = Vec::new();
    for (number, head) in site.radio_heads.iter().enumerate() {
        let name = name_of(site, head);
        let [x_m, y_m, _] = head.position_m;
        let key = "radio_heads.position_m";
        let changes = [
            (
                format!("x and y of {name} are exchanged"),
                format!("the order in its {key}: x, y, height"),
                [y_m, x_m],
            ),
            (
                format!("x of {name} is mirrored"),
                format!("the sign of x in its {key}"),
                [-x_m, y_m],
            ),
            (
                format!("y of {name} is mirrored"),
                format!("the sign of y in its {key}"),
                [x_m, -y_m],
            ),
        ];
        for (text, check, place_m) in changes {
            if place_m != [x_m, y_m] {
                hypotheses.push(Hypothesis::new(
                    text,
                    check,
                    Correction::Head(number, place_m),
                ));
            }
        }
        for (other, with) in site.radio_heads.iter().enumerate().skip(number + 1) {
            let (mut one, mut two) = (head, with);
            if (one.pci, one.ssb_index) > (two.pci, two.ssb_index) {
                (one, two) = (two, one);
            }
            hypotheses.push(Hypothesis::new(
                format!(
                    "{} and {} are exchanged",
                    name_of(site, one),
                    name_of(site, two)
                ),
                "the assignment of pci and ssb_index to positions",
                Correction::Exchange(number, other),
            ));
        }
    }
    hypotheses
}

/// Returns the hypothesis that the radio head with index `number` is at another position.
pub fn moved(site: &Site, number: usize, place: Point) -> Option<Hypothesis> {
    let head = site.radio_heads.get(number)?;
    let [x_m, y_m, _] = head.position_m;
    let text = format!(
        "{} is near ({:.1}, {:.1}) m, {:.1} m from its position in the site file",
        name_of(site, head),
        place.x_m,
        place.y_m,
        place.distance_m(Point::new(x_m, y_m))
    );
    let check = "its radio_heads.position_m, or whether another radio head sends its pci";
    let correction = Correction::Head(number, [place.x_m, place.y_m]);
    Some(Hypothesis {
        penalty: FREEDOM_LOG_ODDS,
        ..Hypothesis::new(text, check, correction)
    })
}

/// Returns the hypothesis that the vehicle is a robot with a differential drive instead of a road
/// vehicle.
pub fn robot() -> Hypothesis {
    Hypothesis {
        penalty: FREEDOM_LOG_ODDS,
        ..Hypothesis::new(
            "the vehicle is a robot on two driven wheels",
            "drive in the vehicle's file: drive = \"differential\"",
            Correction::Vehicle(|vehicle| {
                vehicle.drive = DriveKind::Differential;
                vehicle.receiver.multipath_bias_probability = Some(0.0); // default of a differential drive
            }),
        )
    }
}

/// Returns the hypotheses about the yaw rate, each with its ratio of measured to true turn. A
/// constant yaw rate may be a value that is not measured.
pub fn of_yaw_rate(constant_radps: Option<f64>) -> Vec<(f64, Hypothesis)> {
    if let Some(radps) = constant_radps {
        let radps = radps + 0.0; // a negative zero is zero
        let text = format!("yaw_rate_radps, which is {radps} throughout, is not a measurement");
        let correction = Correction::Odometry(|it| it.yaw_rate_radps = None);
        let check = "the source of the yaw rate, and its column";
        return vec![(0.0, Hypothesis::new(text, check, correction))];
    }
    vec![
        (
            180.0 / PI,
            Hypothesis::new(
                "yaw_rate_radps is in degrees per second",
                "its unit",
                Correction::Odometry(|it| {
                    it.yaw_rate_radps = it.yaw_rate_radps.map(f64::to_radians);
                }),
            ),
        ),
        (
            -1.0,
            Hypothesis::new(
                "yaw_rate_radps counts clockwise",
                "its sign: counter-clockwise is positive",
                Correction::Odometry(|it| it.yaw_rate_radps = it.yaw_rate_radps.map(|rate| -rate)),
            ),
        ),
    ]
}

/// Returns the hypotheses about the whole drive.
pub fn of_drive() -> Vec<Hypothesis> {
    let table: [(&str, &str, Correction); 20] = [
        (
            "the order of the array's antennas is reversed",
            "the sign of phase_rad, the order of the antennas, array.mounting_rad (half a turn)",
            Correction::Angle(|it, _| {
                it.measured.phase_rad = -it.measured.phase_rad;
                it.measured.angle_rad = PI - it.measured.angle_rad;
            }),
        ),
        (
            "phase_rad is the angle from the array's axis",
            "whether the columns are to be named angle_rad and angle_sigma_rad",
            Correction::Angle(|it, _| {
                (it.measured.angle_rad, it.measured.phase_rad) = (it.measured.phase_rad, f64::NAN);
            }),
        ),
        (
            "angle_rad is the electrical angle",
            "whether the columns are to be named phase_rad and phase_sigma_rad",
            Correction::Angle(|it, _| it.measured.phase_rad = it.measured.angle_rad),
        ),
        (
            "angle_rad is measured from the vehicle's forward axis",
            "that angle_rad is measured from the array's axis",
            Correction::Angle(|it, vehicle| {
                it.measured.angle_rad -= vehicle.array.mounting_rad;
            }),
        ),
        (
            "the angles are in degrees",
            "the unit of phase_rad or angle_rad",
            Correction::Angle(|it, _| {
                it.measured.phase_rad = it.measured.phase_rad.to_radians();
                it.measured.angle_rad = it.measured.angle_rad.to_radians();
            }),
        ),
        (
            "the array's axis points a quarter of a turn further to the left",
            "array.mounting_rad: that of the line of antennas, not of broadside",
            Correction::Mounting(FRAC_PI_2),
        ),
        (
            "the array's axis points a quarter of a turn further to the right",
            "array.mounting_rad: that of the line of antennas, not of broadside",
            Correction::Mounting(-FRAC_PI_2),
        ),
        (
            "distances and speeds count backwards",
            "their sign: forwards is positive",
            Correction::Odometry(|it| scale(it, -1.0)),
        ),
        (
            "distances and speeds are in millimetres",
            "the units of distance_m and speed_mps",
            Correction::Odometry(|it| scale(it, 1e-3)),
        ),
        (
            "distances and speeds are in centimetres",
            "the units of distance_m and speed_mps",
            Correction::Odometry(|it| scale(it, 1e-2)),
        ),
        (
            "distances and speeds are in kilometres",
            "the units of distance_m and speed_mps",
            Correction::Odometry(|it| scale(it, 1e3)),
        ),
        (
            "distances and speeds are twice the true ones",
            "odometer.scale, and whether the diameter of the wheels was used as their radius",
            Correction::Odometry(|it| scale(it, 0.5)),
        ),
        (
            "distances and speeds are half of the true ones",
            "odometer.scale, and whether the radius of the wheels was used as their diameter",
            Correction::Odometry(|it| scale(it, 2.0)),
        ),
        (
            "the radio heads' x is mirrored",
            "the sign of x in radio_heads.position_m",
            Correction::Heads(|[x, y, z]| [-x, y, z]),
        ),
        (
            "the radio heads' y is mirrored",
            "the sign of y in radio_heads.position_m: x east and y north, or any right-handed pair",
            Correction::Heads(|[x, y, z]| [x, -y, z]),
        ),
        (
            "the radio heads' x and y are exchanged",
            "the order in radio_heads.position_m: x, y, height",
            Correction::Heads(|[x, y, z]| [y, x, z]),
        ),
        (
            "the drive starts heading a quarter of a turn further to the left",
            "the start's heading: 0 along +x, counter-clockwise",
            Correction::Start(|_, pose| turned(pose, FRAC_PI_2)),
        ),
        (
            "the drive starts heading a quarter of a turn further to the right",
            "the start's heading: 0 along +x, counter-clockwise",
            Correction::Start(|_, pose| turned(pose, -FRAC_PI_2)),
        ),
        (
            "the drive starts heading the other way",
            "the start's heading: 0 along +x, counter-clockwise",
            Correction::Start(|_, pose| turned(pose, PI)),
        ),
        (
            "the drive starts on the other side of the line of radio heads",
            "the start",
            Correction::Start(other_side),
        ),
    ];
    let new = |(text, check, correction)| Hypothesis::new(text, check, correction);
    table.into_iter().map(new).collect()
}

fn scale(sample: &mut OdometrySample, factor: f64) {
    sample.distance_m *= factor;
    sample.speed_mps *= factor;
}

fn turned(pose: Pose, by_rad: f64) -> Pose {
    Pose {
        heading_rad: pose.heading_rad + by_rad,
        ..pose
    }
}

/// Mirrors a pose at the line that is closest to the radio heads (their principal axis).
fn other_side(site: &Site, pose: Pose) -> Pose {
    let count = site.radio_heads.len().max(1) as f64;
    let places = || site.radio_heads.iter().map(|head| head.position_m);
    let mean = |axis: fn([f64; 3]) -> f64| places().map(axis).sum::<f64>() / count;
    let middle = [mean(|[x, ..]| x), mean(|[_, y, _]| y)];
    let (mut xx_minus_yy, mut xy) = (0.0, 0.0);
    for [x, y, _] in places() {
        let (dx, dy) = (x - middle[0], y - middle[1]);
        xx_minus_yy += dx * dx - dy * dy;
        xy += dx * dy;
    }
    // A mirror axis of direction φ converts a direction β to 2φ − β.
    let twice_rad = (2.0 * xy).atan2(xx_minus_yy);
    let (sin, cos) = twice_rad.sin_cos();
    let (dx, dy) = (pose.x_m - middle[0], pose.y_m - middle[1]);
    Pose {
        x_m: middle[0] + cos * dx + sin * dy,
        y_m: middle[1] + sin * dx - cos * dy,
        heading_rad: twice_rad - pose.heading_rad,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use onboard::settings::{Shipped, TomlFile as _};

    #[test]
    fn the_other_side_gives_equal_angles_and_mirroring_is_its_own_inverse() {
        // Radio heads along a line that rises by half a metre per metre.
        let heads = [0.0, 10.0, 20.0, 50.0].iter().enumerate();
        let heads = heads.map(|(pci, x)| {
            let y = 3.0 + 0.5 * x;
            format!("[[radio_heads]]\npci = {pci}\nposition_m = [{x:?}, {y:?}, 0.0]\n")
        });
        let text = String::from("name = \"wall\"\n") + &heads.collect::<String>();
        let site = Site::from_toml(&text, "wall.toml", &Shipped).unwrap();
        let here = Pose {
            x_m: 4.0,
            y_m: 1.0,
            heading_rad: 0.7,
        };
        let there = other_side(&site, here);
        for head in &site.radio_heads {
            let [x, y, _] = head.position_m;
            let seen = |from: Pose| {
                let (dx, dy) = (x - from.x_m, y - from.y_m);
                (dx.hypot(dy), (dy.atan2(dx) - from.heading_rad).cos())
            };
            let ((far, ahead), (far_there, ahead_there)) = (seen(here), seen(there));
            assert!((far - far_there).abs() < 1e-9 && (ahead - ahead_there).abs() < 1e-9);
        }
        let back = other_side(&site, there);
        assert!(there.point().distance_m(here.point()) > 3.0);
        assert!(back.point().distance_m(here.point()) < 1e-9);
    }
}
