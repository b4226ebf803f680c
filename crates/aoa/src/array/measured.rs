//! Manifold from a measurement or a field solver, including element patterns and mutual coupling.

use std::f64::consts::{FRAC_PI_2, TAU};

use num_complex::Complex64;

use super::manifold::{Direction, Manifold};
use crate::error::Error;

/// Table of responses with cubic interpolation.
///
/// The response should change by less than 1 rad between adjacent entries. The interpolation error
/// is at most 1/24 of the fourth power of this change.
#[derive(Debug, Clone, PartialEq)]
pub struct MeasuredManifold<const N: usize> {
    /// Number of azimuths in each row.
    columns: usize,
    rows: usize,
    first_elevation_rad: f64,
    elevation_step_rad: f64,
    /// Responses, row-major (elevation, azimuth).
    responses: Vec<[Complex64; N]>,
}

impl<const N: usize> MeasuredManifold<N> {
    /// Creates a manifold from responses at the azimuths `2 pi i / azimuths` for each of the
    /// equally spaced, ascending elevations. `responses` contains one row of azimuths per
    /// elevation. Elevations between the rows are interpolated; elevations outside use the
    /// outermost row.
    ///
    /// # Errors
    /// [`Error::ManifoldTable`] unless there are at least four azimuths and one elevation, one
    /// finite nonzero response per pair, and elevations as described.
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
                "it needs at least four azimuths and one response per azimuth and elevation",
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

    /// Computes the resolution from the largest change between adjacent entries.
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
                let neighbour = &self.responses[row * self.columns + (column + 1) % self.columns];
                // At the zenith, all azimuths are one direction.
                if apart > 1e-3 {
                    compare(here, neighbour, apart);
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

/// Returns the Lagrange weights of values at 0, 1 .. `count` - 1 for the position `x`; four values
/// give a cubic.
fn lagrange(count: usize, x: f64) -> [f64; 4] {
    let mut weights = [0.0; 4];
    for (i, weight) in weights.iter_mut().take(count).enumerate() {
        let others = (0..count).filter(|j| *j != i);
        let factors = others.map(|j| (x - j as f64) / (i as f64 - j as f64));
        *weight = factors.product();
    }
    weights
}
