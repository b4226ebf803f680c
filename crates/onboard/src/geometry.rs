//! Points, poses and angles in the plane.

use std::f64::consts::{PI, TAU};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Position in the `map` frame.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Point {
    /// East coordinate in metres.
    pub x_m: f64,
    /// North coordinate in metres.
    pub y_m: f64,
}

impl Point {
    /// Creates the point (`x_m`, `y_m`).
    pub const fn new(x_m: f64, y_m: f64) -> Self {
        Self { x_m, y_m }
    }

    /// Returns the point displaced to the east and north.
    #[must_use]
    pub fn moved(self, [east_m, north_m]: [f64; 2]) -> Self {
        Self::new(self.x_m + east_m, self.y_m + north_m)
    }

    /// Returns the distance to another point in metres.
    pub fn distance_m(self, other: Self) -> f64 {
        (other.x_m - self.x_m).hypot(other.y_m - self.y_m)
    }

    /// Returns the bearing of another point in radians from +x: the angle of incoming signal in eq.
    /// 3 of the paper.
    pub fn bearing_rad(self, other: Self) -> f64 {
        (other.y_m - self.y_m).atan2(other.x_m - self.x_m)
    }
}

impl From<[f64; 2]> for Point {
    fn from([x_m, y_m]: [f64; 2]) -> Self {
        Self { x_m, y_m }
    }
}

/// Axis-aligned rectangle in the map frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Area {
    from: Point,
    to: Point,
}

impl Area {
    /// Creates the square with the centre `middle`.
    pub fn around(middle: Point, half_side_m: f64) -> Self {
        Self {
            from: Point::new(middle.x_m - half_side_m, middle.y_m - half_side_m),
            to: Point::new(middle.x_m + half_side_m, middle.y_m + half_side_m),
        }
    }

    /// Returns the bounding box of points, extended by a quarter of its longer side. Its shorter
    /// side is made equal to the longer one, because radio heads in a row serve the area on both
    /// sides.
    pub fn about(points: impl Iterator<Item = Point>) -> Self {
        let [none, all] = [f64::INFINITY, f64::NEG_INFINITY].map(|it| Point::new(it, it));
        let (from, to) = points.fold((none, all), |(from, to), point| {
            (
                Point::new(from.x_m.min(point.x_m), from.y_m.min(point.y_m)),
                Point::new(to.x_m.max(point.x_m), to.y_m.max(point.y_m)),
            )
        });
        let half_m = 0.75 * (to.x_m - from.x_m).max(to.y_m - from.y_m);
        let middle = Point::new(0.5 * (from.x_m + to.x_m), 0.5 * (from.y_m + to.y_m));
        Self {
            from: middle.moved([-half_m; 2]),
            to: middle.moved([half_m; 2]),
        }
    }

    /// Returns the grid spacing for a maximum number of grid points, at least `min_m`.
    pub fn spacing_m(&self, max_places: f64, min_m: f64) -> f64 {
        let square_m2 = (self.to.x_m - self.from.x_m) * (self.to.y_m - self.from.y_m);
        (square_m2 / max_places).sqrt().max(min_m)
    }

    /// Returns the centres of the grid cells.
    pub fn places(&self, spacing_m: f64) -> impl Iterator<Item = Point> {
        let count = move |length_m: f64| (length_m / spacing_m).ceil().max(1.0) as u32;
        let middle = move |number: u32| (f64::from(number) + 0.5) * spacing_m;
        let (from, to) = (self.from, self.to);
        let (columns, rows) = (count(to.x_m - from.x_m), count(to.y_m - from.y_m));
        (0..columns).flat_map(move |column| {
            (0..rows).map(move |row| Point::new(from.x_m + middle(column), from.y_m + middle(row)))
        })
    }
}

/// Position and heading in the `map` frame.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Pose {
    /// East coordinate in metres.
    #[schemars(range(min = -1e7, max = 1e7))]
    pub x_m: f64,
    /// North coordinate in metres.
    #[schemars(range(min = -1e7, max = 1e7))]
    pub y_m: f64,
    /// Heading counter-clockwise from +x, in radians.
    #[schemars(range(min = -100.0, max = 100.0))]
    pub heading_rad: f64,
}

impl Pose {
    /// Returns the position.
    #[must_use]
    pub const fn point(self) -> Point {
        Point::new(self.x_m, self.y_m)
    }

