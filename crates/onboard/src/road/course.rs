//! The road as driven along: a chain of straight lines and circular arcs, in closed form.

use crate::geometry::{Point, Pose, wrap_angle};

/// A road as pieces of constant curvature, parametrised by the distance `s` along it.
#[derive(Debug, Clone, PartialEq)]
pub struct Road {
    pub(super) pieces: Vec<Piece>,
    pub(super) gaps: Vec<Gap>,
    pub(super) length_m: f64,
    pub(super) width_m: f64,
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
pub(super) struct Piece {
    pub start_m: f64,
    pub length_m: f64,
    pub curvature_per_m: f64,
    pub start: Pose,
}

/// How the road bends where it is known only to a deviation: the curvature, linearised statistically.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Bending {
    /// Its mean (1/m).
    pub mean_per_m: f64,
    /// By how much it grows per metre along the road (1/m²).
    pub slope_per_m2: f64,
    /// What is not linear in the place makes of the turn: rad² per metre, as it stays for about two
    /// deviations of the place.
    pub variance_rad2_per_m: f64,
}

/// A point in the road's own coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Projection {
    /// Distance along the road to the nearest point on it, in metres.
    pub along_m: f64,
    /// Distance from it, in metres; left is positive.
    pub lateral_m: f64,
}

impl Road {
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

    /// How the road bends at `along_m`, known to a standard deviation (Gauss–Hermite, three points).
    pub fn bending(&self, along_m: f64, std_m: f64) -> Bending {
        let here = self.curvature_per_m(along_m);
        let aside_m = 3.0_f64.sqrt() * std_m;
        let [before, after] = [-aside_m, aside_m].map(|by_m| self.curvature_per_m(along_m + by_m));
        // Differences first: on a line or arc what is left is nothing, not rounding.
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
        // A road has at least one piece, by construction.
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
    /// Place and direction so far into the piece.
    pub fn pose(&self, local_m: f64) -> Pose {
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
