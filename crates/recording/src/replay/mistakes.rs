//! Mistakes that people make with the files of a drive, and what was meant.

use std::borrow::Cow;
use std::f64::consts::{FRAC_PI_2, PI};

use onboard::geometry::Pose;
use onboard::observation::OdometrySample;
use onboard::settings::{Site, Vehicle};

use crate::angle_log::LoggedAngle;
use crate::odometry::OdometryLog;

/// A drive as it was given, or as it may have been meant.
#[derive(Clone)]
pub struct Drive<'a> {
    pub site: Cow<'a, Site>,
    pub vehicle: Cow<'a, Vehicle>,
    pub odometry: Cow<'a, OdometryLog>,
    /// In order of time; the electrical angle is NaN where the angle from the array's axis is given.
    pub angles: Cow<'a, [LoggedAngle]>,
}

/// A mistake: what is read in its place, and what to check.
pub struct Mistake {
    /// "the angles fit if …".
    pub meant: &'static str,
    /// "check …".
    pub check: &'static str,
    correction: Correction,
}

enum Correction {
    Angle(fn(&mut LoggedAngle, &Vehicle)),
    Odometry(fn(&mut OdometrySample)),
    Head(fn([f64; 3]) -> [f64; 3]),
    Mounting(f64),
    Start(fn(&Site, Pose) -> Pose),
}

impl Mistake {
    const fn new(meant: &'static str, check: &'static str, correction: Correction) -> Self {
        Self {
            meant,
            check,
            correction,
        }
    }

    /// Whether it is one of the start, which a vehicle that is found again has overcome.
    pub const fn is_of_start(&self) -> bool {
        matches!(self.correction, Correction::Start(_))
    }

    /// The drive as it was meant.
    pub fn correct<'a>(&self, given: &Drive<'a>) -> Drive<'a> {
        let mut drive = given.clone();
        match self.correction {
            Correction::Angle(meant) => {
                let angles = drive.angles.to_mut().iter_mut();
                angles.for_each(|angle| meant(angle, &given.vehicle));
            }
            Correction::Odometry(meant) => {
                drive.odometry.to_mut().samples.iter_mut().for_each(meant);
            }
            Correction::Head(meant) => {
                for head in &mut drive.site.to_mut().radio_heads {
                    head.position_m = meant(head.position_m);
                }
            }
            Correction::Mounting(by_rad) => drive.vehicle.to_mut().array.mounting_rad += by_rad,
            Correction::Start(meant) => {
                let start = &mut drive.vehicle.to_mut().start;
                start.pose = start.pose.map(|pose| meant(&given.site, pose));
            }
        }
        drive
    }
}

