//! The road: a chain of straight lines and circular arcs, in closed form.

use thiserror::Error;

use crate::geometry::{Point, Pose, wrap_angle};

/// A road as pieces of constant curvature, parametrised by the distance `s` along it.
#[derive(Debug, Clone, PartialEq)]
pub struct Track {
    pieces: Vec<Piece>,
    gaps: Vec<Gap>,
    length_m: f64,
    width_m: f64,
}

/// A line or arc as it is described: its length and by how much it turns.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Segment {
    /// Length in metres.
    pub length_m: f64,
    /// Turn over that length in radians; left is positive, a line has none.
    pub turn_rad: f64,
    /// Whether the road is known to lie there; else this is a guess, which must be straight.
    pub surveyed: bool,
}

/// A stretch of the road that was not surveyed: the road leaves at one end and comes back at the
/// other, and what lies between is a guess.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gap {
    /// Where it begins, along the road in metres.
    pub from_m: f64,
    /// Where it ends.
    pub to_m: f64,
}

/// A line or arc where it lies.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Piece {
    start_m: f64,
    length_m: f64,
    curvature_per_m: f64,
    start: Pose,
}

/// A point in the road's own coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Projection {
    /// Distance along the road to the nearest point on it, in metres.
    pub along_m: f64,
    /// Distance from it, in metres; left is positive.
    pub lateral_m: f64,
}

/// Why a road cannot be built.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum TrackError {
    /// No segment, or fewer than two points.
    #[error("a track needs at least one segment or two points")]
    Empty,
    /// A length that is not a positive number.
    #[error("segment {index} has a length of {length_m} m; it must be positive")]
    Length {
        /// Index of the segment.
        index: usize,
        /// Its length in metres.
        length_m: f64,
    },
    /// A guess that bends: beside a bend the road's coordinates end at its centre, and nothing
    /// says how far from a guess the vehicle is.
    #[error(
        "segment {index} is not surveyed and turns by {turn_rad} rad; a guess must be straight"
    )]
    BentGuess {
        /// Index of the segment.
        index: usize,
        /// Its turn in radians.
        turn_rad: f64,
    },
    /// Two successive points in one place.
    #[error("points {index} and {} of the polyline are in one place", index + 1)]
    RepeatedPoint {
        /// Index of the first of the two.
        index: usize,
    },
    /// A polyline that turns back on itself.
    #[error("the polyline turns back on itself at point {index}")]
    Reversal {
        /// Index of the point.
        index: usize,
    },
}

impl Track {
    /// A road of lines and arcs that join without a kink.
    ///
    /// # Errors
    /// [`TrackError`] when there is no segment or a length is not positive.
    pub fn from_segments(
        start: Pose,
        segments: &[Segment],
        width_m: f64,
    ) -> Result<Self, TrackError> {
        let mut pieces = Vec::with_capacity(segments.len());
        let mut gaps: Vec<Gap> = Vec::new();
        let (mut pose, mut length_m) = (start, 0.0);
        for (index, segment) in segments.iter().enumerate() {
            if !(segment.length_m > 0.0 && segment.length_m.is_finite()) {
                return Err(TrackError::Length {
                    index,
                    length_m: segment.length_m,
                });
            }
            if !segment.surveyed && segment.turn_rad != 0.0 {
                return Err(TrackError::BentGuess {
                    index,
                    turn_rad: segment.turn_rad,
                });
            }
            let piece = Piece {
                start_m: length_m,
                length_m: segment.length_m,
                curvature_per_m: segment.turn_rad / segment.length_m,
                start: pose,
            };
            pose = piece.pose(piece.length_m);
            length_m += piece.length_m;
            pieces.push(piece);
            if !segment.surveyed {
                let from_m = piece.start_m;
                let before = gaps.pop_if(|gap| gap.to_m == from_m);
                gaps.push(Gap {
                    from_m: before.map_or(from_m, |gap| gap.from_m),
                    to_m: length_m,
                });
            }
        }
        if pieces.is_empty() {
            return Err(TrackError::Empty);
        }
        Ok(Self {
            pieces,
            gaps,
            length_m,
            width_m,
        })
    }

