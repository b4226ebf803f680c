//! Roads from segments or surveyed points.

use thiserror::Error;

use super::course::{Gap, Piece, Road};
use super::segment::Segment;
use crate::geometry::{Point, Pose, wrap_angle};

/// Maximum length of a road (m). Exchanged latitude and longitude produce longer ones.
const LONGEST_M: f64 = 1e6;

/// Reason why a road is invalid.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum RoadError {
    /// No segment, or fewer than two points.
    #[error("a road needs at least one segment or two points")]
    Empty,
    /// The length is not a positive number.
    #[error("segment {index} has a length of {length_m} m; it must be positive")]
    Length {
        /// Index of the segment.
        index: usize,
        /// Its length in metres.
        length_m: f64,
    },
    /// An unsurveyed segment is curved. The road's coordinates end at the centre of a curve, so
    /// that the distance of a vehicle from a guessed curve is undefined.
    #[error(
        "segment {index} is not surveyed and turns by {turn_rad} rad; an unsurveyed segment must \
         be straight"
    )]
    BentGuess {
        /// Index of the segment.
        index: usize,
        /// Heading change in radians.
        turn_rad: f64,
    },
    /// Two successive points are equal.
    #[error("points {index} and {} of the polyline have the same position", index + 1)]
    RepeatedPoint {
        /// Index of the first of the two points.
        index: usize,
    },
    /// The road is longer than any vehicle drives.
    #[error("the road is {length_m:.0} m long; the maximum is 1000 km")]
    TooLong {
        /// Its length in metres.
        length_m: f64,
    },
    /// The polyline reverses its direction.
    #[error("the polyline turns back on itself at point {index}")]
    Reversal {
        /// Index of the point.
        index: usize,
    },
}

impl RoadError {
    /// Returns an error if a road of this length is invalid.
    pub(super) fn check_length(length_m: f64) -> Result<(), Self> {
        if length_m > LONGEST_M {
            return Err(Self::TooLong { length_m });
        }
        Ok(())
    }
}

