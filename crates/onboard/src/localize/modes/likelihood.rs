//! Likelihood of an angle under a mode, and thresholds for decisions between modes.

use std::f64::consts::TAU;

use crate::gaussian::{Innovation, with_outliers};
use crate::localize::bias::share;
use crate::localize::ekf::{
    Ekf, OUTLIERS, PredictedMeasurement, PredictedRange, with_range_outliers,
};
use crate::localize::output::UpdateReason;
use crate::observation::AngleMeasurement;
use crate::radio_head::RadioHead;
use crate::range::RangeMeasurement;

/// Evidence of an angle about the state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AngleEvidence {
    /// Innovation of the electrical angle (rad), without the time-correlated bias.
    pub innovation: Innovation,
    /// Innovation given that the bias is retained, and that it is drawn again; the variances include the probability
    /// of either. If no bias is estimated, the first has an infinite variance, and the second is `innovation`.
    pub given_bias: [Innovation; 2],
    /// Log-likelihood, minus that of an exactly predicted angle with its own noise only. If biases are estimated, the
    /// likelihood includes them. Angles within 2 m of travel are then weighted by their independent fraction.
    pub relative_log_likelihood: f64,
}

impl Ekf {
    /// Returns what an angle says about the state before its update; `None` if it cannot be predicted.
    pub fn angle_evidence(
        &self,
        head: &RadioHead,
        measured: &AngleMeasurement,
    ) -> Option<AngleEvidence> {
        let predicted = self.predict_measurement(head, measured);
        let relative_log_likelihood = log_likelihood(self, &predicted);
        let predicted = predicted.ok().filter(|predicted| !predicted.excluded)?;
        let innovation = predicted.innovation;
        let without_information = Innovation {
            variance: f64::INFINITY,
            ..innovation
        };
        let given_bias = (predicted.hypotheses.as_ref())
            .map_or([without_information, innovation], |jumps| {
                jumps.innovations(&innovation)
            });
        Some(AngleEvidence {
            innovation,
            given_bias,
            relative_log_likelihood,
        })
    }

    /// Returns the log-likelihood of a range in metres; 0 if the range is unusable.
    pub fn range_log_likelihood(&self, head: &RadioHead, measured: &RangeMeasurement) -> f64 {
        let predicted = self.predict_range(head, measured);
        predicted.map_or(0.0, |it| range_density(&it, it.late_probability()).ln())
    }
}

/// Minimum posterior odds, against the nominal mode or, for a fault, all other modes, for the selection of a mode. The
/// protection level covers every hypothesis, whether selected or not. With lower odds, the position alternates
/// between filters, which reduces the availability (K = 5 dB: 91 % instead of 94 %).
pub(super) const MIN_ODDS: f64 = 100.0;

/// Log-likelihood ratio at which a sequential test decides. The error probability of the decision is
/// e⁻¹⁵, one in three million (Wald 1945). The log-likelihood ratios of modes are limited to this
/// value, so that later evidence can reverse a decision.
pub(in crate::localize) const CERTAIN: f64 = 15.0;

/// Log-likelihood ratio of wheel slip after a physically impossible jump of the speed. The
/// alternative is an outlier of the speed measurement.
pub(super) const SPEED_JUMP: f64 = 6.0;

/// A filter and its prediction of an angle.
pub(super) type Prediction<'a> = (&'a Ekf, &'a Result<PredictedMeasurement, UpdateReason>);

/// Logarithm of the likelihood ratio of a mode to the nominal one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LikelihoodRatio(f64);

impl LikelihoodRatio {
    /// Ratio of one.
    pub const NONE: Self = Self(0.0);

    /// Returns the ratio to another mode, whose ratio to the nominal mode is `other`.
    pub const fn to(self, other: Self) -> Self {
        Self((self.0 - other.0).clamp(-CERTAIN, CERTAIN))
    }

    /// Returns the logarithm.
    pub const fn value(self) -> f64 {
        self.0
    }

    /// Whether the angles contradict the mode.
    pub const fn is_against(self) -> bool {
        self.0 < 0.0
    }

    /// Raises the ratio to a minimum.
    pub const fn raise_to(&mut self, least: f64) {
        self.0 = self.0.max(least);
    }

    /// Updates with an angle, given the predictions of the mode's filter and of the nominal filter.
    pub fn update(
        &mut self,
        (ekf, predicted): Prediction,
        (nominal, by_nominal): Prediction,
        information_fraction: fn(&Ekf, &PredictedMeasurement) -> f64,
    ) {
        if let (Ok(predicted), Ok(by_nominal)) = (predicted, by_nominal)
            && !(predicted.excluded || by_nominal.excluded)
        {
            let ratio = density(ekf, predicted) / density(nominal, by_nominal);
            let share = information_fraction(ekf, predicted);
            let share = share.min(information_fraction(nominal, by_nominal));
            self.0 = (self.0 + share * ratio.ln()).max(-CERTAIN);
        }
    }