    /// A road through surveyed points: straight between them, each corner rounded by an arc of
    /// radius `corner_radius_m`, or by as large a one as half of the shorter neighbour permits.
    ///
    /// # Errors
    /// [`TrackError`] when points repeat or the line turns back on itself.
    pub fn from_polyline(
        points: &[Point],
        corner_radius_m: f64,
        width_m: f64,
    ) -> Result<Self, TrackError> {
        let legs: Vec<(f64, f64)> = points
            .windows(2)
            .filter_map(|pair| match pair {
                [from, to] => Some((from.distance_m(*to), from.bearing_rad(*to))),
                _ => None,
            })
            .collect();
        if let Some(index) = legs.iter().position(|leg| leg.0 <= 0.0) {
            return Err(TrackError::RepeatedPoint { index });
        }
        let (Some(first), Some(&(_, heading_rad))) = (points.first(), legs.first()) else {
            return Err(TrackError::Empty);
        };

        let mut segments = Vec::with_capacity(2 * legs.len());
        let mut cut_before_m = 0.0;
        for (index, leg) in legs.iter().enumerate() {
            let corner = match legs.get(index + 1) {
                None => None,
                Some(next) => {
                    let turn_rad = wrap_angle(next.1 - leg.1);
                    if turn_rad.abs() > 0.999 * std::f64::consts::PI {
                        return Err(TrackError::Reversal { index: index + 1 });
                    }
                    // An arc tangent to both legs begins R·tan(turn/2) before their corner.
                    let tangent = (0.5 * turn_rad.abs()).tan();
                    let cut_m = (corner_radius_m * tangent).min(0.5 * leg.0.min(next.0));
                    (tangent > 1e-12).then(|| (cut_m, cut_m / tangent * turn_rad.abs(), turn_rad))
                }
            };
            let cut_after_m = corner.map_or(0.0, |c| c.0);
            let straight_m = leg.0 - cut_before_m - cut_after_m;
            if straight_m > 1e-9 {
                segments.push(Segment {
                    length_m: straight_m,
                    turn_rad: 0.0,
                    surveyed: true,
                });
            }
            if let Some((_, arc_m, turn_rad)) = corner {
                segments.push(Segment {
                    length_m: arc_m,
                    turn_rad,
                    surveyed: true,
                });
            }
            cut_before_m = cut_after_m;
        }
        let start = Pose {
            x_m: first.x_m,
            y_m: first.y_m,
            heading_rad,
        };
        Self::from_segments(start, &segments, width_m)
    }

    /// The same road driven the other way.
    #[must_use]
    pub fn reversed(&self) -> Self {
        let mut start_m = 0.0;
        let turned = |pose: Pose| Pose {
            heading_rad: wrap_angle(pose.heading_rad + std::f64::consts::PI),
            ..pose
        };
        let pieces = self.pieces.iter().rev().map(|piece| {
            let reversed = Piece {
                start_m,
                length_m: piece.length_m,
                curvature_per_m: -piece.curvature_per_m,
                start: turned(piece.pose(piece.length_m)),
            };
            start_m += piece.length_m;
            reversed
        });
        let gaps = self.gaps.iter().rev().map(|gap| Gap {
            from_m: self.length_m - gap.to_m,
            to_m: self.length_m - gap.from_m,
        });
        Self {
            pieces: pieces.collect(),
            gaps: gaps.collect(),
            length_m: self.length_m,
            width_m: self.width_m,
        }
    }

    /// Length of the road in metres.
    pub const fn length_m(&self) -> f64 {
        self.length_m
    }

    /// Width of the road in metres.
    pub const fn width_m(&self) -> f64 {
        self.width_m
    }

    /// Place and direction of the road at `along_m`; beyond its ends it goes on straight.
    pub fn pose(&self, along_m: f64) -> Pose {
        let piece = self.piece(along_m);
        let local_m = along_m - piece.start_m;
        let inside_m = local_m.clamp(0.0, piece.length_m);
        piece.pose(inside_m).along_arc(local_m - inside_m, 0.0)
    }

    /// Curvature of the road at `along_m` in 1/m; a left bend is positive.
    pub fn curvature_per_m(&self, along_m: f64) -> f64 {
        if along_m < 0.0 || along_m > self.length_m {
            return 0.0;
        }
        self.piece(along_m).curvature_per_m
    }

    /// The first stretch between `from_m` and `to_m` along the road that was not surveyed.
    pub fn gap_between(&self, from_m: f64, to_m: f64) -> Option<Gap> {
        let mut gaps = self.gaps.iter().copied();
        gaps.find(|gap| gap.from_m <= to_m && gap.to_m >= from_m)
    }

    /// The nearest point of the road.
    pub fn project(&self, point: Point) -> Projection {
        self.project_between(point, f64::NEG_INFINITY, f64::INFINITY)
    }

    /// The nearest point of the road within `window_m` of `near_m` along it: where a road crosses
    /// itself, the branch the vehicle is on.
    pub fn project_near(&self, point: Point, near_m: f64, window_m: f64) -> Projection {
        self.project_between(point, near_m - window_m, near_m + window_m)
    }

