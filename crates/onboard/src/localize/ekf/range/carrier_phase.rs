//! Carrier phase: the pseudorange `R + c + n` modulo the wavelength, with the distance R to the
//! radio head, the vehicle clock c and the phase offset n of the radio head.
//!
//! The offset n contains the unknown number of wavelengths. The first phase determines it; from
//! then on, each phase measures the change of the pseudorange since the first one. A phase is used
//! if six standard deviations of its prediction are below half a wavelength: with the variance of
//! the clocks between two SSBs, this limits the interval. Otherwise, and if the innovation reveals
//! a cycle slip, a new sequence begins, and the phase contains no information on the position.

use super::pseudorange::PredictedRange;
use crate::localize::bias::{CLOCK, DRIFT, HeadState, RANGE_SCALE};
use crate::localize::ekf::filter::Ekf;
use crate::localize::output::UpdateReason;
use crate::radio_head::RadioHead;
use crate::range::RangeMeasurement;

/// Minimum ratio of half a wavelength to the standard deviation of the predicted phase. With 6, the
/// probability of a wrong number of wavelengths is 2e-9 per phase. With 4, 4 % of the drives with
/// some hundred phases contain a wrong number.
const RESOLVED: f64 = 6.0;

/// Standard deviation of the phase offset at the start of a sequence (m): far above a wavelength,
/// so that the first phase has no other effect.
const UNKNOWN_OFFSET_M: f64 = 100.0;

impl Ekf {
    pub(super) fn predict_carrier_phase(
        &self,
        head: &RadioHead,
        measured: &RangeMeasurement,
    ) -> Result<PredictedRange, UpdateReason> {
        let sigma_m = measured.sigma.unwrap_or(f64::NAN);
        let seen = self.sight(head, measured, sigma_m)?;
        if !seen.model.uses_carrier_phase {
            return Err(UpdateReason::Unusable);
        }
        let offset = HeadState::PhaseOffset.number(seen.index, self.heads.len(), seen.model);
        let [offset_m, offset_variance] = self.bias.range_state(offset);
        let state_m = |number: usize| self.bias.range_state(number)[0];
        let distance = self.distance(&seen, 1.0);
        let terms = [
            (RANGE_SCALE, 0.0),
            (CLOCK, 1.0),
            (DRIFT, seen.lag_s),
            (offset, 1.0),
        ];
        let shift_m = state_m(CLOCK) + seen.lag_s * state_m(DRIFT) + offset_m;
        let wavelength_m = seen.model.wavelength_m;
        let residual = measured.value - (distance.range_m + shift_m);
        let residual = residual - wavelength_m * (residual / wavelength_m).round();
        let variance = distance.variance + seen.clock_variance();
        let mut predicted = self.predicted(
            &seen,
            measured.quantity,
            residual,
            distance.row,
            terms,
            sigma_m * sigma_m,
            [1.0, variance],
        );
        let half = 0.5 * wavelength_m;
        let is_resolved = RESOLVED * predicted.innovation.variance.sqrt() < half;
        predicted.is_new_sequence = offset_variance == 0.0 || !is_resolved;
        Ok(predicted)
    }

    /// Begins a new sequence with a carrier phase.
    pub(super) fn begin_sequence(&mut self, predicted: &PredictedRange) {
        let Some(model) = &self.config.ranging else {
            return;
        };
        let number = HeadState::PhaseOffset.number(predicted.index, self.heads.len(), model);
        let [offset_m, _] = self.bias.range_state(number);
        let mean = offset_m + predicted.innovation.residual;
        self.bias
            .reset_range_state(number, mean, UNKNOWN_OFFSET_M * UNKNOWN_OFFSET_M);
        // The phase equals its prediction: it relates the offset to pose and clock.
        self.bias.update_with_range(
            &mut self.belief,
            &predicted.row,
            &predicted.terms,
            0.0,
            predicted.innovation.measurement_variance,
        );
    }
}