    /// Returns another pose minus this pose: east and north (m), and heading in (−π, π] (rad).
    pub fn offset_of(self, other: Self) -> [f64; 3] {
        [
            other.x_m - self.x_m,
            other.y_m - self.y_m,
            wrap_angle(other.heading_rad - self.heading_rad),
        ]
    }

    /// Returns the pose after `length_m` along an arc of constant `curvature_per_m` (positive to
    /// the left).
    #[must_use]
    pub fn along_arc(self, length_m: f64, curvature_per_m: f64) -> Self {
        self.along_chord(length_m, length_m * curvature_per_m)
    }

    /// Returns the pose after `length_m` along an arc with the heading change `turn_rad`; with zero
    /// length, a turn on the spot.
    #[must_use]
    pub fn along_chord(self, length_m: f64, turn_rad: f64) -> Self {
        // The chord of an arc has the arc's mean heading, and sinc(turn/2) times its length.
        let half_turn = 0.5 * turn_rad;
        let sinc = if half_turn.abs() < 1e-4 {
            1.0 - half_turn * half_turn / 6.0
        } else {
            half_turn.sin() / half_turn
        };
        let (sin, cos) = (self.heading_rad + half_turn).sin_cos();
        Self {
            x_m: self.x_m + length_m * sinc * cos,
            y_m: self.y_m + length_m * sinc * sin,
            heading_rad: self.heading_rad + 2.0 * half_turn,
        }
    }

    /// Returns this pose in the frame of another one: forward and left (m), and heading (rad).
    #[must_use]
    pub fn seen_from(self, origin: Self) -> Self {
        let [east_m, north_m, heading_rad] = origin.offset_of(self);
        let (sin, cos) = origin.heading_rad.sin_cos();
        Self {
            x_m: cos * east_m + sin * north_m,
            y_m: cos * north_m - sin * east_m,
            heading_rad,
        }
    }

    /// Returns the pose after a motion, which is a pose in the frame of this one.
    #[must_use]
    pub fn after(self, motion: Self) -> Self {
        let Point { x_m, y_m } = self.point_at(motion.x_m, motion.y_m);
        Self {
            x_m,
            y_m,
            heading_rad: self.heading_rad + motion.heading_rad,
        }
    }

    /// Returns the point at `forward_m` and `left_m` in the frame of the pose.
    #[must_use]
    pub fn point_at(self, forward_m: f64, left_m: f64) -> Point {
        let (sin, cos) = self.heading_rad.sin_cos();
        Point::new(
            self.x_m + forward_m * cos - left_m * sin,
            self.y_m + forward_m * sin + left_m * cos,
        )
    }

    /// Returns the pose displaced by `lateral_m` to the left.
    #[must_use]
    pub fn offset_left(self, lateral_m: f64) -> Self {
        let (sin, cos) = self.heading_rad.sin_cos();
        Self {
            x_m: self.x_m - lateral_m * sin,
            y_m: self.y_m + lateral_m * cos,
            ..self
        }
    }
}

/// Whether two line segments cross or touch, each given by its ends. Parallel segments do not.
pub fn cross([a, b]: [Point; 2], [c, d]: [Point; 2]) -> bool {
    let product = |from: Point, to: Point, other: Point| {
        (to.x_m - from.x_m) * (other.y_m - from.y_m) - (to.y_m - from.y_m) * (other.x_m - from.x_m)
    };
    let parted = |from, to, one, other| product(from, to, one) * product(from, to, other) <= 0.0;
    let turn = (b.x_m - a.x_m) * (d.y_m - c.y_m) - (b.y_m - a.y_m) * (d.x_m - c.x_m);
    turn != 0.0 && parted(a, b, c, d) && parted(c, d, a, b)
}

