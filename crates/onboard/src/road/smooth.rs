//! Roads of continuous curvature through surveyed points at any spacing.
//!
//! A cubic smoothing spline over the length of the polyline minimises
//! `Σ |p_i − f(t_i)|² + λ ∫ |f″|² dt`, with λ as large as the standard deviation of the survey
//! permits (Reinsch, Numer. Math. 10, 1967; banded form of Green and Silverman, 1994, 2.3). If a
//! leg is long relative to the bend at its end, points are inserted so that the leg remains
//! straight and the bend remains at its end.

use std::f64::consts::PI;

use super::build::RoadError;
use super::course::{Piece, Road};
use crate::geometry::{Point, Pose, wrap_angle};

/// Maximum deviation of the road from a leg towards the outside of a bend (m).
const BULGE_M: f64 = 0.5;

/// Maximum ratio of the lengths of neighbouring legs of one bend.
const GROWTH: f64 = 1.5;

/// Minimum heading change at one point for a corner (rad). A smaller change is part of a bend.
const CORNER_RAD: f64 = 0.7;
/// Radius of the arc that replaces a corner (m).
const CORNER_RADIUS_M: f64 = 5.0;

/// Number of chords of the arc that replaces a corner.
const CORNER_CHORDS: u32 = 8;

/// Length of the arcs that approximate the spline (m).
const PIECE_M: f64 = 0.5;

/// Number of bisection steps for λ, each a factor of two.
const HALVINGS: u32 = 50;

impl Road {
    /// Creates a road of continuous curvature through points with the standard deviation
    /// `position_std_m`.
    ///
    /// # Errors
    /// [`RoadError`] if points repeat, the line reverses its direction, or is too long.
    pub fn through_points(
        points: &[Point],
        position_std_m: f64,
        width_m: f64,
    ) -> Result<Self, RoadError> {
        let points = with_straights(&with_round_corners(points)?);
        let spline = Spline::new(&points, position_std_m);
        let mut pieces: Vec<Piece> = Vec::new();
        let mut length_m = 0.0;
        for leg in 0..spline.steps.len() {
            let step = spline.steps.get(leg).copied().unwrap_or_default();
            let count = (step / PIECE_M).ceil().max(1.0) as u32;
            for part in 0..count {
                let share = |part: u32| f64::from(part) / f64::from(count);
                let (start, end) = (
                    spline.pose(leg, share(part)),
                    spline.pose(leg, share(part + 1)),
                );
                let turn_rad = wrap_angle(end.heading_rad - start.heading_rad);
                let half = 0.5 * turn_rad;
                let sinc = if half.abs() < 1e-4 {
                    1.0
                } else {
                    half.sin() / half
                };
                let arc_m = start.point().distance_m(end.point()) / sinc;
                if arc_m > 0.0 {
                    pieces.push(Piece {
                        start_m: length_m,
                        length_m: arc_m,
                        curvature_per_m: turn_rad / arc_m,
                        start,
                    });
                    length_m += arc_m;
                }
            }
        }
        if pieces.is_empty() {
            return Err(RoadError::Empty);
        }
        Ok(Self {
            pieces,
            gaps: Vec::new(),
            length_m,
            width_m,
        })
    }
}

/// Returns length and direction from each point to the next.
fn legs(points: &[Point]) -> Vec<(f64, f64)> {
    let pairs = points.iter().zip(points.iter().skip(1));
    let leg = |(from, to): (&Point, &Point)| (from.distance_m(*to), from.bearing_rad(*to));
    pairs.map(leg).collect()
}

