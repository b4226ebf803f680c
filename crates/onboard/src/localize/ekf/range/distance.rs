//! Range or one-way delay: `(1 + s) R + c + b` with the distance R to the radio head, the scale
//! error s, the vehicle clock c (one-way delays only) and the offset b of the radio head.

use super::blocked_path::BlockedPath;
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
        let (ratio, noise) = (self.range_noise.ratio(), sigma_m * sigma_m);
        let changed = independent(seen.travelled_m, SHARED_M);
        let path = self.path_before(&seen, changed);
        let unnoticed = BlockedPath::unnoticed(path, self.blocked_fraction, sigma_m * ratio.sqrt());
        // Noise is independent from one range to the next, multipath is not.
        let scatter = measured.scatter_m * measured.scatter_m + seen.blocked.variance();
        let own_variance = ratio * (noise + scatter) + unnoticed.variance();
        let independent_fraction = changed.max(MIN_FRACTION);
        let shared_variance = (ratio * scatter + unnoticed.variance()) / independent_fraction;
        let late_m = seen.blocked.late_m() + unnoticed.late_m();
        let shift_m = late_m + state_m(CLOCK) + seen.lag_s * state_m(DRIFT) + state_m(offset);
        let mut predicted = self.predicted(
            &seen,
            measured.quantity,
            measured.value - (distance.range_m + shift_m),
            distance.row,
            terms,
            noise + scatter,
            [
                ratio,
                unnoticed.variance() + distance.variance + seen.clock_variance(),
            ],
        );
        (predicted.path, predicted.unnoticed) = (path, unnoticed);
        (predicted.path_after, predicted.clear_probability) =
            path.update(&predicted.clear_innovation());
        predicted.information_fraction = own_variance / (ratio * noise + shared_variance);
        Ok(predicted)
    }
}
