//! Carrier phase: the pseudorange `R + c + m + n` modulo the wavelength, with the distance R to the
//! radio head, the vehicle clock c, a phase offset m that all radio heads share and the phase offset
//! n of the radio head.
//!
//! The offset n contains the unknown number of wavelengths. The first phase determines it; from
//! then on, each phase measures the change of the pseudorange since the first one. A phase is used
//! if its innovation determines the number of wavelengths with log-odds of 20. Otherwise, the first
//! phase after an odometry sample determines m, because the vehicle clock may have changed by an
//! unknown number of wavelengths since the last SSBs. The phases of the other radio heads then
//! measure differences, which do not contain the vehicle clock. If one of them is unresolved too,
//! and if the innovation reveals a cycle slip, a new sequence of the radio head begins.

use super::pseudorange::PredictedRange;
use crate::localize::bias::{CLOCK, DRIFT, HeadState, common_phase};
use crate::localize::ekf::filter::Ekf;
use crate::localize::output::UpdateReason;
use crate::radio_head::RadioHead;
use crate::range::RangeMeasurement;

/// Minimum log-odds of the nearest number of wavelengths: a wrong one has a probability of 2e-9 per
/// phase, so that a day of phases contains none.
const RESOLVED: f64 = 20.0;

/// Returns the log-odds of the nearest number of wavelengths against the second nearest one, given
/// the innovation (m) with the nearest one and its variance.
fn cycle_log_odds(residual_m: f64, variance: f64, wavelength_m: f64) -> f64 {
    let other_m = wavelength_m - residual_m.abs();
    (other_m * other_m - residual_m * residual_m) / (2.0 * variance)
}

/// Standard deviation of the phase offset at the start of a sequence (m): far above a wavelength,
/// so that the first phase has no other effect.
const UNKNOWN_OFFSET_M: f64 = 100.0;

/// Number of successive phases that share the error of the linearised distance, because the direction
/// to the radio head changes little between them. With 1, NEES/2 is 1.22 with one radio head; with
/// 11, the RMS error with two radio heads is 14 % above the bound.
const SHARED_CURVATURE: f64 = 5.0;

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
        let common = common_phase(self.heads.len(), seen.model);
        let state_m = |number: usize| self.bias.range_state(number)[0];
        let distance = self.distance(&seen, 1.0);
        let terms = [
            (common, 1.0),
            (CLOCK, 1.0),
            (DRIFT, seen.lag_s),
            (offset, 1.0),
        ];
        let shift_m = state_m(CLOCK) + seen.lag_s * state_m(DRIFT) + state_m(common) + offset_m;
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
        let seen = predicted.innovation;
        let is_slip = seen.mahalanobis2() > self.config.gate;
        let is_resolved = cycle_log_odds(seen.residual, seen.variance, wavelength_m) > RESOLVED;
        // Successive phases share the error of the linearisation.
        let shared = (SHARED_CURVATURE - 1.0) * distance.curvature_variance;
        predicted.innovation.variance += shared;
        predicted.innovation.measurement_variance += shared;
        let is_first = offset_variance == 0.0;
        predicted.is_new_sequence = is_first || !(is_resolved || is_slip);
        if predicted.is_new_sequence && !is_first && !self.knows_common_phase {
            predicted.phase_state = common;
        }
        Ok(predicted)
    }

    /// Begins a new sequence with a carrier phase, which determines the phase offset `number`.
    pub(super) fn begin_sequence(&mut self, predicted: &PredictedRange, number: usize) {
        let [offset_m, _] = self.bias.range_state(number);
        let model = self.config.ranging.as_ref();
        let is_common = model.is_some_and(|it| number == common_phase(self.heads.len(), it));
        self.knows_common_phase |= is_common;
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
            1.0,
        );
    }
}
