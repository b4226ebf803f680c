//! Road as a chain of straight lines and circular arcs, in closed form.

use crate::geometry::{Point, Pose, wrap_angle};

/// Road of pieces with constant curvature, parametrised by the distance `s` along the road.
#[derive(Debug, Clone, PartialEq)]
pub struct Road {
    pub(super) pieces: Vec<Piece>,
    pub(super) gaps: Vec<Gap>,
    pub(super) length_m: f64,
    pub(super) width_m: f64,
}

/// Unsurveyed stretch of a road. The ends are known, and the geometry in between is a guess.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gap {
    /// Start, along the road in metres.
    pub from_m: f64,
    /// End, along the road in metres.
    pub to_m: f64,
}

/// Line or arc with its position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Piece {
    pub start_m: f64,
    pub length_m: f64,
    pub curvature_per_m: f64,
    pub start: Pose,
}

/// Curvature of the road at an uncertain position, by statistical linearisation.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Bending {
    /// Mean curvature (1/m).
    pub mean_per_m: f64,
    /// Derivative of the curvature along the road (1/m²).
    pub slope_per_m2: f64,
    /// Variance of the heading change per metre (rad²/m) due to the non-linear part, which is
    /// correlated over about two standard deviations of the position.
    pub variance_rad2_per_m: f64,
}

/// Point in the road's own coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Projection {
    /// Distance along the road to its nearest point, in metres.
    pub along_m: f64,
    /// Distance from the road in metres; positive to the left.
    pub lateral_m: f64,
}

impl Road {
    /// Returns the road in the opposite direction.
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

    /// Returns the length of the road in metres.
    pub const fn length_m(&self) -> f64 {
        self.length_m
    }

    /// Returns the width of the road in metres.
    pub const fn width_m(&self) -> f64 {
        self.width_m
    }

    /// Returns position and heading of the road at `along_m`; beyond its ends the road is extended
    /// by straight lines.
    pub fn pose(&self, along_m: f64) -> Pose {
        let piece = self.piece(along_m);
        let local_m = along_m - piece.start_m;
        let inside_m = local_m.clamp(0.0, piece.length_m);
        piece.pose(inside_m).along_arc(local_m - inside_m, 0.0)
    }

    /// Returns the curvature of the road at `along_m` in 1/m; positive to the left.
    pub fn curvature_per_m(&self, along_m: f64) -> f64 {
        if along_m < 0.0 || along_m > self.length_m {
            return 0.0;
        }
        self.piece(along_m).curvature_per_m
    }

    /// Returns the curvature at `along_m` with a standard deviation of the position (Gauss–Hermite,
    /// three points).
    pub fn bending(&self, along_m: f64, std_m: f64) -> Bending {
        let here = self.curvature_per_m(along_m);
        let aside_m = 3.0_f64.sqrt() * std_m;
        let [before, after] = [-aside_m, aside_m].map(|by_m| self.curvature_per_m(along_m + by_m));
        // The differences are computed first, so that the result is exactly zero on a line or arc.
        let (down, up) = (before - here, after - here);
        let offset = (down + up) / 6.0;
        let slope_per_m2 = if std_m > 0.0 {
            (after - before) / (2.0 * aside_m)
        } else {
            0.0
        };
        let linear = slope_per_m2 * std_m;
        let variance = (down * down + up * up) / 6.0 - offset * offset - linear * linear;
        Bending {
            mean_per_m: here + offset,
            slope_per_m2,
            variance_rad2_per_m: variance.max(0.0) * 2.0 * std_m,
        }
    }

    /// Returns the first unsurveyed stretch between `from_m` and `to_m` along the road.
    pub fn gap_between(&self, from_m: f64, to_m: f64) -> Option<Gap> {
        let mut gaps = self.gaps.iter().copied();
        gaps.find(|gap| gap.from_m <= to_m && gap.to_m >= from_m)
    }

    /// Returns the projection of a point onto the nearest point of the road.
    pub fn project(&self, point: Point) -> Projection {
        let (mut best, mut best_m) = (
            Projection {
                along_m: 0.0,
                lateral_m: 0.0,
            },
            f64::INFINITY,
        );
        for piece in &self.pieces {
            let (local_m, distance_m) = piece.nearest(point);
            if distance_m < best_m {
                best_m = distance_m;
                let road = piece.pose(local_m);
                let (sin, cos) = road.heading_rad.sin_cos();
                let (dx_m, dy_m) = (point.x_m - road.x_m, point.y_m - road.y_m);
                // Beyond its ends the road is extended by straight lines.
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
        // A road contains at least one piece.
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
    /// Returns position and heading at a distance along the piece.
    pub fn pose(&self, local_m: f64) -> Pose {
        self.start.along_arc(local_m, self.curvature_per_m)
    }

    /// Returns the distance along the piece to its point nearest to `point`, and the distance
    /// between the two.
    fn nearest(&self, point: Point) -> (f64, f64) {
        let (sin, cos) = self.start.heading_rad.sin_cos();
        let (dx_m, dy_m) = (point.x_m - self.start.x_m, point.y_m - self.start.y_m);
        let (ahead_m, left_m) = (cos * dx_m + sin * dy_m, cos * dy_m - sin * dx_m);
        let local_m = if self.curvature_per_m.abs() < 1e-9 {
            ahead_m
        } else {
            // Relative to the circle's centre, (0, 1/κ) in the frame of the piece.
            let (across, along) = (
                1.0 - self.curvature_per_m * left_m,
                self.curvature_per_m * ahead_m,
            );
            along.atan2(across) / self.curvature_per_m
        };
        let at = |local_m: f64| self.pose(local_m).point().distance_m(point);
        let inside_m = local_m.clamp(0.0, self.length_m);
        // The nearer end of an arc may differ from the clamped one.
        [inside_m, 0.0, self.length_m]
            .into_iter()
            .map(|candidate_m| (candidate_m, at(candidate_m)))
            .fold((0.0, f64::INFINITY), |best, next| {
                if next.1 < best.1 { next } else { best }
            })
    }
}
