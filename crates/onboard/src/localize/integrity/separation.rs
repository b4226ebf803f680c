//! How far from the estimate the vehicle may be when another estimate is the right one.

use std::f64::consts::TAU;

use crate::localize::gaussian::principal_variances;
use crate::localize::quantile::RadialQuantile;

/// Directions over which the probability is summed.
const DIRECTIONS: usize = 48;

/// Share of the radius to which it is found; it is rounded up.
const ACCURACY: f64 = 2e-3;

/// Radius around the estimate that the true place leaves with a stated risk, given that it is
/// Gaussian about a point some way off.
///
/// This is what solution separation asks for, exactly. Adding the separation to the radius about
/// the other estimate, as is usual, is an upper limit of it.
#[derive(Clone, Debug)]
pub struct SeparatedRadius {
    about_itself: RadialQuantile,
    directions: [[f64; 2]; DIRECTIONS],
}

impl SeparatedRadius {
    /// The radius for risks from one in (0, 0.5) on.
    pub fn new(least_risk: f64) -> Self {
        let mut directions = [[0.0; 2]; DIRECTIONS];
        for (number, direction) in directions.iter_mut().enumerate() {
            let (sin, cos) = (TAU * number as f64 / DIRECTIONS as f64).sin_cos();
            *direction = [cos, sin];
        }
        Self {
            about_itself: RadialQuantile::new(least_risk),
            directions,
        }
    }

    /// The radius at a risk below 0.5 for a place of covariance `[[xx, xy], [xy, yy]]` (m²) about a point
    /// `separation_m` off, or `least_m` where that is larger.
    pub fn radius(
        &self,
        risk: f64,
        separation_m: [f64; 2],
        [[xx, xy], [_, yy]]: [[f64; 2]; 2],
        least_m: f64,
    ) -> f64 {
        let distance_m = separation_m[0].hypot(separation_m[1]);
        let about_itself_m = (self.about_itself).radius(principal_variances(xx, xy, yy));
        // A circle holds less of a Gaussian the further its centre is off (Anderson 1955).
        let mut low = distance_m.max(least_m);
        let mut high = distance_m + about_itself_m;
        if high <= low {
            return low;
        }
        let place = Place::new(separation_m, xx, xy, yy);
        let excess = |radius_m| (self.exceedance(&place, radius_m) / risk).ln();
        let mut at_low = excess(low);
        if at_low <= 0.0 {
            return low;
        }
        let mut at_high = excess(high).clamp(-1e3, 0.0);
        // Regula falsi on the logarithm, which falls about evenly; an end that stays is halved
        // (Illinois), so that both close in.
        while high - low > ACCURACY * high {
            let share = (at_low / (at_low - at_high)).clamp(0.1, 0.9);
            let middle = low + share * (high - low);
            let at_middle = excess(middle).max(-1e3);
            if at_middle > 0.0 {
                (low, at_low, at_high) = (middle, at_middle, 0.5 * at_high);
            } else {
                (high, at_high, at_low) = (middle, at_middle, 0.5 * at_low);
            }
        }
        high
    }

    /// Probability that a place is further than `radius_m` away, its mean being within.
    ///
    /// In polar coordinates about the mean, in which the Gaussian is round, the ray in direction t
    /// leaves the circle at ρ(t), and beyond lies `exp(−ρ²/2)` of what the ray has:
    /// `1/2π ∫ exp(−ρ(t)²/2) dt`.
    fn exceedance(&self, place: &Place, radius_m: f64) -> f64 {
        let [x, y] = place.mean;
        let [first, shared, own] = place.root;
        let room = (radius_m * radius_m - x * x - y * y).max(0.0);
        let beyond = |[cos, sin]: &[f64; 2]| {
            let ray = [first * cos, shared * cos + own * sin];
            let along = x * ray[0] + y * ray[1];
            let square = ray[0] * ray[0] + ray[1] * ray[1];
            if square <= 0.0 {
                return 0.0;
            }
            let exit = ((along * along + square * room).sqrt() - along) / square;
            (-0.5 * exit * exit).exp()
        };
        self.directions.iter().map(beyond).sum::<f64>() / DIRECTIONS as f64
    }
}

/// A Gaussian place as seen from the estimate.
struct Place {
    mean: [f64; 2],
    /// Lower triangular square root of the covariance.
    root: [f64; 3],
}

impl Place {
    fn new(mean: [f64; 2], xx: f64, xy: f64, yy: f64) -> Self {
        let first = xx.max(0.0).sqrt();
        let shared = if first > 0.0 { xy / first } else { 0.0 };
        let own = (yy - shared * shared).max(0.0).sqrt();
        Self {
            mean,
            root: [first, shared, own],
        }
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    use super::*;

    #[test]
    fn without_separation_it_is_the_radial_quantile() {
        for risk in [1e-2, 1e-3] {
            for small in [0.0, 0.04, 0.3, 1.0] {
                let radius = RadialQuantile::new(risk).radius([1.0, small]);
                let separated = SeparatedRadius::new(risk).radius(
                    risk,
                    [1e-6, 0.0],
                    [[1.0, 0.0], [0.0, small]],
                    0.0,
                );
                assert!(
                    (separated / radius - 1.0).abs() < 0.01,
                    "{small} {separated} {radius}"
                );
            }
        }
    }

    #[test]
    fn far_apart_on_a_line_it_is_the_one_sided_quantile() {
        // Φ⁻¹(0.99) = 2.326.
        let radius =
            SeparatedRadius::new(1e-3).radius(1e-2, [3.0, 4.0], [[0.36, 0.48], [0.48, 0.64]], 0.0);
        assert!((radius / 7.326 - 1.0).abs() < 0.005, "{radius}");
    }

    #[test]
    fn as_many_draws_leave_the_circle_as_it_says() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let mut normal = || rng.sample::<f64, _>(StandardNormal);
        let draws = 200_000;
        for (separation, covariance) in [
            ([0.3, -0.2], [[0.09, 0.02], [0.02, 0.04]]),
            ([0.0, 1.5], [[1.0, -0.3], [-0.3, 0.1]]),
            ([0.05, 0.0], [[0.01, 0.0], [0.0, 4e-4]]),
        ] {
            let radius = SeparatedRadius::new(1e-3).radius(1e-2, separation, covariance, 0.0);
            let [[xx, xy], [_, yy]] = covariance;
            let root = Place::new(separation, xx, xy, yy).root;
            let beyond = (0..draws)
                .filter(|_| {
                    let (a, b) = (normal(), normal());
                    let x = separation[0] + root[0] * a;
                    let y = separation[1] + root[1] * a + root[2] * b;
                    x.hypot(y) > radius
                })
                .count();
            // 2000 ± 45 by counting; rounding the radius up by 0.2 % takes off 1.5 %.
            let share = beyond as f64 / 2000.0;
            assert!((0.93..1.07).contains(&share), "{separation:?}: {share}");
        }
    }

    #[test]
    fn exact_knowledge_needs_only_the_separation() {
        let radius = |separation_m, least_m| {
            SeparatedRadius::new(1e-2).radius(1e-2, separation_m, [[0.0; 2]; 2], least_m)
        };
        assert_eq!(radius([0.0, 0.0], 0.0), 0.0);
        assert_eq!(radius([0.3, 0.4], 0.7), 0.7);
        let radius = radius([0.3, 0.4], 0.0);
        assert!((radius - 0.5).abs() < 1e-9, "{radius}");
    }
}