/// Returns the points, with each corner replaced by points of an arc.
fn with_round_corners(points: &[Point]) -> Result<Vec<Point>, RoadError> {
    let legs = legs(points);
    RoadError::check_length(legs.iter().map(|leg| leg.0).sum())?;
    if let Some(index) = legs.iter().position(|leg| leg.0 <= 0.0) {
        return Err(RoadError::RepeatedPoint { index });
    }
    let (Some(&first), Some(&last), false) = (points.first(), points.last(), legs.is_empty())
    else {
        return Err(RoadError::Empty);
    };
    let mut rounded = vec![first];
    let inner = points.iter().enumerate().skip(1);
    for ((index, &point), pair) in inner.zip(legs.windows(2)) {
        let &[(before_m, before_rad), (after_m, after_rad)] = pair else {
            continue;
        };
        let turn_rad = wrap_angle(after_rad - before_rad);
        if turn_rad.abs() > 0.999 * PI {
            return Err(RoadError::Reversal { index });
        }
        if turn_rad.abs() <= CORNER_RAD {
            rounded.push(point);
            continue;
        }
        // An arc tangent to both legs begins R·tan(turn/2) before their corner.
        let tangent = (0.5 * turn_rad.abs()).tan();
        let cut_m = (CORNER_RADIUS_M * tangent).min(0.45 * before_m.min(after_m));
        let arc_m = cut_m / tangent * turn_rad.abs();
        let corner = Pose {
            x_m: point.x_m,
            y_m: point.y_m,
            heading_rad: before_rad,
        };
        let entry = corner.along_chord(-cut_m, 0.0);
        rounded.extend((0..=CORNER_CHORDS).map(|chord| {
            let share = f64::from(chord) / f64::from(CORNER_CHORDS);
            entry.along_arc(share * arc_m, turn_rad / arc_m).point()
        }));
    }
    rounded.push(last);
    Ok(rounded)
}

/// Returns the points, with additional points on legs that are long relative to the bends at their
/// ends. Their spacing grows with the distance from a bend, so that the spline leaves the bend
/// without oscillation.
fn with_straights(points: &[Point]) -> Vec<Point> {
    let legs = legs(points);
    // Minimum distance of the next point from a point of a bend.
    let reach_m = |index: usize| {
        let before = index.checked_sub(1).and_then(|before| legs.get(before));
        let (Some(before), Some(after)) = (before, legs.get(index)) else {
            return f64::INFINITY; // nothing bends at an end
        };
        let turn_rad = wrap_angle(after.1 - before.1).abs();
        (GROWTH * before.0.min(after.0)).min(8.0 * BULGE_M / turn_rad.max(1e-9))
    };
    let mut dense = Vec::with_capacity(points.len());
    for (index, (&point, &(leg_m, bearing_rad))) in points.iter().zip(&legs).enumerate() {
        dense.push(point);
        let (mut from_m, mut to_m) = (0.0, leg_m);
        let (mut first_m, mut last_m) = (reach_m(index), reach_m(index + 1));
        let (mut front_m, mut back_m) = (Vec::new(), Vec::new());
        while to_m - from_m > GROWTH * first_m.min(last_m) {
            if first_m <= last_m {
                from_m += first_m;
                first_m *= GROWTH;
                front_m.push(from_m);
            } else {
                to_m -= last_m;
                last_m *= GROWTH;
                back_m.push(to_m);
            }
        }
        let start = Pose {
            x_m: point.x_m,
            y_m: point.y_m,
            heading_rad: bearing_rad,
        };
        let places_m = front_m.into_iter().chain(back_m.into_iter().rev());
        dense.extend(places_m.map(|at_m| start.along_chord(at_m, 0.0).point()));
    }
    dense.extend(points.last());
    dense
}

/// Returns the standard deviation of the points, estimated from their distances to the cubic
/// through the two previous and the two following points, for independent errors.
fn scatter_m(points: &[Point]) -> f64 {
    let mut along_m = vec![0.0];
    for pair in points.windows(2) {
        if let [from, to] = pair {
            along_m.push(along_m.last().copied().unwrap_or_default() + from.distance_m(*to));
        }
    }
    let mut squares = Vec::with_capacity(points.len());
    for (places, at) in points.windows(5).zip(along_m.windows(5)) {
        let (&[a, b, middle, c, d], &[ta, tb, t, tc, td]) = (places, at) else {
            continue;
        };
        let others = [(a, ta), (b, tb), (c, tc), (d, td)];
        let (mut x_m, mut y_m, mut noise) = (middle.x_m, middle.y_m, 1.0);
        for (index, (point, own)) in others.iter().enumerate() {
            let rest = others
                .iter()
                .enumerate()
                .filter(|(other, _)| *other != index);
            let weight: f64 = rest
                .map(|(_, (_, other))| (t - other) / (own - other))
                .product();
            x_m -= weight * point.x_m;
            y_m -= weight * point.y_m;
            noise += weight * weight;
        }
        squares.push((x_m * x_m + y_m * y_m) / noise);
    }
    squares.sort_by(f64::total_cmp);
    // The median of a sum of two squares is 2 ln 2 times the variance of each.
    let median = squares.get(squares.len() / 2).copied().unwrap_or_default();
    (median / std::f64::consts::LN_2).sqrt()
}