/// Returns the angle in (−π, π] that is equal to `angle_rad` modulo 2π.
pub fn wrap_angle(angle_rad: f64) -> f64 {
    if angle_rad > -PI && angle_rad <= PI {
        return angle_rad;
    }
    let turned = angle_rad.rem_euclid(TAU);
    if turned > PI { turned - TAU } else { turned }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_motion_is_the_end_seen_from_the_start() {
        let [start, end] =
            [(3.0, -2.0, 2.0), (-1.0, 4.0, -2.5)].map(|(x_m, y_m, heading_rad)| Pose {
                x_m,
                y_m,
                heading_rad,
            });
        let again = start.after(end.seen_from(start));
        assert!(again.point().distance_m(end.point()) < 1e-12);
        assert!(wrap_angle(again.heading_rad - end.heading_rad).abs() < 1e-12);
        // Three metres forward, then a quarter of a turn to the left.
        let turned = start.along_chord(3.0, 0.0).along_chord(0.0, 0.5 * PI);
        let [x_m, y_m, turned_rad] = Pose::default().offset_of(turned.seen_from(start));
        assert!((x_m - 3.0).abs() < 1e-12 && y_m.abs() < 1e-12);
        assert!((turned_rad - 0.5 * PI).abs() < 1e-12);
    }

    #[test]
    fn angles_are_wrapped_to_a_half_open_interval() {
        for (angle, wrapped) in [
            (0.0, 0.0),
            (PI, PI),
            (-PI, PI),
            (3.0 * PI, PI),
            (-0.1, -0.1),
        ] {
            assert!((wrap_angle(angle) - wrapped).abs() < 1e-12, "{angle}");
        }
        assert!((wrap_angle(7.0) - (7.0 - TAU)).abs() < 1e-12);
    }

    #[test]
    fn an_area_contains_its_points_and_is_covered_by_its_squares() {
        let points = [
            Point::new(-2.0, 1.0),
            Point::new(6.0, 5.0),
            Point::new(0.0, 3.0),
        ];
        let area = Area::about(points.into_iter());
        assert_eq!(
            (area.from, area.to),
            (Point::new(-4.0, -3.0), Point::new(8.0, 9.0))
        );
        // 12 m by 12 m: the maximum number of squares, and the minimum spacing.
        assert!((area.spacing_m(36.0, 1.0) - 2.0).abs() < 1e-12);
        assert!((area.spacing_m(1e6, 1.0) - 1.0).abs() < 1e-12);
        let places: Vec<Point> = area.places(2.0).collect();
        assert_eq!(places.len(), 36);
        assert_eq!(
            (places[0], places[35]),
            (Point::new(-3.0, -2.0), Point::new(7.0, 8.0))
        );
    }

    #[test]
    fn segments_cross_between_their_ends_only() {
        let line =
            |[x0, y0]: [f64; 2], [x1, y1]: [f64; 2]| [Point::new(x0, y0), Point::new(x1, y1)];
        let across = line([0.0, -1.0], [0.0, 1.0]);
        for (other, crossing) in [
            (line([-1.0, 0.0], [1.0, 0.0]), true),
            (line([-1.0, 1.0], [1.0, 1.0]), true), // touches its end
            (line([-1.0, 1.1], [1.0, 1.1]), false),
            (line([0.1, 0.0], [1.0, 0.0]), false),
            (line([1.0, -1.0], [1.0, 1.0]), false),
        ] {
            assert_eq!(cross(across, other), crossing, "{other:?}");
            assert_eq!(cross(other, across), crossing, "{other:?}");
        }
    }

    #[test]
    fn an_offset_uses_the_shorter_rotation() {
        let pose = |x_m, heading_rad| Pose {
            x_m,
            y_m: 1.0,
            heading_rad,
        };
        let [x_m, y_m, turn_rad] = pose(2.0, 3.0).offset_of(pose(5.0, -3.0));
        assert_eq!((x_m, y_m), (3.0, 0.0));
        assert!((turn_rad - (TAU - 6.0)).abs() < 1e-12);
    }

    #[test]
    fn an_arc_of_a_quarter_circle_ends_at_its_geometric_end() {
        let end = Pose::default().along_arc(5.0 * PI, 0.1);
        assert!((end.x_m - 10.0).abs() < 1e-12 && (end.y_m - 10.0).abs() < 1e-12);
        assert!((end.heading_rad - PI / 2.0).abs() < 1e-12);
    }

    #[test]
    fn arcs_converge_to_straight_lines() {
        let bent = Pose::default().along_arc(100.0, 2.1e-6);
        let nearly_straight = Pose::default().along_arc(100.0, 1.9e-6);
        assert!((bent.y_m - nearly_straight.y_m - 0.5 * 0.2e-6 * 1e4).abs() < 1e-9);
    }
}
