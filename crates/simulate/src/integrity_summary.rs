//! Integrity statistics of one run.

use onboard::localize::IntegrityState;

use crate::histogram::ErrorHistogram;
use crate::record::RunRecord;

/// Minimum error in metres in the ratio of protection level to error; smaller errors are replaced
/// by this value.
const MIN_ERROR_M: f64 = 1e-3;

/// Statistics of protection levels and alarms of one run. Epochs within a run are correlated; runs
/// are independent.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct IntegritySummary {
    /// Steps with a protection level.
    pub epochs: usize,
    /// Number of steps in state `ok`.
    pub ok: usize,
    /// Number of steps in state `unavailable`.
    pub unavailable: usize,
    /// Number of steps in state `degraded` whose protection level exceeds the alert limit.
    pub too_wide: usize,
    /// Number of steps in state `ok` whose error exceeds the protection level.
    pub beyond: usize,
    /// Number of alarms: transitions from `ok` to another state.
    pub alarms: usize,
    /// Number of alarms while the error was within the alert limit.
    pub early_alarms: usize,
    /// Number of alarms while the error and the protection level were within the alert limit. Such
    /// an alarm is caused by a suspected source, and is a false alarm in a fault-free run.
    pub suspicions: usize,
    /// Longest time in seconds for which the error exceeded the alert limit while the state was
    /// `ok`.
    pub longest_silence_s: f64,
    /// Maximum horizontal error in metres.
    pub worst_m: f64,
    /// Duration of the run in seconds.
    pub duration_s: f64,
    /// Histogram of the ratio of protection level to error.
    pub ratios: ErrorHistogram,
}

impl IntegritySummary {
    /// Creates the summary of a run; `None` if the localizer reports no protection levels.
    pub fn new(record: &RunRecord, alert_limit_m: f64) -> Option<Self> {
        let mut summary = Self::default();
        let mut was_ok = true;
        let mut exceeded_since_s = None;
        for step in &record.steps {
            let integrity = step.integrity?;
            let error_m = step.error_m();
            let ok = integrity.state == IntegrityState::Ok;
            let exceeds = error_m > alert_limit_m;
            summary.epochs += 1;
            summary.ok += usize::from(ok);
            let unavailable = integrity.state == IntegrityState::Unavailable;
            summary.unavailable += usize::from(unavailable);
            summary.beyond += usize::from(ok && error_m > integrity.protection_level_m);
            summary.alarms += usize::from(was_ok && !ok);
            let early = was_ok && !ok && !exceeds;
            summary.early_alarms += usize::from(early);
            let too_wide = integrity.protection_level_m > alert_limit_m;
            summary.too_wide += usize::from(!ok && !unavailable && too_wide);
            let within_limit = integrity.protection_level_m <= alert_limit_m;
            summary.suspicions += usize::from(early && within_limit);
            summary.worst_m = summary.worst_m.max(error_m);
            if exceeds {
                let since_s = *exceeded_since_s.get_or_insert(step.time_s);
                if ok {
                    summary.longest_silence_s =
                        summary.longest_silence_s.max(step.time_s - since_s);
                }
            } else {
                exceeded_since_s = None;
            }
            let ratio = integrity.protection_level_m / error_m.max(MIN_ERROR_M);
            summary.ratios.add(ratio);
            was_ok = ok;
        }
        summary.duration_s = record.steps.last()?.time_s;
        Some(summary)
    }

    /// Combines the summaries of several runs.
    pub fn sum<'a>(runs: impl IntoIterator<Item = &'a Self>) -> Self {
        let mut total = Self::default();
        for run in runs {
            total.epochs += run.epochs;
            total.ok += run.ok;
            total.unavailable += run.unavailable;
            total.too_wide += run.too_wide;
            total.beyond += run.beyond;
            total.alarms += run.alarms;
            total.early_alarms += run.early_alarms;
            total.suspicions += run.suspicions;
            total.longest_silence_s = total.longest_silence_s.max(run.longest_silence_s);
            total.worst_m = total.worst_m.max(run.worst_m);
            total.duration_s += run.duration_s;
            total.ratios.merge(&run.ratios);
        }
        total
    }

    /// Returns the fraction of the `ok` epochs whose error exceeds the protection level.
    pub fn risk(&self) -> f64 {
        self.beyond as f64 / self.ok.max(1) as f64
    }

    /// Converts a count to a rate per hour.
    pub fn per_h(&self, count: usize) -> f64 {
        count as f64 / (self.duration_s / 3600.0)
    }

    /// Returns the median ratio of protection level to error.
    pub fn median_ratio(&self) -> f64 {
        self.ratios.quantile_m(0.5).unwrap_or(f64::NAN)
    }
}

#[cfg(test)]
mod tests {
    use onboard::geometry::Pose;
    use onboard::localize::Integrity;
    use onboard::monitor::ActiveFaults;

    use super::*;
    use crate::record::Step;

    fn record(steps: &[(f64, f64, IntegrityState)]) -> RunRecord {
        let step = |(number, &(error_m, protection_level_m, state)): (usize, &_)| Step {
            time_s: number as f64,
            truth: Pose::default(),
            estimate: Pose {
                x_m: error_m,
                ..Pose::default()
            },
            covariance: None,
            integrity: Some(Integrity {
                state,
                ..Integrity::unavailable(protection_level_m)
            }),
            searching: false,
            snr_db: 0.0,
            faults: ActiveFaults::default(),
        };
        RunRecord {
            run: 0,
            steps: steps.iter().enumerate().map(step).collect(),
            aoa_estimates: Vec::new(),
            bursts_received: 0,
            ranges: 0,
            accepted_ranges: 0,
            constants: None,
            out_of_reach: 0,
        }
    }

    #[test]
    fn counts_alarms_and_exceeded_levels() {
        use IntegrityState::{Degraded, Ok};
        let record = record(&[
            (0.1, 0.8, Ok),
            (0.1, 0.8, Degraded), // a false alarm
            (0.5, 0.4, Ok),       // error exceeds the protection level
            (2.0, 9.0, Ok),       // error exceeds the alert limit for 0 s ...
            (2.0, 9.0, Ok),       // ... 1 s ...
            (2.0, 9.0, Degraded),
            (2.0, 9.0, Ok), // ... and again 3 s after the beginning
            (0.5, 9.0, Ok),
            (2.0, 9.0, Degraded), // a correct alarm
        ]);
        let summary = IntegritySummary::new(&record, 1.5).unwrap();
        assert_eq!((summary.epochs, summary.ok, summary.beyond), (9, 6, 1));
        assert_eq!((summary.alarms, summary.early_alarms), (3, 1));
        assert_eq!(summary.suspicions, 1);
        assert_eq!((summary.longest_silence_s, summary.worst_m), (3.0, 2.0));
        let median = summary.median_ratio();
        // The width of a histogram bin is 6 %.
        assert!((median / 4.5 - 1.0).abs() < 0.06, "{median}");
        let twice = IntegritySummary::sum([&summary, &summary]);
        assert_eq!(twice.beyond, 2);
        assert!((twice.risk() - summary.risk()).abs() < 1e-15);
        assert!((twice.per_h(twice.early_alarms) - 450.0).abs() < 1e-9);
    }

    #[test]
    fn without_protection_levels_there_is_no_summary() {
        let mut record = record(&[(0.1, 0.8, IntegrityState::Ok)]);
        record.steps[0].integrity = None;
        assert_eq!(IntegritySummary::new(&record, 1.5), None);
    }
}