    fn project_between(&self, point: Point, from_m: f64, to_m: f64) -> Projection {
        let first = self.piece_index(from_m);
        let last = self.piece_index(to_m);
        let (mut best, mut best_m) = (
            Projection {
                along_m: 0.0,
                lateral_m: 0.0,
            },
            f64::INFINITY,
        );
        for piece in self.pieces.get(first..=last).unwrap_or_default() {
            let (local_m, distance_m) = piece.nearest(point);
            if distance_m < best_m {
                best_m = distance_m;
                let road = piece.pose(local_m);
                let (sin, cos) = road.heading_rad.sin_cos();
                let (dx_m, dy_m) = (point.x_m - road.x_m, point.y_m - road.y_m);
                // Beyond the road's ends it goes on straight.
                let ahead_m = cos * dx_m + sin * dy_m;
                let beyond_m = if (local_m <= 0.0 && piece.start_m <= 0.0)
                    || (local_m >= piece.length_m
                        && piece.start_m + piece.length_m >= self.length_m)
                {
                    ahead_m
                } else {
                    0.0
                };
                best = Projection {
                    along_m: piece.start_m + local_m + beyond_m,
                    lateral_m: cos * dy_m - sin * dx_m,
                };
            }
        }
        best
    }

    fn piece_index(&self, along_m: f64) -> usize {
        self.pieces
            .partition_point(|piece| piece.start_m <= along_m)
            .saturating_sub(1)
    }

    fn piece(&self, along_m: f64) -> Piece {
        // A track has at least one piece, by construction.
        self.pieces
            .get(self.piece_index(along_m))
            .copied()
            .unwrap_or(Piece {
                start_m: 0.0,
                length_m: 0.0,
                curvature_per_m: 0.0,
                start: Pose::default(),
            })
    }
}

impl Piece {
    fn pose(&self, local_m: f64) -> Pose {
        self.start.along_arc(local_m, self.curvature_per_m)
    }

