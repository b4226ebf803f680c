//! A manifold that was measured, or computed by a field solver: with the patterns of the elements and
//! the coupling between them.

use std::f64::consts::{FRAC_PI_2, TAU};

use num_complex::Complex64;

use super::manifold::{Direction, Manifold};
use crate::error::Error;

/// A table of responses, interpolated by cubics.
///
/// The interpolation is good where the response changes by less than a radian from one entry to the
/// next: its error is at most a twenty-fourth of the fourth power of that change.
#[derive(Debug, Clone, PartialEq)]
pub struct MeasuredManifold<const N: usize> {
    /// Azimuths in each row.
    columns: usize,
    rows: usize,
    first_elevation_rad: f64,
    elevation_step_rad: f64,
    /// Row-major (elevation, azimuth).
    responses: Vec<[Complex64; N]>,
}

impl<const N: usize> MeasuredManifold<N> {
    /// Responses at `azimuths` azimuths `2 pi i / azimuths` for each of the elevations, which are equally
    /// spaced and ascend: `responses` holds one row of azimuths per elevation. Between the rows it is
    /// interpolated; beyond them the outermost row holds.
    ///
    /// # Errors
    /// [`Error::ManifoldTable`] unless there are at least four azimuths and one elevation, as many
    /// responses as both make, all finite and none zero, and elevations as said.
    pub fn new(
        azimuths: usize,
        elevations_rad: &[f64],
        responses: Vec<[Complex64; N]>,
    ) -> Result<Self, Error> {
        const { assert!(N >= 2 && N <= 16, "an array has two to sixteen antennas") };
        let rows = elevations_rad.len();
        let refused = |why| Err(Error::ManifoldTable(why));
        if azimuths < 4 || rows == 0 || azimuths.checked_mul(rows) != Some(responses.len()) {
            return refused(
                "it needs four azimuths or more, and one response for each and elevation",
            );
        }
        let power =
            |response: &[Complex64; N]| response.iter().map(Complex64::norm_sqr).sum::<f64>();
        if !responses.iter().map(power).all(f64::is_normal) {
            return refused("responses must be finite and not zero");
        }
        let step = elevations_rad
            .get(1)
            .map_or(1.0, |it| it - elevations_rad[0]);
        let regular = elevations_rad.iter().enumerate().all(|(row, elevation)| {
            let expected = elevations_rad[0] + step * row as f64;
            (elevation - expected).abs() <= 1e-6 * step && elevation.abs() <= FRAC_PI_2 + 1e-9
        });
        if !(regular && step > 0.0) {
            return refused("elevations must ascend in equal steps between -pi/2 and pi/2");
        }
        Ok(Self {
            columns: azimuths,
            rows,
            first_elevation_rad: elevations_rad[0],
            elevation_step_rad: step,
            responses,
        })
    }

    fn row(&self, row: usize, column: f64) -> [Complex64; N] {
        let before = column.floor();
        let weights = lagrange(4, 1.0 + column - before);
        let first = before as usize + self.columns - 1;
        let mut sum = [Complex64::ZERO; N];
        for (i, weight) in weights.iter().enumerate() {
            let entry = &self.responses[row * self.columns + (first + i) % self.columns];
            add(&mut sum, entry, *weight);
        }
        sum
    }
}

impl<const N: usize> Manifold<N> for MeasuredManifold<N> {
    fn response(&self, direction: Direction) -> [Complex64; N] {
        let turn = (direction.azimuth_rad / TAU).rem_euclid(1.0);
        let column = turn * self.columns as f64;
        let last = (self.rows - 1) as f64;
        let row = (direction.elevation_rad - self.first_elevation_rad) / self.elevation_step_rad;
        let row = row.clamp(0.0, last);
        let count = self.rows.min(4);
        let first = (row.floor() - 1.0).clamp(0.0, (self.rows - count) as f64);
        let mut sum = [Complex64::ZERO; N];
        let weights = lagrange(count, row - first);
        for (i, weight) in weights.iter().take(count).enumerate() {
            add(&mut sum, &self.row(first as usize + i, column), *weight);
        }
        sum
    }

    /// From the largest change between neighbours in the table.
    fn resolution_rad(&self) -> f64 {
        let mut fastest: f64 = 0.0;
        let mut compare = |a: &[Complex64; N], b: &[Complex64; N], angle_rad: f64| {
            let power = a.iter().map(Complex64::norm_sqr).sum::<f64>() / N as f64;
            let changes = a.iter().zip(b).map(|(a, b)| (a - b).norm_sqr());
            fastest = fastest.max((changes.fold(0.0, f64::max) / power).sqrt() / angle_rad);
        };
        for row in 0..self.rows {
            let elevation_rad = self.first_elevation_rad + self.elevation_step_rad * row as f64;
            let apart = TAU / self.columns as f64 * elevation_rad.cos();
            for column in 0..self.columns {
                let here = &self.responses[row * self.columns + column];
                let beside = &self.responses[row * self.columns + (column + 1) % self.columns];
                // Overhead all azimuths are one direction.
                if apart > 1e-3 {
                    compare(here, beside, apart);
                }
                if row + 1 < self.rows {
                    let above = &self.responses[(row + 1) * self.columns + column];
                    compare(here, above, self.elevation_step_rad);
                }
            }
        }
        1.0 / fastest.max(1e-3)
    }
}

fn add<const N: usize>(sum: &mut [Complex64; N], entry: &[Complex64; N], weight: f64) {
    for (sum, element) in sum.iter_mut().zip(entry) {
        *sum += element * weight;
    }
}

/// Lagrange's weights of values at 0, 1 .. `count` - 1 for the place `x`; four values make a cubic.
fn lagrange(count: usize, x: f64) -> [f64; 4] {
    let mut weights = [0.0; 4];
    for (i, weight) in weights.iter_mut().take(count).enumerate() {
        let others = (0..count).filter(|j| *j != i);
        let factors = others.map(|j| (x - j as f64) / (i as f64 - j as f64));
        *weight = factors.product();
    }
    weights
}
