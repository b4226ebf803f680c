//! What an angle with an error that stays makes of state and errors: the mean and covariance of the mixture
//! over the pasts that it may have had.

use super::staying_error::Pasts;

/// How something varies with an angle: with the value of its radio head, and without.
pub(super) type WithAngle = [f64; 2];

/// What an angle makes of means and covariances.
pub(super) struct Change<'a> {
    pasts: &'a Pasts,
    /// By how much each past moves what varies with the angle, and both on average.
    steps: [f64; 2],
    means: [f64; 2],
    /// What covariances grow by, by both vectors: the squares, and the product.
    squares: [f64; 2],
    product: f64,
    /// How the value varies with the angle, what it is where it is kept, and by how much it is another one
    /// where it is not.
    with_angle: f64,
    kept_rad: f64,
    apart_rad: f64,
}

impl<'a> Change<'a> {
    /// By an angle that may have come about so, which the value, until then of this mean, varies with so.
    pub fn new(pasts: &'a Pasts, value_rad: f64, with_angle: f64) -> Self {
        let all = [&pasts.kept, &pasts.anew];
        let steps = all.map(|past| past.residual * past.gain);
        // The mixture's covariance is that of its parts and of their means.
        let both = pasts.kept.share * pasts.anew.share;
        let square = |of: usize| both * steps[of] * steps[of] - all[of].share * all[of].narrowing;
        let kept_rad = value_rad + steps[0] * with_angle;
        Self {
            pasts,
            steps,
            means: [all[0].share * steps[0], all[1].share * steps[1]],
            squares: [square(0), square(1)],
            product: -both * steps[0] * steps[1],
            with_angle,
            kept_rad,
            apart_rad: kept_rad - pasts.mean_rad,
        }
    }

    /// By how much the mean moves of what varies so with the angle.
    pub fn step(&self, with: WithAngle) -> f64 {
        self.means[0] * with[0] + self.means[1] * with[1]
    }

    /// By how much the covariance grows of what varies so and so with the angle.
    pub fn more(&self, one: WithAngle, other: WithAngle) -> f64 {
        self.squares[0] * one[0] * other[0]
            + self.squares[1] * one[1] * other[1]
            + self.product * (one[0] * other[1] + one[1] * other[0])
    }

    /// The covariance of the value with anything else.
    pub fn with_value(&self, before: f64, with: WithAngle) -> f64 {
        let (kept, anew) = (&self.pasts.kept, &self.pasts.anew);
        kept.share * (before - kept.narrowing * self.with_angle * with[0])
            - anew.share * self.pasts.narrowing * with[1]
            + kept.share
                * anew.share
                * self.apart_rad
                * (self.steps[0] * with[0] - self.steps[1] * with[1])
    }

    /// The mean of the value.
    pub fn value_mean(&self) -> f64 {
        self.pasts.kept.share * self.kept_rad + self.pasts.anew.share * self.pasts.mean_rad
    }

    /// The variance of the value, which was `before`.
    pub fn value_variance(&self, before: f64) -> f64 {
        let (kept, anew) = (&self.pasts.kept, &self.pasts.anew);
        kept.share * (before - kept.narrowing * self.with_angle * self.with_angle)
            + anew.share * self.pasts.variance
            + kept.share * anew.share * self.apart_rad * self.apart_rad
    }
}