/// Cubic spline over a parameter that increases by the distance between points.
struct Spline {
    /// Increase of the parameter from each point to the next.
    steps: Vec<f64>,
    points: Vec<Point>,
    /// Second derivatives at the points.
    seconds: Vec<[f64; 2]>,
}

impl Spline {
    /// Returns the smoothest spline with a root mean square distance of `std_m` from the points.
    fn new(points: &[Point], std_m: f64) -> Self {
        let steps: Vec<f64> = legs(points).iter().map(|leg| leg.0).collect();
        let std_m = std_m.min(scatter_m(points));
        let most = std_m * std_m * points.len() as f64;
        let mut best = Self::with_penalty(points, &steps, 0.0);
        // The dimension of λ is the cube of a length.
        let (mut low, mut high) = (-20.0, 20.0);
        for _ in 0..HALVINGS {
            let middle: f64 = 0.5 * (low + high);
            let made = Self::with_penalty(points, &steps, middle.exp());
            let squares: f64 = (made.points.iter().zip(points))
                .map(|(a, b)| a.distance_m(*b).powi(2))
                .sum();
            if squares <= most {
                (low, best) = (middle, made);
            } else {
                high = middle;
            }
        }
        best
    }

    /// Solves `(R + λ Qᵀ Q) γ = Qᵀ p` for the second derivatives γ at the inner points. The spline
    /// passes through `p − λ Q γ`.
    fn with_penalty(points: &[Point], steps: &[f64], penalty: f64) -> Self {
        let count = points.len();
        let inner = count.saturating_sub(2);
        let step = |index: usize| steps.get(index).copied().unwrap_or(1.0);
        // Column j of Q has these three entries in rows j, j + 1 and j + 2.
        let column = |j: usize| {
            let (a, c) = (step(j).recip(), step(j + 1).recip());
            [a, -a - c, c]
        };
        // Bands of the matrix: the diagonal and two subdiagonals.
        let mut bands = vec![[0.0; 3]; inner];
        let mut right = vec![[0.0; 2]; inner];
        for j in 0..inner {
            let here = column(j);
            let next = column(j + 1);
            let after = column(j + 2);
            let dot = here.iter().map(|value| value * value).sum::<f64>();
            bands[j] = [
                (step(j) + step(j + 1)) / 3.0 + penalty * dot,
                step(j + 1) / 6.0 + penalty * (here[1] * next[0] + here[2] * next[1]),
                penalty * here[2] * after[0],
            ];
            for (row, weight) in here.iter().enumerate() {
                if let Some(point) = points.get(j + row) {
                    right[j][0] += weight * point.x_m;
                    right[j][1] += weight * point.y_m;
                }
            }
        }
        let inner_seconds = solve(bands, right);
        let mut fitted = points.to_vec();
        for (j, second) in inner_seconds.iter().enumerate() {
            for (row, weight) in column(j).iter().enumerate() {
                if let Some(point) = fitted.get_mut(j + row) {
                    point.x_m -= penalty * weight * second[0];
                    point.y_m -= penalty * weight * second[1];
                }
            }
        }
        let mut seconds = vec![[0.0; 2]; count];
        if let Some(inside) = seconds.get_mut(1..=inner) {
            inside.copy_from_slice(&inner_seconds);
        }
        Self {
            steps: steps.to_vec(),
            points: fitted,
            seconds,
        }
    }

    /// Returns position and heading at a fraction of the leg from one point to the next.
    fn pose(&self, leg: usize, share: f64) -> Pose {
        let point = |index: usize| self.points.get(index).copied().unwrap_or_default();
        let second = |index: usize| self.seconds.get(index).copied().unwrap_or_default();
        let step = self.steps.get(leg).copied().unwrap_or(1.0);
        let (from, to) = (point(leg), point(leg + 1));
        let (a, b) = (1.0 - share, share);
        let bend = step * step / 6.0;
        let along = |from: f64, to: f64, first: f64, last: f64| {
            let value =
                a * from + b * to + bend * ((a * a * a - a) * first + (b * b * b - b) * last);
            let slope = (to - from) / step
                + step / 6.0 * ((1.0 - 3.0 * a * a) * first + (3.0 * b * b - 1.0) * last);
            (value, slope)
        };
        let ([fx, fy], [tx, ty]) = (second(leg), second(leg + 1));
        let ((x_m, dx), (y_m, dy)) = (
            along(from.x_m, to.x_m, fx, tx),
            along(from.y_m, to.y_m, fy, ty),
        );
        Pose {
            x_m,
            y_m,
            heading_rad: dy.atan2(dx),
        }
    }
}

