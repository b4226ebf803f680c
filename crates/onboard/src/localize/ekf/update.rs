//! Measurement update: prediction, innovation, gate, and updated state.

use super::angle_model::{AngleModel, locate};
use super::config::CorrelatedNoise;
use super::filter::{Ekf, Head};
use super::range::BlockedPath;
use super::state::{ACROSS, ALONG, ANGLE_TIME_OFFSET, HEADING, SCALE, STATES, YAW_RATE_BIAS};
use super::white_noise_fraction::Residual;
use crate::gaussian::{Innovation, with_outliers};
use crate::geometry::wrap_angle;
use crate::localize::bias::{self, AngleError, Dependence, JumpHypotheses, MAX_VARIANCE};
use crate::localize::output::{UpdateReason, UpdateResult};
use crate::observation::{AngleMeasurement, MeasurementKind};
use crate::radio_head::RadioHead;

/// Maximum estimated time offset of the angles (s).
const MAX_ANGLE_TIME_OFFSET_S: f64 = 0.5;

/// Probability that an angle is wrong if its estimator does not consider it resolved.
const WRONG_IF_UNRESOLVED: f64 = 0.5;

/// Returns the Gaussian measurement, residual and variance, that is equivalent to an angle which is
/// Gaussian or, with the probability `wrong`, arbitrary. The posterior is a mixture of the updated
/// and the unchanged state (probabilistic data association, Bar-Shalom and Tse 1975); the returned
/// measurement yields its mean and variance. `None` if the mixture is wider than the prior, because
/// the angle then contains no information.
fn equivalent(innovation: &Innovation, wrong: f64) -> Option<(f64, f64)> {
    let (residual, total) = (innovation.residual, innovation.variance);
    let density = innovation.density();
    let holds = (1.0 - wrong) * density / with_outliers(density, wrong);
    // With the gain K = P Hᵀ/S the mixture has the mean p K r and the covariance P − p (S − (1 − p)
    // r²) K Kᵀ, where p is the probability that the angle is correct.
    let narrowing = holds * (total - (1.0 - holds) * residual * residual);
    let equivalent_total = total * total / narrowing;
    let belief = total - innovation.measurement_variance;
    (narrowing > 0.0).then(|| {
        (
            holds * residual * equivalent_total / total,
            equivalent_total - belief,
        )
    })
}

/// Prediction and innovation of an angle.
pub(in crate::localize) struct PredictedMeasurement {
    pub head: usize,
    pub excluded: bool,
    pub place_m: f64,
    pub row: [f64; STATES],
    /// Innovation without the time-correlated bias, if the bias is estimated.
    pub innovation: Innovation,
    /// Variance of the angle's own noise (rad²).
    pub own_variance: f64,
    /// Aperture, as in [`AngleModel`].
    pub aperture: f64,
    /// Direction cosine, as in [`AngleModel`].
    pub direction_cosine: f64,
    /// Variance due to survey errors, as in [`AngleModel`] (rad²).
    pub survey_variance: f64,
    /// Time since the previous update with the radio head (s).
    pub elapsed_s: f64,
    /// Distance (m) and heading change (rad) since the previous update with the radio head.
    pub moved: (f64, f64),
    /// Variance due to the extrapolation beyond the newest odometry sample (rad²).
    pub coasted_variance: f64,
    /// Variance due to the second-order terms of the prediction (rad²).
    pub bend_variance: f64,
    /// Hypotheses for the time-correlated bias, if it is estimated and the radio head is used.
    pub hypotheses: Option<JumpHypotheses>,
}

impl PredictedMeasurement {
    /// Returns the fraction that is independent of the previous angle, if a time-correlated bias is
    /// estimated.
    pub fn information_fraction(&self) -> f64 {
        bias::independent(self.moved.0.abs(), bias::VALUE_M)
    }

    /// Returns the variance of an angle's systematic errors: surveys, odometry since its newest sample, second-order
    /// terms (rad²).
    pub fn systematic_variance(&self) -> f64 {
        self.survey_variance + self.coasted_variance + self.bend_variance
    }
}

impl Ekf {
    /// Returns the radio head of a measurement, and its index.
    ///
    /// # Errors
    /// [`UpdateReason::TooLate`] before the filter's time; [`UpdateReason::UnknownRadioHead`].
    #[inline]
    pub(super) fn head_of(
        &self,
        head: &RadioHead,
        time_s: f64,
    ) -> Result<(usize, &Head), UpdateReason> {
        if time_s < self.time_s() {
            return Err(UpdateReason::TooLate);
        }
        (self.heads.iter().enumerate())
            .find(|(_, mine)| mine.is(head))
            .ok_or(UpdateReason::UnknownRadioHead)
    }