/// The usual mistakes.
pub const MISTAKES: [Mistake; 22] = [
    Mistake::new(
        "the array's antennas count the other way round",
        "the sign of phase_rad, the order of the antennas, array.mounting_rad (half a turn)",
        Correction::Angle(|it, _| {
            it.measured.phase_rad = -it.measured.phase_rad;
            it.measured.angle_rad = PI - it.measured.angle_rad;
        }),
    ),
    Mistake::new(
        "phase_rad is the angle from the array's axis",
        "whether the columns are to be named angle_rad and angle_sigma_rad",
        Correction::Angle(|it, _| {
            (it.measured.angle_rad, it.measured.phase_rad) = (it.measured.phase_rad, f64::NAN);
        }),
    ),
    Mistake::new(
        "angle_rad is the electrical angle",
        "whether the columns are to be named phase_rad and phase_sigma_rad",
        Correction::Angle(|it, _| it.measured.phase_rad = it.measured.angle_rad),
    ),
    Mistake::new(
        "angle_rad is measured from the vehicle's forward axis",
        "that angle_rad is measured from the array's axis",
        Correction::Angle(|it, vehicle| {
            it.measured.angle_rad -= vehicle.array.mounting_rad;
        }),
    ),
    Mistake::new(
        "the angles are in degrees",
        "the unit of phase_rad or angle_rad",
        Correction::Angle(|it, _| {
            it.measured.phase_rad = it.measured.phase_rad.to_radians();
            it.measured.angle_rad = it.measured.angle_rad.to_radians();
        }),
    ),
    Mistake::new(
        "the array's axis points a quarter of a turn further to the left",
        "array.mounting_rad: that of the line of antennas, not of broadside",
        Correction::Mounting(FRAC_PI_2),
    ),
    Mistake::new(
        "the array's axis points a quarter of a turn further to the right",
        "array.mounting_rad: that of the line of antennas, not of broadside",
        Correction::Mounting(-FRAC_PI_2),
    ),
    Mistake::new(
        "yaw_rate_radps is in degrees per second",
        "its unit",
        Correction::Odometry(|it| it.yaw_rate_radps = it.yaw_rate_radps.map(f64::to_radians)),
    ),
    Mistake::new(
        "yaw_rate_radps counts clockwise",
        "its sign: counter-clockwise is positive",
        Correction::Odometry(|it| it.yaw_rate_radps = it.yaw_rate_radps.map(|rate| -rate)),
    ),
    Mistake::new(
        "distances and speeds count backwards",
        "their sign: forwards is positive",
        Correction::Odometry(|it| scale(it, -1.0)),
    ),
    Mistake::new(
        "distances and speeds are in millimetres",
        "the units of distance_m and speed_mps",
        Correction::Odometry(|it| scale(it, 1e-3)),
    ),
    Mistake::new(
        "distances and speeds are in centimetres",
        "the units of distance_m and speed_mps",
        Correction::Odometry(|it| scale(it, 1e-2)),
    ),
    Mistake::new(
        "distances and speeds are in kilometres",
        "the units of distance_m and speed_mps",
        Correction::Odometry(|it| scale(it, 1e3)),
    ),
    Mistake::new(
        "distances and speeds read double",
        "odometer.scale; the wheels' diameter against their radius",
        Correction::Odometry(|it| scale(it, 0.5)),
    ),
    Mistake::new(
        "distances and speeds read half",
        "odometer.scale; the wheels' radius against their diameter",
        Correction::Odometry(|it| scale(it, 2.0)),
    ),
    Mistake::new(
        "the radio heads' x is mirrored",
        "the sign of x in radio_heads.position_m",
        Correction::Head(|[x, y, z]| [-x, y, z]),
    ),
    Mistake::new(
        "the radio heads' y is mirrored",
        "the sign of y in radio_heads.position_m: x east and y north, or any right-handed pair",
        Correction::Head(|[x, y, z]| [x, -y, z]),
    ),
    Mistake::new(
        "the radio heads' x and y are exchanged",
        "the order in radio_heads.position_m: x, y, height",
        Correction::Head(|[x, y, z]| [y, x, z]),
    ),
    Mistake::new(
        "the drive starts heading a quarter of a turn further to the left",
        "the start's heading: 0 along +x, counter-clockwise",
        Correction::Start(|_, pose| turned(pose, FRAC_PI_2)),
    ),
    Mistake::new(
        "the drive starts heading a quarter of a turn further to the right",
        "the start's heading: 0 along +x, counter-clockwise",
        Correction::Start(|_, pose| turned(pose, -FRAC_PI_2)),
    ),
    Mistake::new(
        "the drive starts heading the other way",
        "the start's heading: 0 along +x, counter-clockwise",
        Correction::Start(|_, pose| turned(pose, PI)),
    ),
    Mistake::new(
        "the drive starts on the other side of the line of radio heads",
        "the start",
        Correction::Start(other_side),
    ),
];

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

/// A pose mirrored at the line that lies closest to the radio heads (their principal axis).
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
    // Mirrored at an axis of direction φ, a direction β becomes 2φ − β.
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
    fn the_other_side_looks_alike_and_the_way_back_leads_home() {
        // Along a wall that rises by half a metre per metre.
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