/// Solves a symmetric positive definite system of bandwidth two by its factorisation L D Lᵀ.
#[allow(
    clippy::indexing_slicing,
    reason = "every index is below the length all three share"
)]
fn solve(bands: Vec<[f64; 3]>, mut right: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    let n = bands.len();
    let mut factors = bands; // d, l1, l2 of each column
    for i in 0..n {
        if i >= 1 {
            let [d, l1, _] = factors[i - 1];
            factors[i][0] -= d * l1 * l1;
        }
        if i >= 2 {
            let [d, _, l2] = factors[i - 2];
            factors[i][0] -= d * l2 * l2;
        }
        let mut off_diagonal = factors[i][1];
        if i >= 1 {
            let [d, l1, l2] = factors[i - 1];
            off_diagonal -= d * l1 * l2;
        }
        let d = factors[i][0];
        factors[i][1] = off_diagonal / d;
        factors[i][2] /= d;
    }
    for axis in 0..2 {
        for i in 0..n {
            if i >= 1 {
                right[i][axis] -= factors[i - 1][1] * right[i - 1][axis];
            }
            if i >= 2 {
                right[i][axis] -= factors[i - 2][2] * right[i - 2][axis];
            }
        }
        for i in 0..n {
            right[i][axis] /= factors[i][0];
        }
        for i in (0..n).rev() {
            if i + 1 < n {
                right[i][axis] -= factors[i][1] * right[i + 1][axis];
            }
            if i + 2 < n {
                right[i][axis] -= factors[i][2] * right[i + 2][axis];
            }
        }
    }
    right
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Creates a left bend of 20 m radius between straights, sampled at a spacing.
    fn bend(spacing_m: f64) -> (Road, Road) {
        let segment = |length_m: f64, turn_rad: f64| super::super::Segment {
            length_m,
            turn_rad,
            surveyed: true,
        };
        let segments = [segment(30.0, 0.0), segment(30.0, 1.5), segment(30.0, 0.0)];
        let exact = Road::from_segments(Pose::default(), &segments, 4.0).unwrap();
        let count = (90.0 / spacing_m).round() as u32;
        let points: Vec<Point> = (0..=count)
            .map(|it| exact.pose(f64::from(it) * 90.0 / f64::from(count)).point())
            .collect();
        let made = Road::through_points(&points, 0.01, 4.0).unwrap();
        (exact, made)
    }

    #[test]
    fn a_sampled_bend_is_the_bend_at_any_spacing() {
        for (spacing_m, max_m) in [(0.5, 0.03), (1.0, 0.03), (2.0, 0.04), (5.0, 0.12)] {
            let (exact, made) = bend(spacing_m);
            for step in 0..=180 {
                let place = exact.pose(0.5 * f64::from(step)).point();
                let off_m = made.project(place).lateral_m.abs();
                assert!(off_m < max_m, "{spacing_m}: {off_m} at {step}");
            }
            assert!((made.length_m() - 90.0).abs() < 0.1, "{}", made.length_m());
        }
    }

    #[test]
    fn long_legs_stay_straight_and_corners_are_rounded() {
        let points = [
            [0.0, 0.0],
            [100.0, 0.0],
            [100.0, 80.0],
            [103.0, 90.0],
            [140.0, 200.0],
        ];
        let road = Road::through_points(&points.map(Point::from), 0.02, 4.0).unwrap();
        for (x_m, y_m) in [(50.0, 0.0), (85.0, 0.0), (100.0, 40.0), (121.5, 145.0)] {
            let off_m = road.project(Point::new(x_m, y_m)).lateral_m;
            assert!(off_m.abs() < 0.3, "{x_m} {y_m}: {off_m}");
        }
        let corner_m = road.project(Point::new(100.0, 0.0)).lateral_m;
        assert!(corner_m.abs() < 2.5, "{corner_m}");
    }
}