    /// Distance along this piece to its point nearest to `point`, and the distance between them.
    fn nearest(&self, point: Point) -> (f64, f64) {
        let (sin, cos) = self.start.heading_rad.sin_cos();
        let (dx_m, dy_m) = (point.x_m - self.start.x_m, point.y_m - self.start.y_m);
        let (ahead_m, left_m) = (cos * dx_m + sin * dy_m, cos * dy_m - sin * dx_m);
        let local_m = if self.curvature_per_m.abs() < 1e-9 {
            ahead_m
        } else {
            // Seen from the circle's centre, (0, 1/κ) in the piece's own frame.
            let (across, along) = (
                1.0 - self.curvature_per_m * left_m,
                self.curvature_per_m * ahead_m,
            );
            along.atan2(across) / self.curvature_per_m
        };
        let at = |local_m: f64| self.pose(local_m).point().distance_m(point);
        let inside_m = local_m.clamp(0.0, self.length_m);
        // On an arc the nearer end may be the other one than where clamping leads.
        [inside_m, 0.0, self.length_m]
            .into_iter()
            .map(|candidate_m| (candidate_m, at(candidate_m)))
            .fold((0.0, f64::INFINITY), |best, next| {
                if next.1 < best.1 { next } else { best }
            })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn paper() -> Track {
        let bend = [Segment {
            length_m: 300.0,
            turn_rad: 0.25,
            surveyed: true,
        }];
        Track::from_segments(Pose::default(), &bend, 5.0).unwrap()
    }

    fn winding() -> Track {
        let segments = [
            (50.0, 0.0),
            (40.0, 1.2),
            (30.0, -0.7),
            (25.0, 0.0),
            (60.0, 1.0),
        ]
        .map(|(length_m, turn_rad)| Segment {
            length_m,
            turn_rad,
            surveyed: true,
        });
        Track::from_segments(
            Pose {
                x_m: 3.0,
                y_m: -7.0,
                heading_rad: 0.4,
            },
            &segments,
            5.0,
        )
        .unwrap()
    }

    #[test]
    fn papers_track_is_an_arc_of_1200_m() {
        let end = paper().pose(300.0);
        assert!((end.x_m - 1200.0 * 0.25_f64.sin()).abs() < 1e-9);
        assert!((end.y_m - 1200.0 * (1.0 - 0.25_f64.cos())).abs() < 1e-9);
        assert!((end.heading_rad.to_degrees() - 14.32).abs() < 0.01);
        assert!((paper().curvature_per_m(10.0) - 1.0 / 1200.0).abs() < 1e-15);
    }

    #[test]
    fn the_other_way_round_it_is_the_same_road() {
        let (track, back) = (winding(), winding().reversed());
        for step in 0..=40 {
            let along_m = f64::from(step) * track.length_m() / 40.0;
            let (there, here) = (track.pose(along_m), back.pose(track.length_m() - along_m));
            assert!(there.point().distance_m(here.point()) < 1e-9);
            let turn_rad = wrap_angle(there.heading_rad - here.heading_rad).abs();
            assert!((turn_rad - std::f64::consts::PI).abs() < 1e-9);
        }
        assert_eq!(
            back.curvature_per_m(1.0),
            -track.curvature_per_m(track.length_m() - 1.0)
        );
    }

    #[test]
    fn goes_on_straight_beyond_its_ends() {
        let beyond = paper().pose(310.0);
        let end = paper().pose(300.0);
        assert!((beyond.point().distance_m(end.point()) - 10.0).abs() < 1e-9);
        assert_eq!(beyond.heading_rad, end.heading_rad);
        let before = paper().project(Point::new(-4.0, 1.0));
        assert!((before.along_m + 4.0).abs() < 1e-9 && (before.lateral_m - 1.0).abs() < 1e-9);
    }

    #[test]
    fn polyline_corner_is_tangent_to_both_legs() {
        let corner = [[0.0, 0.0], [50.0, 0.0], [50.0, 40.0]].map(Point::from);
        let track = Track::from_polyline(&corner, 10.0, 5.0).unwrap();
        let quarter = 10.0 * std::f64::consts::FRAC_PI_2;
        assert!((track.length_m() - (40.0 + quarter + 30.0)).abs() < 1e-9);
        let end = track.pose(track.length_m());
        assert!(end.point().distance_m(Point::new(50.0, 40.0)) < 1e-9);
        assert!((track.curvature_per_m(45.0) - 0.1).abs() < 1e-12);
    }

    #[test]
    fn a_road_that_crosses_itself_keeps_its_branch() {
        let eight = [
            [0.0, 0.0],
            [100.0, 0.0],
            [100.0, 50.0],
            [50.0, 50.0],
            [50.0, -50.0],
        ];
        let track = Track::from_polyline(&eight.map(Point::from), 5.0, 5.0).unwrap();
        let crossing = Point::new(50.0, 0.1);
        assert!((track.project_near(crossing, 48.0, 10.0).along_m - 50.0).abs() < 1e-6);
        let later_m = track.length_m() - 50.0;
        assert!((track.project_near(crossing, later_m, 10.0).along_m - later_m).abs() < 0.2);
    }

    #[test]
    fn guesses_that_join_are_one_gap_from_either_side() {
        let segments = [(40.0, true), (10.0, false), (20.0, false), (30.0, true)];
        let segments = segments.map(|(length_m, surveyed)| Segment {
            length_m,
            turn_rad: if surveyed { 0.3 } else { 0.0 },
            surveyed,
        });
        let track = Track::from_segments(Pose::default(), &segments, 5.0).unwrap();
        let gap = |from_m, to_m| Some(Gap { from_m, to_m });
        assert_eq!(track.gap_between(65.0, 65.0), gap(40.0, 70.0));
        assert_eq!(track.gap_between(38.0, 41.0), gap(40.0, 70.0));
        assert_eq!(track.gap_between(f64::NEG_INFINITY, 39.0), None);
        assert_eq!(track.gap_between(71.0, f64::INFINITY), None);
        assert_eq!(track.reversed().gap_between(0.0, 99.0), gap(30.0, 60.0));
        assert_eq!(
            Track::from_segments(
                Pose::default(),
                &segments.map(|segment| Segment {
                    turn_rad: 0.1,
                    ..segment
                }),
                5.0
            ),
            Err(TrackError::BentGuess {
                index: 1,
                turn_rad: 0.1
            })
        );
    }

    #[test]
    fn impossible_roads_are_refused() {
        let bad = [Segment {
            length_m: -3.0,
            turn_rad: 0.0,
            surveyed: true,
        }];
        assert_eq!(
            Track::from_segments(Pose::default(), &bad, 5.0),
            Err(TrackError::Length {
                index: 0,
                length_m: -3.0
            })
        );
        assert_eq!(
            Track::from_segments(Pose::default(), &[], 5.0),
            Err(TrackError::Empty)
        );
        let twice = [[0.0, 0.0], [1.0, 0.0], [1.0, 0.0]].map(Point::from);
        assert_eq!(
            Track::from_polyline(&twice, 1.0, 5.0),
            Err(TrackError::RepeatedPoint { index: 1 })
        );
        let back = [[0.0, 0.0], [9.0, 0.0], [1.0, 0.0]].map(Point::from);
        assert_eq!(
            Track::from_polyline(&back, 1.0, 5.0),
            Err(TrackError::Reversal { index: 1 })
        );
    }

    proptest! {
        #[test]
        fn projecting_undoes_offsetting(along_m in 0.0..205.0_f64, lateral_m in -4.0..4.0_f64) {
            let track = winding();
            let place = track.pose(along_m).offset_left(lateral_m).point();
            let back = track.project_near(place, along_m, 30.0);
            prop_assert!((back.along_m - along_m).abs() < 1e-6);
            prop_assert!((back.lateral_m - lateral_m).abs() < 1e-6);
        }
    }
}