    /// Predicts an angle to a radio head.
    #[inline]
    pub(in crate::localize) fn predict_measurement(
        &self,
        head: &RadioHead,
        measured: &AngleMeasurement,
    ) -> Result<PredictedMeasurement, UpdateReason> {
        let sigma = measured.phase_sigma_rad * self.config.noise_scale().sqrt();
        let usable = measured.time_s.is_finite()
            && measured.phase_rad.is_finite()
            && sigma.is_finite()
            && sigma > 0.0;
        if !usable {
            return Err(UpdateReason::Unusable);
        }
        let (index, head) = self.head_of(head, measured.time_s)?;
        // Between the newest odometry and the angle, the vehicle moves laterally within its lane.
        let (ahead_m, ahead_variance, ahead) = self.coast(measured.time_s);
        let mean = (ahead.as_ref()).map_or(&self.belief.mean, |ahead| &ahead.mean);
        let angle_model = self
            .angle_model(measured.kind, &head.known, mean)
            .ok_or(UpdateReason::Unusable)?;
        let bend = angle_model.bend(&self.belief.covariance);
        let place_m = self.driven_m + ahead_m;
        let travelled_m = place_m - head.last_update_m;
        let shared = (self.config).shared_variance(travelled_m, &angle_model);
        let elapsed_s = measured.time_s - head.last_update_s;
        // A turn of the vehicle changes the direction relative to the vehicle's array, but not
        // relative to the array of a radio head.
        let turned_rad = match measured.kind {
            MeasurementKind::Angle => self.turned_rad - head.last_update_rad,
            MeasurementKind::AngleAtHead => 0.0,
        };
        let moved = (travelled_m, turned_rad);
        let stated = self.correlated_noise().variance(sigma, elapsed_s, moved);
        let (row, strayed) = (ahead.as_ref()).map_or((angle_model.row, 0.0), |ahead| {
            ahead.seen_before(&angle_model.row)
        });
        let coasted = angle_model.row[ALONG].powi(2) * ahead_variance + strayed;
        let measurement_variance = stated + shared + coasted + bend.variance;
        let residual = wrap_angle(measured.phase_rad - angle_model.phase_rad - bend.shift_rad);
        let innovation = (self.belief).innovation(residual, &row, measurement_variance);
        let hypotheses = if head.excluded {
            None
        } else {
            (self.bias).jump_hypotheses(index, &self.dependence(travelled_m), &innovation, &row)
        };
        Ok(PredictedMeasurement {
            head: index,
            excluded: head.excluded,
            place_m,
            row,
            innovation,
            own_variance: sigma * sigma,
            aperture: angle_model.aperture,
            direction_cosine: angle_model.direction_cosine,
            survey_variance: angle_model.survey_variance,
            elapsed_s,
            moved,
            coasted_variance: coasted,
            bend_variance: bend.variance,
            hypotheses,
        })
    }

    /// Returns the variance of an angle's noise for a first angle of the radio head (rad²).
    pub(in crate::localize) fn first_variance(&self, predicted: &PredictedMeasurement) -> f64 {
        let config = &self.config;
        let scatter = config.scatter_variance(
            f64::INFINITY,
            predicted.aperture,
            predicted.direction_cosine,
        );
        predicted.own_variance + scatter
    }

    /// Returns the model of a radio head for a state, at the reception time of the angle.
    fn angle_model(
        &self,
        kind: MeasurementKind,
        head: &RadioHead,
        mean: &[f64; STATES],
    ) -> Option<AngleModel> {
        let (map, array) = (self.map.as_deref(), &self.config.array);
        if self.config.angle_time_offset_std_s == 0.0 {
            let (pose, frame) = locate(mean, 0.0, map);
            return AngleModel::of_kind(kind, head, pose, &frame, mean, array);
        }
        let speed_mps = self.speed_mps();
        let (mut pose, frame) = locate(mean, -speed_mps * mean[ANGLE_TIME_OFFSET], map);
        let mut rate_radps = 0.0;
        if map.is_none() {
            let read = self.odometry.and_then(|sample| sample.yaw_rate_radps);
            let top = self.config.top_yaw_rate_radps;
            rate_radps =
                read.filter(|rate| rate.abs() <= top).unwrap_or_default() - mean[YAW_RATE_BIAS];
            pose.heading_rad -= rate_radps * mean[ANGLE_TIME_OFFSET];
        }
        let mut angle_model = AngleModel::of_kind(kind, head, pose, &frame, mean, array)?;
        let (sin, cos) = (pose.heading_rad - frame.direction_rad).sin_cos();
        let row = &mut angle_model.row;
        row[ANGLE_TIME_OFFSET] = -speed_mps
            * (row[ALONG] * cos / frame.stretch + row[ACROSS] * sin)
            - rate_radps * row[HEADING];
        Some(angle_model)
    }