impl Road {
    /// Creates a road of lines and arcs, joined with a continuous heading.
    ///
    /// # Errors
    /// [`RoadError`] if there is no segment, or a length is not positive or too large.
    pub fn from_segments(
        start: Pose,
        segments: &[Segment],
        width_m: f64,
    ) -> Result<Self, RoadError> {
        let mut pieces = Vec::with_capacity(segments.len());
        let mut gaps: Vec<Gap> = Vec::new();
        let (mut pose, mut length_m) = (start, 0.0);
        for (index, segment) in segments.iter().enumerate() {
            if !(segment.length_m > 0.0 && segment.length_m.is_finite()) {
                return Err(RoadError::Length {
                    index,
                    length_m: segment.length_m,
                });
            }
            if !segment.surveyed && segment.turn_rad != 0.0 {
                return Err(RoadError::BentGuess {
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
            return Err(RoadError::Empty);
        }
        RoadError::check_length(length_m)?;
        Ok(Self {
            pieces,
            gaps,
            length_m,
            width_m,
        })
    }

    /// Creates a road through surveyed points: straight lines, with each corner replaced by an arc
    /// of radius `corner_radius_m`, or of the maximum radius for half of the shorter adjacent line.
    ///
    /// # Errors
    /// [`RoadError`] if points repeat, the line reverses its direction, or is too long.
    pub fn from_polyline(
        points: &[Point],
        corner_radius_m: f64,
        width_m: f64,
    ) -> Result<Self, RoadError> {
        let legs: Vec<(f64, f64)> = points
            .windows(2)
            .filter_map(|pair| match pair {
                [from, to] => Some((from.distance_m(*to), from.bearing_rad(*to))),
                _ => None,
            })
            .collect();
        if let Some(index) = legs.iter().position(|leg| leg.0 <= 0.0) {
            return Err(RoadError::RepeatedPoint { index });
        }
        let (Some(first), Some(&(_, heading_rad))) = (points.first(), legs.first()) else {
            return Err(RoadError::Empty);
        };

        let mut segments = Vec::with_capacity(2 * legs.len());
        let mut cut_before_m = 0.0;
        for (index, leg) in legs.iter().enumerate() {
            let corner = match legs.get(index + 1) {
                None => None,
                Some(next) => {
                    let turn_rad = wrap_angle(next.1 - leg.1);
                    if turn_rad.abs() > 0.999 * std::f64::consts::PI {
                        return Err(RoadError::Reversal { index: index + 1 });
                    }
                    // An arc tangent to both lines begins R·tan(turn/2) before their corner.
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
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn paper() -> Road {
        let bend = [Segment {
            length_m: 300.0,
            turn_rad: 0.25,
            surveyed: true,
        }];
        Road::from_segments(Pose::default(), &bend, 5.0).unwrap()
    }

    fn winding() -> Road {
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
        Road::from_segments(
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
    fn the_track_of_the_paper_is_an_arc_of_1200_m() {
        let end = paper().pose(300.0);
        assert!((end.x_m - 1200.0 * 0.25_f64.sin()).abs() < 1e-9);
        assert!((end.y_m - 1200.0 * (1.0 - 0.25_f64.cos())).abs() < 1e-9);
        assert!((end.heading_rad.to_degrees() - 14.32).abs() < 0.01);
        assert!((paper().curvature_per_m(10.0) - 1.0 / 1200.0).abs() < 1e-15);
    }

    #[test]
    fn the_reversed_road_is_equal() {
        let (road, back) = (winding(), winding().reversed());
        for step in 0..=40 {
            let along_m = f64::from(step) * road.length_m() / 40.0;
            let (there, here) = (road.pose(along_m), back.pose(road.length_m() - along_m));
            assert!(there.point().distance_m(here.point()) < 1e-9);
            let turn_rad = wrap_angle(there.heading_rad - here.heading_rad).abs();
            assert!((turn_rad - std::f64::consts::PI).abs() < 1e-9);
        }
        assert_eq!(
            back.curvature_per_m(1.0),
            -road.curvature_per_m(road.length_m() - 1.0)
        );
    }

    #[test]
    fn the_road_continues_straight_beyond_its_ends() {
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
        let road = Road::from_polyline(&corner, 10.0, 5.0).unwrap();
        let quarter = 10.0 * std::f64::consts::FRAC_PI_2;
        assert!((road.length_m() - (40.0 + quarter + 30.0)).abs() < 1e-9);
        let end = road.pose(road.length_m());
        assert!(end.point().distance_m(Point::new(50.0, 40.0)) < 1e-9);
        assert!((road.curvature_per_m(45.0) - 0.1).abs() < 1e-12);
    }

    #[test]
    fn adjacent_unsurveyed_segments_are_one_gap_in_either_direction() {
        let segments = [(40.0, true), (10.0, false), (20.0, false), (30.0, true)];
        let segments = segments.map(|(length_m, surveyed)| Segment {
            length_m,
            turn_rad: if surveyed { 0.3 } else { 0.0 },
            surveyed,
        });
        let road = Road::from_segments(Pose::default(), &segments, 5.0).unwrap();
        let gap = |from_m, to_m| Some(Gap { from_m, to_m });
        assert_eq!(road.gap_between(65.0, 65.0), gap(40.0, 70.0));
        assert_eq!(road.gap_between(38.0, 41.0), gap(40.0, 70.0));
        assert_eq!(road.gap_between(f64::NEG_INFINITY, 39.0), None);
        assert_eq!(road.gap_between(71.0, f64::INFINITY), None);
        assert_eq!(road.reversed().gap_between(0.0, 99.0), gap(30.0, 60.0));
        assert_eq!(
            Road::from_segments(
                Pose::default(),
                &segments.map(|segment| Segment {
                    turn_rad: 0.1,
                    ..segment
                }),
                5.0
            ),
            Err(RoadError::BentGuess {
                index: 1,
                turn_rad: 0.1
            })
        );
    }

    #[test]
    fn impossible_roads_are_rejected() {
        let bad = [Segment {
            length_m: -3.0,
            turn_rad: 0.0,
            surveyed: true,
        }];
        assert_eq!(
            Road::from_segments(Pose::default(), &bad, 5.0),
            Err(RoadError::Length {
                index: 0,
                length_m: -3.0
            })
        );
        assert_eq!(
            Road::from_segments(Pose::default(), &[], 5.0),
            Err(RoadError::Empty)
        );
        let twice = [[0.0, 0.0], [1.0, 0.0], [1.0, 0.0]].map(Point::from);
        assert_eq!(
            Road::from_polyline(&twice, 1.0, 5.0),
            Err(RoadError::RepeatedPoint { index: 1 })
        );
        let back = [[0.0, 0.0], [9.0, 0.0], [1.0, 0.0]].map(Point::from);
        assert_eq!(
            Road::from_polyline(&back, 1.0, 5.0),
            Err(RoadError::Reversal { index: 1 })
        );
        let far = [[0.0, 0.0], [9e6, 0.0]].map(Point::from);
        let too_long = Err(RoadError::TooLong { length_m: 9e6 });
        assert_eq!(Road::from_polyline(&far, 1.0, 5.0), too_long);
        assert_eq!(Road::through_points(&far, 0.1, 5.0), too_long);
    }

    proptest! {
        #[test]
        fn projection_inverts_the_offset(along_m in 0.0..205.0_f64, lateral_m in -4.0..4.0_f64) {
            let road = winding();
            let place = road.pose(along_m).offset_left(lateral_m).point();
            let back = road.project(place);
            prop_assert!((back.along_m - along_m).abs() < 1e-6);
            prop_assert!((back.lateral_m - lateral_m).abs() < 1e-6);
        }
    }
}
