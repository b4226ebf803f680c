//! A spectrum at the points of a grid.
//!
//! The grid is uniform in the electrical angle, where the array resolves equally well everywhere, and
//! has the asked-for step at broadside.

use std::f64::consts::{PI, TAU};

use num_complex::Complex64;

use super::polynomial::Spectrum;
use crate::simd::instructions::dispatch;
use crate::simd::math::times_plus;

/// Grid points that are computed side by side.
const LANES: usize = 64;

/// A uniform grid of electrical angles on the whole circle.
pub(crate) struct Grid {
    pub(crate) points: usize,
    pub(crate) step: f64,
}

impl Grid {
    /// A grid with steps of `grid_rad` of the angle at broadside, for an array whose electrical angle
    /// at end-fire is `end_fire_rad`.
    pub(crate) fn new<const N: usize>(end_fire_rad: f64, grid_rad: f64) -> Self {
        // At broadside, a step of the angle is end_fire times that of the electrical angle. The
        // array's own resolution sets the coarsest useful grid.
        let points = (TAU / (end_fire_rad * grid_rad)).ceil();
        let points = points.max(8.0 * N as f64);
        Self {
            points: points as usize,
            step: TAU / points,
        }
    }

    /// The electrical angle of a point.
    pub(crate) fn phase(&self, point: usize) -> f64 {
        self.step * point as f64 - PI
    }

    /// All its points, in order.
    pub(crate) fn blocks(&self) -> Blocks<'_> {
        // z = exp(-j omega) of the first block, by doubling.
        let (mut re, mut im) = ([0.0; LANES], [0.0; LANES]);
        Complex64 {
            re: re[0],
            im: im[0],
        } = Complex64::cis(-self.phase(0));
        let mut turn = Complex64::cis(-self.step);
        let mut known = 1;
        while known < LANES {
            for lane in 0..known {
                let next = Complex64::new(re[lane], im[lane]) * turn;
                Complex64 {
                    re: re[lane + known],
                    im: im[lane + known],
                } = next;
            }
            turn *= turn;
            known *= 2;
        }
        Blocks {
            grid: self,
            first: Some(0),
            re,
            im,
            turn,
        }
    }

    /// The point of the grid where the spectrum is largest.
    pub(crate) fn highest_point<const N: usize>(&self, spectrum: &Spectrum<N>) -> usize {
        dispatch!(
            self.highest_point_generic::<false, N>(spectrum),
            self.highest_point_avx2(spectrum),
            self.highest_point_avx512(spectrum)
        )
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,fma")]
    fn highest_point_avx2<const N: usize>(&self, spectrum: &Spectrum<N>) -> usize {
        self.highest_point_generic::<true, N>(spectrum)
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,fma,avx512f")]
    fn highest_point_avx512<const N: usize>(&self, spectrum: &Spectrum<N>) -> usize {
        self.highest_point_generic::<true, N>(spectrum)
    }

    #[inline(always)]
    fn highest_point_generic<const FUSED: bool, const N: usize>(
        &self,
        spectrum: &Spectrum<N>,
    ) -> usize {
        let (mut highest, mut place) = ([f64::NEG_INFINITY; LANES], [0.0; LANES]);
        let mut blocks = self.blocks();
        while let Some(first) = blocks.first {
            let values = blocks.next_values::<FUSED, N>(spectrum);
            let first = first as f64;
            for lane in 0..LANES {
                let better = values[lane] > highest[lane];
                highest[lane] = if better { values[lane] } else { highest[lane] };
                place[lane] = if better { first } else { place[lane] };
            }
        }
        let mut best = 0;
        for lane in 1..LANES {
            if highest[lane] > highest[best] {
                best = lane;
            }
        }
        // The last block may reach beyond the circle, where the first points come again.
        (place[best] as usize + best) % self.points
    }
}

/// The grid, block by block.
pub(crate) struct Blocks<'a> {
    grid: &'a Grid,
    /// First point of the next block; `None` after the last.
    pub(crate) first: Option<usize>,
    re: [f64; LANES],
    im: [f64; LANES],
    /// From block to block.
    turn: Complex64,
}

impl Blocks<'_> {
    /// The spectrum at the points of the next block.
    #[inline(always)]
    pub(crate) fn next_values<const FUSED: bool, const N: usize>(
        &mut self,
        spectrum: &Spectrum<N>,
    ) -> [f64; LANES] {
        let mut values = [0.0; LANES];
        let turn = self.turn;
        for lane in 0..LANES {
            let (re, im) = (self.re[lane], self.im[lane]);
            // Horner's scheme for sum_k c_k z^k.
            let (mut sum_re, mut sum_im) = (0.0, 0.0);
            for k in (1..N).rev() {
                let (a, b) = (sum_re + spectrum.lags[k].re, sum_im + spectrum.lags[k].im);
                sum_re = times_plus::<FUSED>(a, re, -(b * im));
                sum_im = times_plus::<FUSED>(a, im, b * re);
            }
            values[lane] = times_plus::<FUSED>(2.0, sum_re, spectrum.lags[0].re);
            self.re[lane] = times_plus::<FUSED>(re, turn.re, -(im * turn.im));
            self.im[lane] = times_plus::<FUSED>(re, turn.im, im * turn.re);
        }
        self.first = self
            .first
            .map(|first| first + LANES)
            .filter(|next| *next < self.grid.points);
        values
    }
}
