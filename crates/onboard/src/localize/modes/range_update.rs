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
        self.ekf.update_predicted_range(predicted);
    }
}

impl Bank {
    /// Updates with a range. All hypotheses have the nominal probability of a blocked first path. Otherwise, a filter far
    /// from the position expects a blocked path, and ranges are no evidence against it.
    pub fn update_range(&mut self, head: &RadioHead, measured: &RangeMeasurement) -> UpdateResult {
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
                if !self.has_angles {
                    for (mine, test) in subset.without.iter().zip(&mut subset.range_tests) {
                        if *mine == number {
                            test.push(&predicted.independent_innovation());
                        }
                    }
                }
                subset.ekf.note_range(&predicted);
            }
        }
        let predicted = self.nominal.predict_range(head, measured);
        for it in &mut self.modes {
            it.ekf.copy_blocked_paths(&self.nominal);
            it.update_range(&predicted, head, measured);
        }
        let most = (self.modes.iter()).fold(LikelihoodRatio::NONE, |most, it| most.max(it.ratio));
        for it in &mut self.modes {
            it.ratio.limit_by(most);
        }
        self.nominal.update_predicted_range(predicted)
    }
}
