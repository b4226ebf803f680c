//! Moments of the mixture over the jump hypotheses of an angle: the change of every mean and covariance.

use super::jump_process::JumpHypotheses;

/// Covariance of a quantity with an angle that contains the bias of its radio head, and with an
/// angle without this bias.
pub(super) type CrossCovariance = [f64; 2];

/// Update of means and covariances by the mixture over the jump hypotheses of an angle.
pub(super) struct MixtureUpdate<'a> {
    hypotheses: &'a JumpHypotheses,
    /// Residual times gain of each hypothesis: bias retained, bias drawn again.
    steps: [f64; 2],
    /// Steps, multiplied by the probabilities of the hypotheses.
    means: [f64; 2],
    /// Change of the covariance: coefficients of the outer product of each vector with itself.
    squares: [f64; 2],
    /// Change of the covariance: coefficient of the outer products of both vectors.
    product: f64,
    /// Covariance of the bias with the angle before the update (rad²).
    cross_with_angle: f64,
    /// Mean of the bias if it is retained (rad).
    kept_rad: f64,
    /// Mean of a retained bias minus mean of a bias that is drawn again (rad).
    apart_rad: f64,
}

impl<'a> MixtureUpdate<'a> {
    /// Creates the update for the hypotheses of an angle, given the previous mean of the bias and
    /// its covariance with the angle.
    pub fn new(hypotheses: &'a JumpHypotheses, value_rad: f64, cross_with_angle: f64) -> Self {
        let all = [&hypotheses.kept, &hypotheses.redrawn];
        let steps = all.map(|hypothesis| hypothesis.residual * hypothesis.gain);
        // The covariance of a mixture is the mean covariance plus the covariance of the means.
        let both = hypotheses.kept.share * hypotheses.redrawn.share;
        let square = |of: usize| both * steps[of] * steps[of] - all[of].share * all[of].narrowing;
        let kept_rad = value_rad + steps[0] * cross_with_angle;
        Self {
            hypotheses,
            steps,
            means: [all[0].share * steps[0], all[1].share * steps[1]],
            squares: [square(0), square(1)],
            product: -both * steps[0] * steps[1],
            cross_with_angle,
            kept_rad,
            apart_rad: kept_rad - hypotheses.mean_rad,
        }
    }

    /// Returns the change in the mean of a quantity, given its covariance with the angle.
    pub fn step(&self, with: CrossCovariance) -> f64 {
        self.means[0] * with[0] + self.means[1] * with[1]
    }

    /// Returns the change in the covariance of two quantities, given their covariances with the
    /// angle.
    pub fn more(&self, one: CrossCovariance, other: CrossCovariance) -> f64 {
        self.squares[0] * one[0] * other[0]
            + self.squares[1] * one[1] * other[1]
            + self.product * (one[0] * other[1] + one[1] * other[0])
    }

    /// Returns the updated covariance of the bias with another quantity, which was `before`.
    pub fn value_covariance(&self, before: f64, with: CrossCovariance) -> f64 {
        let (kept, redrawn) = (&self.hypotheses.kept, &self.hypotheses.redrawn);
        kept.share * (before - kept.narrowing * self.cross_with_angle * with[0])
            - redrawn.share * self.hypotheses.narrowing * with[1]
            + kept.share
                * redrawn.share
                * self.apart_rad
                * (self.steps[0] * with[0] - self.steps[1] * with[1])
    }

    /// Returns the updated mean of the bias.
    pub fn value_mean(&self) -> f64 {
        self.hypotheses.kept.share * self.kept_rad
            + self.hypotheses.redrawn.share * self.hypotheses.mean_rad
    }

    /// Returns the updated variance of the bias, which was `before`.
    pub fn value_variance(&self, before: f64) -> f64 {
        let (kept, redrawn) = (&self.hypotheses.kept, &self.hypotheses.redrawn);
        kept.share * (before - kept.narrowing * self.cross_with_angle * self.cross_with_angle)
            + redrawn.share * self.hypotheses.variance
            + kept.share * redrawn.share * self.apart_rad * self.apart_rad
    }
}