    /// Updates with a range, given the predictions of the mode's filter and of the nominal filter.
    pub fn update_range(
        &mut self,
        predicted: &Result<PredictedRange, UpdateReason>,
        by_nominal: &Result<PredictedRange, UpdateReason>,
    ) {
        if let (Ok(predicted), Ok(by_nominal)) = (predicted, by_nominal)
            && !(predicted.excluded || by_nominal.excluded)
            && !(predicted.is_new_sequence || by_nominal.is_new_sequence)
        {
            let [mine, nominal] = [predicted, by_nominal].map(|it| range_density(it, OUTLIERS));
            let ratio = mine / nominal;
            let share = (predicted.information_fraction).min(by_nominal.information_fraction);
            self.0 = (self.0 + share * ratio.ln()).max(-CERTAIN);
        }
    }

    /// Returns the larger ratio.
    pub const fn max(self, other: Self) -> Self {
        Self(self.0.max(other.0))
    }

    /// Subtracts the amount by which the largest ratio `most` exceeds [`CERTAIN`], so that another
    /// mode can still be selected later.
    pub const fn limit_by(&mut self, most: Self) {
        self.0 = (self.0 - (most.0 - CERTAIN).max(0.0)).max(-CERTAIN);
    }

    /// Returns the posterior odds to the nominal mode for a prior probability.
    pub fn odds(self, prior: f64) -> f64 {
        prior / (1.0 - prior) * self.0.exp()
    }
}

/// Returns the log-likelihood of an angle, minus that of an exactly predicted angle with its own
/// noise only. Positions can be compared by the sum of these values.
///
/// A dependent angle has an increased measurement variance, and the increase differs between
/// positions. Both log-likelihoods use this variance, so that the increase cancels. If a
/// time-correlated bias is estimated, an angle is weighted by its independent fraction instead.
/// Angles outside the gate, and angles of an excluded radio head, are treated as outliers.
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
        return predicted.information_fraction() * (density / exact).ln();
    }
    let innovation = predicted.innovation;
    if predicted.excluded || innovation.mahalanobis2() > ekf.config().gate {
        return (OUTLIERS / TAU).ln();
    }
    let growth = innovation.variance / innovation.measurement_variance;
    -0.5 * (innovation.mahalanobis2() + growth.ln())
}

/// Returns the log-likelihood of an angle, reduced by the uncertainty of the hypothesis: the
/// variances of second-order terms and of the odometry count as uncertainty of the prediction, not
/// as noise of the angle. In contrast, [`log_likelihood`] does not penalise a hypothesis that is so
/// uncertain that every angle agrees with it.
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

/// Returns the probability density of a range (1/m) with this fraction of outliers, or the usual one if it is larger. The density
/// of an outlier is uniform:
/// the ranges of a blocked path are late by nearly the same distance, so that with another density, each of them would be
/// evidence for a position.
pub(in crate::localize) fn range_density(predicted: &PredictedRange, outliers: f64) -> f64 {
    with_range_outliers(predicted.innovation.density(), outliers.max(OUTLIERS))
}

/// Returns the variance (rad²) of an angle without the state covariance, for the first angle of a
/// radio head.
fn first_variance(ekf: &Ekf, predicted: &PredictedMeasurement) -> f64 {
    ekf.first_variance(predicted) + predicted.systematic_variance()
}

/// Returns the fraction of an angle that is independent of the previous one of its radio head. A
/// filter that estimates a time-correlated bias predicts the dependent part, except the short-lived
/// error. The filter's gain is reduced by the same fraction.
pub(super) fn information_fraction(ekf: &Ekf, predicted: &PredictedMeasurement) -> f64 {
    if predicted.hypotheses.is_some() {
        return share(predicted.moved.0.abs());
    }
    conditional_fraction(ekf, predicted)
}

/// Returns the fraction of an angle that is independent given the estimated biases: 1 if the filter
/// estimates biases. The short-lived error is not considered. This fraction is used by short
/// sequential tests, whose threshold was measured with it.
pub(super) fn conditional_fraction(ekf: &Ekf, predicted: &PredictedMeasurement) -> f64 {
    if predicted.hypotheses.is_some() {
        return 1.0;
    }
    first_variance(ekf, predicted) / predicted.innovation.measurement_variance
}

/// Returns the probability density of an angle (1/rad): Gaussian, or a uniformly distributed
/// outlier.
fn density(ekf: &Ekf, predicted: &PredictedMeasurement) -> f64 {
    let inlier = predicted.hypotheses.as_ref().map_or_else(
        || {
            // The variance of a repeated angle is inflated, because it repeats earlier errors. Use
            // the variance of a first angle instead.
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