    /// Returns the probability that an angle of this kind belongs to another lobe of the vehicle's
    /// array, unless it is negligible.
    const fn wrong_lobe(&self, kind: MeasurementKind) -> Option<f64> {
        match kind {
            MeasurementKind::Angle => self.config.wrong_lobe,
            MeasurementKind::AngleAtHead => None,
        }
    }

    /// Corrects the state by one angle to a radio head.
    pub fn update(&mut self, head: &RadioHead, measured: &AngleMeasurement) -> UpdateResult {
        self.update_predicted(self.predict_measurement(head, measured), measured)
    }

    /// Updates the state with a predicted angle.
    #[inline]
    pub(in crate::localize) fn update_predicted(
        &mut self,
        predicted: Result<PredictedMeasurement, UpdateReason>,
        measured: &AngleMeasurement,
    ) -> UpdateResult {
        let predicted = match predicted {
            Ok(predicted) if predicted.excluded => {
                return self.verdict(UpdateReason::Excluded, None);
            }
            Ok(predicted) => predicted,
            Err(reason) => return self.verdict(reason, None),
        };
        if let Some(hypotheses) = &predicted.hypotheses {
            return self.update_with_bias(&predicted, hypotheses, measured);
        }
        let seen = predicted.innovation;
        let mahalanobis2 = seen.mahalanobis2();
        if mahalanobis2 > self.config.gate {
            return self.verdict(UpdateReason::Outlier, Some(mahalanobis2));
        }
        let (mut residual, mut variance) = (seen.residual, seen.measurement_variance);
        let unresolved = (!measured.resolved).then_some(WRONG_IF_UNRESOLVED);
        if let Some(wrong) = unresolved.or(self.wrong_lobe(measured.kind)) {
            let Some(likely) = equivalent(&seen, wrong) else {
                return self.verdict(UpdateReason::Outlier, Some(mahalanobis2));
            };
            (residual, variance) = likely;
        }
        let before = self.belief.mean;
        self.measure(residual, &predicted.row, variance);
        self.note_update(&predicted, measured, &before);
        self.verdict(UpdateReason::Consistent, Some(mahalanobis2))
    }

    /// Updates state and biases with an angle. A large deviation is an outlier. A large deviation
    /// of a radio head with a known large bias contains no information about the vehicle.
    fn update_with_bias(
        &mut self,
        predicted: &PredictedMeasurement,
        hypotheses: &JumpHypotheses,
        measured: &AngleMeasurement,
    ) -> UpdateResult {
        // The gate includes the maximum variance of the bias.
        let mut seen = predicted.innovation;
        seen.variance += MAX_VARIANCE;
        let mahalanobis2 = seen.mahalanobis2();
        let is_known = self.bias.is_large(predicted.head);
        let before = self.belief.mean;
        let (dependence, journal) = (self.dependence(predicted.moved.0), self.journal.as_mut());
        (self.bias).update_with_angle(
            &mut self.belief,
            predicted.head,
            &dependence,
            &predicted.row,
            hypotheses,
            journal,
        );
        self.note_update(predicted, measured, &before);
        if mahalanobis2 > self.config.gate {
            return self.verdict(UpdateReason::Outlier, (!is_known).then_some(mahalanobis2));
        }
        self.verdict(UpdateReason::Consistent, Some(mahalanobis2))
    }

    /// Returns the dependence of an angle's error on the previous one of its radio head, after a distance.
    pub(super) fn dependence(&self, travelled_m: f64) -> Dependence {
        Dependence {
            travelled_m: travelled_m.abs(),
            white_fraction: self.error_correlation.white_fraction(),
        }
    }

    /// Returns the time-correlated noise of the angles with its estimated fraction.
    pub(super) fn correlated_noise(&self) -> CorrelatedNoise {
        let mut bias = self.config.correlated_noise;
        if bias.is_found {
            bias.share = self.white.correlated_fraction(bias.share);
        }
        bias
    }

