//! Range or one-way delay: `(1 + s) R + c + b` with the distance R to the radio head, the scale
//! error s, the vehicle clock c (one-way delays only) and the offset b of the radio head.

use super::pseudorange::PredictedRange;
use crate::localize::bias::{CLOCK, DRIFT, HeadState, RANGE_SCALE, independent};
use crate::localize::ekf::filter::Ekf;
use crate::localize::output::UpdateReason;
use crate::radio_head::RadioHead;
use crate::range::RangeMeasurement;

/// Correlation distance of the error of a delay due to multipath (m). The fading of the first path
/// decorrelates within a metre, but the delays of the reflections and a blocked line of sight remain
/// for tens of metres.
pub(super) const SHARED_M: f64 = 20.0;

/// Fraction of measurements that are outliers with a uniform distribution, unless scatter causes more.
pub(in crate::localize) const OUTLIERS: f64 = 2e-3;

/// Width of the uniform distribution of outliers of a range (m).
pub(super) const OUTLIER_SPAN_M: f64 = 100.0;

/// Returns the density (1/m) of a range that has the given density or, with probability `outliers`, is uniformly
/// distributed.
pub(in crate::localize) fn with_range_outliers(density: f64, outliers: f64) -> f64 {
    outliers / OUTLIER_SPAN_M + (1.0 - outliers) * density
}

/// Minimum independent fraction of multipath. At standstill there is no new information, but the variance
/// must remain finite.
const MIN_FRACTION: f64 = 1e-5;

impl Ekf {
    pub(super) fn predict_distance(
        &self,
        head: &RadioHead,
        measured: &RangeMeasurement,
    ) -> Result<PredictedRange, UpdateReason> {
        let of_model = self.config.ranging.and_then(|model| model.sigma_m);
        let sigma_m = measured.sigma.or(of_model).unwrap_or(f64::NAN);
        let seen = self.sight(head, measured, sigma_m)?;
        let state_m = |number: usize| self.bias.range_state(number)[0];
        let distance = self.distance(&seen, 1.0 + state_m(RANGE_SCALE));
        let offset = HeadState::Offset.number(seen.index, self.heads.len(), seen.model);
        let terms = [
            (RANGE_SCALE, seen.sight.range_m),
            (CLOCK, 1.0),
            (DRIFT, seen.lag_s),
            (offset, 1.0),
        ];
        // Noise is independent from one range to the next, multipath is not.
        let noise = sigma_m * sigma_m * self.late_variance_ratio();
        let scatter = measured.scatter_m * measured.scatter_m + seen.blocked.variance();
        let variance = noise + scatter;
        let independent_fraction = independent(seen.travelled_m, SHARED_M).max(MIN_FRACTION);
        let shift_m =
            seen.blocked.late_m() + state_m(CLOCK) + seen.lag_s * state_m(DRIFT) + state_m(offset);
        let mut predicted = self.predicted(
            &seen,
            measured.quantity,
            measured.value - (distance.range_m + shift_m),
            distance.row,
            terms,
            variance,
            [
                self.range_noise.ratio(),
                distance.variance + seen.clock_variance(),
            ],
        );
        predicted.information_fraction = variance / (noise + scatter / independent_fraction);
        Ok(predicted)
    }
}
