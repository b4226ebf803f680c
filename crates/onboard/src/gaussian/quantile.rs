//! Radial quantile of a Gaussian error in the plane.

use std::f64::consts::FRAC_PI_2;
use std::sync::{Mutex, PoisonError};

/// Number of nodes for the ratio of the error ellipse's axes.
const NODES: usize = 33;

/// Number of quadrature points over a quarter turn.
const QUADRATURE: usize = 400;

/// Number of exceedance probabilities whose tables are stored. A process uses a few.
const STORED: usize = 8;

/// Radius that a zero-mean Gaussian error in the plane exceeds with a given probability, in units
/// of the larger standard deviation. It depends on the ratio ρ of the two standard deviations, and
/// is interpolated in a table over ρ.
#[derive(Clone, Debug, PartialEq)]
pub struct RadialQuantile {
    factors: [f64; NODES],
}

impl RadialQuantile {
    /// Returns the table for an exceedance probability in (0, 1). A table is computed once, because this takes 7 ms, and
    /// every simulated run needs several.
    pub fn new(risk: f64) -> Self {
        static KNOWN: Mutex<[Option<(f64, RadialQuantile)>; STORED]> =
            Mutex::new([const { None }; STORED]);
        let mut known = KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, table)) = known.iter().flatten().find(|it| it.0 == risk) {
            return table.clone();
        }
        let table = Self::computed(risk);
        if let Some(free) = known.iter_mut().find(|it| it.is_none()) {
            *free = Some((risk, table.clone()));
        }
        table
    }

    fn computed(risk: f64) -> Self {
        let mut factors = [0.0; NODES];
        for (node, factor) in factors.iter_mut().enumerate() {
            *factor = radius(node as f64 / (NODES - 1) as f64, risk);
        }
        Self { factors }
    }

    /// Returns the radius for an error with these variances along its principal axes, larger first.
    pub fn radius(&self, variances: [f64; 2]) -> f64 {
        let [large, small] = variances;
        if large <= 0.0 {
            return 0.0;
        }
        let place = (small / large).clamp(0.0, 1.0).sqrt() * (NODES - 1) as f64;
        let node = (place as usize).min(NODES - 2);
        let share = place - node as f64;
        match self.factors.get(node..node + 2) {
            Some([left, right]) => (left + share * (right - left)) * large.sqrt(),
            _ => 0.0,
        }
    }
}

/// Returns the value that a standard normal variable exceeds with the given probability, in (0,
/// 0.5].
pub fn normal_quantile(risk: f64) -> f64 {
    radius(0.0, 2.0 * risk)
}

/// Returns the `k` for which [`exceedance`] is `risk`, by bisection.
fn radius(ratio: f64, risk: f64) -> f64 {
    let risk = risk.clamp(1e-15, 1.0);
    let variances = variances(ratio);
    let (mut low, mut high) = (0.0, 10.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if middle == low || middle == high {
            break; // No number is between them any more.
        }
        if exceedance(&variances, middle) > risk {
            low = middle;
        } else {
            high = middle;
        }
    }
    high
}

/// Returns `cos² t + ρ² sin² t` at the quadrature points. Computed once per table entry, because
/// [`exceedance`] is evaluated thousands of times and the sines would take half of that time.
fn variances(ratio: f64) -> [f64; QUADRATURE] {
    let step = FRAC_PI_2 / QUADRATURE as f64;
    std::array::from_fn(|i| {
        let (sin, cos) = ((i as f64 + 0.5) * step).sin_cos();
        cos * cos + ratio * ratio * sin * sin
    })
}

/// Returns `P(|e| > k σ₁)` for the standard deviations σ₁ and ρσ₁, by Craig's formula for an
/// ellipse: `2/π ∫₀^{π/2} exp(−k² / (2 (cos² t + ρ² sin² t))) dt`. It equals `2 Q(k)` for ρ = 0 and
/// `exp(−k²/2)` for ρ = 1.
fn exceedance(variances: &[f64; QUADRATURE], k: f64) -> f64 {
    let step = FRAC_PI_2 / QUADRATURE as f64;
    let sum: f64 = (variances.iter())
        .map(|variance| (-0.5 * k * k / variance).exp())
        .sum();
    sum * step / FRAC_PI_2
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_of_line_and_circle_equal_textbook_values() {
        for (risk, line, circle) in [
            (0.05, 1.959_964, 2.447_747),
            (1e-3, 3.290_527, 3.716_922),
            (1e-7, 5.326_724, 5.677_690),
        ] {
            let quantile = RadialQuantile::new(risk);
            assert!((quantile.radius([4.0, 0.0]) / 2.0 - line).abs() < 1e-3);
            assert!((quantile.radius([4.0, 4.0]) / 2.0 - circle).abs() < 1e-3);
        }
    }

    #[test]
    fn normal_quantiles_equal_textbook_values() {
        for (risk, quantile) in [(0.5, 0.0), (0.025, 1.959_964), (5e-5, 3.890_592)] {
            assert!((normal_quantile(risk) - quantile).abs() < 1e-3);
        }
    }

    #[test]
    fn the_radius_increases_with_the_smaller_axis() {
        let quantile = RadialQuantile::new(1e-3);
        let radii: Vec<f64> = (0..=100)
            .map(|i| quantile.radius([1.0, f64::from(i) * 0.01]))
            .collect();
        assert!(radii.windows(2).all(|pair| pair[1] >= pair[0]));
    }

    #[test]
    fn the_radius_of_a_zero_covariance_is_zero() {
        assert_eq!(RadialQuantile::new(1e-3).radius([0.0, 0.0]), 0.0);
    }
}