    /// Updates the time-correlated fraction of the noise, if it is estimated, and the correlation of
    /// the errors, if the bias of the angle is; `before` is the state before the update.
    fn update_noise(&mut self, predicted: &PredictedMeasurement, before: &[f64; STATES]) {
        let stated = self.config.correlated_noise;
        let finds_fraction = stated.is_found && stated.share > 0.0;
        let finds_bias = predicted.hypotheses.is_some();
        if !finds_fraction && !finds_bias {
            return;
        }
        let states = self.belief.mean.iter().zip(before).zip(&predicted.row);
        let corrected_rad: f64 = states.map(|((now, before), by)| by * (now - before)).sum();
        let before_rad = predicted.innovation.residual;
        let after_rad = before_rad - corrected_rad;
        let wavelength_m = self.config.array.wavelength_m;
        let Some(head) = self.heads.get_mut(predicted.head) else {
            return;
        };
        if finds_fraction {
            let is_correlated = stated.steps(predicted.elapsed_s, predicted.moved) < 1.0;
            let residual = |residual_rad| Residual {
                residual_rad,
                variance: predicted.own_variance,
            };
            if let (true, Some(last)) = (is_correlated, &head.last_residual) {
                self.white.see(last, &residual(before_rad));
            }
            head.last_residual = Some(residual(after_rad));
        }
        if finds_bias {
            let after = AngleError {
                residual_rad: after_rad,
                place_m: predicted.place_m,
            };
            (self.error_correlation).add(&mut head.last_error, wavelength_m, before_rad, after);
        }
    }

    /// Records the time and position of an update with a radio head, and estimates its noise from
    /// the angle; `before` is the state before the update.
    fn note_update(
        &mut self,
        predicted: &PredictedMeasurement,
        measured: &AngleMeasurement,
        before: &[f64; STATES],
    ) {
        self.update_noise(predicted, before);
        self.keep_bounds();
        let blocked = BlockedPath::new(self.bias.large_probability(predicted.head));
        if let Some(head) = self.heads.get_mut(predicted.head) {
            head.blocked = blocked;
            head.kind = measured.kind;
            head.last_update_m = predicted.place_m;
            head.last_update_s = measured.time_s;
            head.last_update_rad = self.turned_rad;
        }
    }

    /// Limits scale and time offset to plausible values, whatever the angles indicate.
    pub(super) fn keep_bounds(&mut self) {
        let mean = &mut self.belief.mean;
        let scale = self.config.odometer_scale;
        mean[SCALE] = mean[SCALE].clamp(0.5 * scale - 1.0, 2.0 * scale - 1.0);
        mean[ANGLE_TIME_OFFSET] =
            mean[ANGLE_TIME_OFFSET].clamp(-MAX_ANGLE_TIME_OFFSET_S, MAX_ANGLE_TIME_OFFSET_S);
    }

    pub(super) fn verdict(&self, reason: UpdateReason, mahalanobis2: Option<f64>) -> UpdateResult {
        UpdateResult {
            accepted: reason == UpdateReason::Consistent,
            reason,
            mahalanobis_squared: mahalanobis2,
            threshold: Some(self.config.gate),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::gaussian::Gaussian;

    #[test]
    fn the_belief_has_the_moments_of_the_mixture() {
        let (prior_variance, variance) = (0.8_f64, 0.3_f64);
        let normal =
            |x: f64, variance: f64| (-0.5 * x * x / variance).exp() / (TAU * variance).sqrt();
        for measured in [0.0, 0.6, 1.1, -1.4] {
            // Bayes' rule by numerical integration over the state: the angle is correct, or
            // uniformly distributed.
            let mut moments = [0.0; 3];
            for step in -60_000..60_000 {
                let x = 1e-4 * f64::from(step);
                let likelihood = normal(measured - x, variance) + TAU.recip();
                let weight = likelihood * normal(x, prior_variance);
                for (power, moment) in (0..).zip(&mut moments) {
                    *moment += weight * x.powi(power);
                }
            }
            let mean = moments[1] / moments[0];
            let spread = moments[2] / moments[0] - mean * mean;

            let mut belief = Gaussian::independent([0.0], [prior_variance.sqrt()]);
            let innovation = belief.innovation(measured, &[1.0], variance);
            let (residual, variance) = equivalent(&innovation, WRONG_IF_UNRESOLVED).unwrap();
            belief.update(residual, &[1.0], variance);
            assert!((belief.mean[0] - mean).abs() < 1e-6, "{measured}");
            assert!(
                (belief.covariance[0][0] - spread).abs() < 1e-6,
                "{measured}"
            );
        }
    }

    #[test]
    fn a_distant_outlier_contains_no_information() {
        let innovation = Innovation {
            residual: 0.9,
            variance: 0.05,
            measurement_variance: 0.01,
        };
        assert_eq!(equivalent(&innovation, WRONG_IF_UNRESOLVED), None);
    }
}
