//! Update of a bank with a range: every filter that uses the radio head, and the test of each
//! filter without it.

use super::bank::{Bank, ModeFilter};
use super::likelihood::LikelihoodRatio;
use crate::localize::ekf::PredictedRange;
use crate::localize::output::{UpdateReason, UpdateResult};
use crate::radio_head::RadioHead;
use crate::range::{RangeMeasurement, RangeQuantity};

impl ModeFilter {
    /// Updates with a range, for which the nominal filter has the given prediction.
    fn update_range(
        &mut self,
        by_nominal: &Result<PredictedRange, UpdateReason>,
        head: &RadioHead,
        measured: &RangeMeasurement,
    ) {
        let predicted = self.ekf.predict_range(head, measured);
        self.ratio.update_range(&predicted, by_nominal);
        self.ekf.update_predicted_range(&predicted);
    }
}

impl Bank {
    /// Updates with a range. All hypotheses have the nominal noise of ranges and clocks, and the nominal probability of a
    /// blocked first path. Otherwise, a filter that follows the delays would estimate less noise, and accurate range rates
    /// would be evidence for it. A filter far from the position would expect a blocked path, and ranges would be no evidence
    /// against it.
    pub fn update_range(&mut self, head: &RadioHead, measured: &RangeMeasurement) -> UpdateResult {
        let (predicted, step) = self.nominal.predict_with_clock_step(head, measured);
        for it in &mut self.modes {
            if let Some(step) = step {
                it.ekf.step_clock(step);
            }
        }
        if let Some(late) = self.nominal.reject_late_range(&predicted) {
            return late;
        }
        if let Some(number) = head.number_in(&self.heads) {
            self.watch(number);
            for subset in self.subsets.iter_mut() {
                if !subset.lacks(number) {
                    subset.ekf.update_range(head, measured);
                    continue;
                }
                // Rates and phases hardly depend on the position of the radio head.
                if measured.quantity != RangeQuantity::Range {
                    continue;
                }
                let Ok(predicted) = subset.ekf.predict_range(head, measured) else {
                    continue;
                };
                // The offset of a radio head includes a blocked first path, and a clock step affects all radio
                // heads: angles are the better test.
                if !self.has_angles && subset.ekf.knows_clock() {
                    for (mine, test) in subset.without.iter().zip(&mut subset.range_tests) {
                        if *mine == number {
                            test.push(&predicted.independent_innovation());
                        }
                    }
                }
                subset.ekf.note_range(&predicted);
            }
        }
        for it in &mut self.modes {
            it.ekf.copy_range_noise(&self.nominal);
            it.update_range(&predicted, head, measured);
        }
        let most = (self.modes.iter()).fold(LikelihoodRatio::NONE, |most, it| most.max(it.ratio));
        for it in &mut self.modes {
            it.ratio.limit_by(most);
        }
        self.nominal.update_predicted_range(&predicted)
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    use super::super::table::trip::trip;
    use super::*;
    use crate::localize::output::SelectedHypothesis;
    use crate::observation::OdometrySample;
    use crate::range::RangeModel;
    use crate::settings::{ArraySettings, IntegritySettings, RangingKind, RangingSettings};

    const STEP_S: f64 = 0.1;
    const SPEED_MPS: f64 = 4.0;

    /// The nominal filter receives delays with errors of 1 m, and the filter of slip receives exact delays, so that it
    /// estimates less noise. A rate that both filters predict equally well is no evidence.
    #[test]
    fn less_estimated_noise_is_no_evidence_for_a_mode() {
        let (heads, road, mut ekf) = trip();
        let settings = RangingSettings {
            kind: RangingKind::OneWay,
            ..RangingSettings::default()
        };
        ekf.begin_ranging(RangeModel::new(&settings, &ArraySettings::default(), 0.08));
        let mut bank = Bank::new(&ekf, &heads, &IntegritySettings::default(), 0.0);
        let mut random = ChaCha8Rng::seed_from_u64(1);
        for step in 1..100 {
            let time_s = f64::from(step) * STEP_S;
            bank.odometry(&OdometrySample {
                time_s,
                distance_m: SPEED_MPS * time_s,
                speed_mps: SPEED_MPS,
                yaw_rate_radps: None,
            });
            let truth = road.pose(SPEED_MPS * time_s).point();
            for head in &heads {
                let delay = |late_m: f64| {
                    let range_m = head.distance_m(truth, 0.0) + late_m;
                    RangeMeasurement::range(time_s, range_m, Some(0.3))
                };
                let error_m = random.sample::<f64, _>(StandardNormal);
                bank.nominal.update_range(head, &delay(error_m));
                for it in &mut bank.modes {
                    it.ekf.update_range(head, &delay(0.0));
                }
            }
        }
        let log_odds = |bank: &Bank| bank.mode(SelectedHypothesis::WheelSlip).unwrap().0.ln();
        let before = log_odds(&bank);
        let time_s = bank.nominal.time_s();
        for head in &heads {
            bank.update_range(head, &RangeMeasurement::range_rate(time_s, 0.0, 0.1, 1e-4));
        }
        let evidence = log_odds(&bank) - before;
        assert!(evidence.abs() < 0.05, "{evidence}");
    }
}
