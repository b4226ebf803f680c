//! How probable an angle is under a mode, and when a decision between modes is made by that.

use std::f64::consts::TAU;

use crate::gaussian::with_outliers;
use crate::localize::ekf::{Ekf, PredictedMeasurement};
use crate::localize::output::UpdateReason;
use crate::observation::AngleMeasurement;
use crate::radio_head::RadioHead;

impl Ekf {
    /// Returns the log-likelihood of an angle relative to an angle with its own noise alone that is predicted exactly. With
    /// estimated biases the likelihood contains them, and angles within 2 m of travel count by their independent share.
    pub fn relative_log_likelihood(&self, head: &RadioHead, measured: &AngleMeasurement) -> f64 {
        log_likelihood(self, &self.predict_measurement(head, measured))
    }
}

/// Share of the angles that are outliers, from any direction, where scatter makes no more of them.
const OUTLIERS: f64 = 2e-3;

/// Odds to the nominal mode from which on a mode is selected. The level covers every hypothesis, selected or not; a
/// selection at lower odds moves the position back and forth and costs availability (K = 5 dB: 91 instead of 94 %).
pub(super) const LEAST_ODDS: f64 = 100.0;

/// Logarithm of a likelihood ratio at which a sequential test is decided: wrong once in three million (e⁻¹⁵; Wald 1945),
/// as a fault of a radio head has it. No mode's grows beyond: what more evidence there is must be forgotten some time.
pub(in crate::localize) const CERTAIN: f64 = 15.0;

/// That of a jump of the speed that no vehicle can do: slip, unless a reading is wild.
pub(super) const SPEED_JUMP: f64 = 6.0;

/// Logarithm of the likelihood ratio of a mode to the nominal one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LikelihoodRatio(f64);

impl LikelihoodRatio {
    /// One to one.
    pub const NONE: Self = Self(0.0);

    /// That to another mode of this ratio.
    pub const fn to(self, other: Self) -> Self {
        Self((self.0 - other.0).clamp(-CERTAIN, CERTAIN))
    }

    /// Whether the angles speak against the mode.
    pub const fn is_against(self) -> bool {
        self.0 < 0.0
    }

    /// From now on it is at least so much.
    pub const fn raise_to(&mut self, least: f64) {
        self.0 = self.0.max(least);
    }

    /// Takes in an angle, which the mode's filter and the nominal one predict so.
    pub fn update(
        &mut self,
        (ekf, predicted): (&Ekf, &Result<PredictedMeasurement, UpdateReason>),
        (nominal, by_nominal): (&Ekf, &Result<PredictedMeasurement, UpdateReason>),
    ) {
        if let (Ok(predicted), Ok(by_nominal)) = (predicted, by_nominal)
            && !(predicted.excluded || by_nominal.excluded)
        {
            let ratio = density(ekf, predicted) / density(nominal, by_nominal);
            let share = independent_share(ekf, predicted);
            let share = share.min(independent_share(nominal, by_nominal));
            self.0 = (self.0 + share * ratio.ln()).max(-CERTAIN);
        }
    }

    /// The larger of the two.
    pub const fn max(self, other: Self) -> Self {
        Self(self.0.max(other.0))
    }

    /// Takes off what the largest of all modes has beyond certainty, so that any other may yet be found right.
    pub const fn limit_by(&mut self, most: Self) {
        self.0 = (self.0 - (most.0 - CERTAIN).max(0.0)).max(-CERTAIN);
    }

    /// Posterior odds to the nominal mode, of a prior probability.
    pub fn odds(self, prior: f64) -> f64 {
        prior / (1.0 - prior) * self.0.exp()
    }
}

/// Log-likelihood of an angle, relative to one that has but its own noise and is predicted exactly: so places can be
/// compared.
///
/// Angles that are not independent have a variance that says so: they cost nothing, however that
/// variance differs from place to place. Where a time-correlated bias is estimated, an angle counts
/// by its independent share. Angles that the gate refuses, or of an excluded radio head, are outliers.
pub(in crate::localize) fn log_likelihood(
    ekf: &Ekf,
    predicted: &Result<PredictedMeasurement, UpdateReason>,
) -> f64 {
    let Ok(predicted) = predicted else {
        return 0.0;
    };
    if ekf.is_with_bias() {
        let jumps = predicted.hypotheses.as_ref();
        let density = jumps.map_or(TAU.recip(), |jumps| jumps.density);
        let exact = (TAU * predicted.own_variance).sqrt().recip();
        return predicted.independent_share() * (density / exact).ln();
    }
    let innovation = predicted.innovation;
    if predicted.excluded || innovation.mahalanobis2() > ekf.config().gate {
        return (OUTLIERS / TAU).ln();
    }
    let growth = innovation.variance / innovation.measurement_variance;
    -0.5 * (innovation.mahalanobis2() + growth.ln())
}

/// The same where what a place does not know well counts against it: the bend of its prediction and its odometry are its
/// own, not the angle's noise. By the other measure a place so vague that it explains everything costs nothing.
pub(in crate::localize) fn log_likelihood_as_stated(
    ekf: &Ekf,
    predicted: &Result<PredictedMeasurement, UpdateReason>,
) -> f64 {
    match predicted {
        Ok(angle) if !(ekf.is_with_bias() || angle.excluded) => {
            let own = angle.bend_variance + angle.coasted_variance;
            let exact = TAU * (angle.innovation.measurement_variance - own);
            (with_outliers(angle.innovation.density(), OUTLIERS) * exact.sqrt()).ln()
        }
        _ => log_likelihood(ekf, predicted),
    }
}

/// Variance (rad²) of an angle by all but the belief, were the radio head not heard before.
fn first_variance(ekf: &Ekf, predicted: &PredictedMeasurement) -> f64 {
    ekf.first_variance(predicted) + ekf.systematic_variance(predicted)
}

/// Share of an angle that is independent of the radio head's last one; a filter that estimates a time-correlated bias
/// predicts what repeats itself.
fn independent_share(ekf: &Ekf, predicted: &PredictedMeasurement) -> f64 {
    if predicted.hypotheses.is_some() {
        return 1.0;
    }
    first_variance(ekf, predicted) / predicted.innovation.measurement_variance
}

/// Probability density of an angle (1/rad): Gaussian, or an outlier from anywhere.
fn density(ekf: &Ekf, predicted: &PredictedMeasurement) -> f64 {
    let inlier = predicted.hypotheses.as_ref().map_or_else(
        || {
            // The measurement variance of one that repeats another would drown the belief's.
            let mut alone = predicted.innovation;
            let belief = (alone.variance - alone.measurement_variance).max(0.0);
            alone.variance = belief + first_variance(ekf, predicted);
            alone.density()
        },
        |hypotheses| hypotheses.density,
    );
    let outliers = ekf.config().wrong_lobe.unwrap_or(OUTLIERS);
    with_outliers(inlier, outliers)
}
