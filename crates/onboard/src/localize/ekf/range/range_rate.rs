//! Range rate: `−u·v + d + f` with the direction u to the radio head, the velocity v of the
//! antenna by the odometry, the drift d of the vehicle clock and the frequency error f of the radio
//! head.

use super::pseudorange::PredictedRange;
use crate::localize::bias::{DRIFT, HeadState, RANGE_SCALE};
use crate::localize::ekf::filter::Ekf;
use crate::localize::ekf::state::{ALONG, HEADING, SCALE, YAW_RATE_BIAS};
use crate::localize::output::UpdateReason;
use crate::radio_head::RadioHead;
use crate::range::RangeMeasurement;

/// Minimum duration between two odometry samples, and of the measurement of a rate (s).
const MIN_INTERVAL_S: f64 = 1e-4;

impl Ekf {
    pub(super) fn predict_range_rate(
        &self,
        head: &RadioHead,
        measured: &RangeMeasurement,
        measured_s: f64,
    ) -> Result<PredictedRange, UpdateReason> {
        let sigma_mps = measured.sigma.unwrap_or(f64::NAN);
        let seen = self.sight(head, measured, sigma_mps)?;
        let odometry = self.odometry.ok_or(UpdateReason::Unusable)?;
        if !seen.model.uses_range_rate {
            return Err(UpdateReason::Unusable);
        }
        let (sight, speed_mps) = (&seen.sight, self.speed_mps());
        let (sine, cosine) = (sight.bearing_rad - seen.pose.heading_rad).sin_cos();
        let cos_elevation = sight.cos_elevation();
        let yaw_rate_radps = odometry.yaw_rate_radps.unwrap_or(0.0) - seen.mean[YAW_RATE_BIAS];
        // Velocity towards the radio head in the plane: sum of the vehicle's velocity and of the
        // rotation of the antenna about the reference point.
        let lever_arm_m = sight.position_rows[0][HEADING];
        // Derivatives: the bearing and the elevation depend on the state.
        let mut row = sight.bearing_row;
        row[HEADING] -= 1.0;
        row[ALONG] -= seen.frame.curvature_per_m;
        // Second-order term: uncertainty of the bearing reduces the mean of its cosine.
        let cosine_correction = 0.5 * self.belief.variance_along(&row) * speed_mps * cosine;
        let closing_mps = speed_mps * cosine - cosine_correction + yaw_rate_radps * lever_arm_m;
        for (value, entry) in row.iter_mut().zip(sight.position_rows[0]) {
            let elevation_rate = (1.0 - cos_elevation * cos_elevation) / sight.range_m * entry;
            *value = cos_elevation * speed_mps * sine * *value + elevation_rate * closing_mps;
        }
        row[SCALE] += cos_elevation * cosine * speed_mps / (1.0 + seen.mean[SCALE]);
        row[YAW_RATE_BIAS] += cos_elevation * lever_arm_m;
        let (row, odometry_variance) = seen.to_newest(row);
        // The odometer measures the mean speed between two samples.
        let noise = &self.config.noise;
        let interval_s = (self.sample_interval.usual_s())
            .max(seen.lag_s)
            .max(MIN_INTERVAL_S);
        let odometer_variance = noise.odometer_m_per_sqrt_m.powi(2) * speed_mps.abs()
            + noise.odometer_m_per_sqrt_s.powi(2);
        let speed_variance = self.config.speed_noise_mps.powi(2)
            + odometer_variance / interval_s
            + (0.5 * self.config.acceleration_mps2 * interval_s).powi(2);
        let drift = seen.model.drift_walk_mps_per_sqrt_s.powi(2) * seen.lag_s;
        // The random walk of both clocks within the interval is noise of the rate.
        let walked = seen.clock_walk() / measured_s.max(MIN_INTERVAL_S);
        // The radio heads of a burst have a common speed error.
        let shared = self.heads.len().max(1) as f64;
        let model_variance = (cos_elevation * cosine).powi(2) * shared * speed_variance
            + drift
            + odometry_variance
            + walked
            + 2.0 * (cos_elevation * cosine_correction).powi(2);
        let rate = HeadState::RateOffset.number(seen.index, self.heads.len(), seen.model);
        let terms = [
            (DRIFT, 1.0),
            (rate, 1.0),
            (RANGE_SCALE, 0.0),
            (RANGE_SCALE, 0.0),
        ];
        let state_mps = |number: usize| self.bias.range_state(number)[0];
        let expected_mps = -cos_elevation * closing_mps + state_mps(DRIFT) + state_mps(rate);
        Ok(self.predicted(
            &seen,
            measured.quantity,
            measured.value - expected_mps,
            row,
            terms,
            sigma_mps * sigma_mps + seen.blocked.rate_variance(),
            [1.0, model_variance],
        ))
    }
}
