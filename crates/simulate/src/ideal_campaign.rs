//! Campaigns of an ideal filter, whose errors have exactly the reported covariance.

use onboard::geometry::Pose;
use onboard::monitor::ActiveFaults;

use crate::campaign::Campaign;
use crate::ideal_filter::{IdealError, IdealFilter};
use crate::record::{RunRecord, Step};

impl IdealFilter {
    /// Simulates a campaign of `runs` runs of the filter's errors. The first two states of the
    /// filter replace x and y.
    pub fn campaign(&self, seed: u64, runs: u64) -> Campaign {
        Campaign::of((0..runs).map(|run| self.record(seed, run)))
    }

    fn record(&self, seed: u64, run: u64) -> RunRecord {
        let step = |(number, drawn): (usize, IdealError)| {
            let [[aa, ab], [ba, bb]] = drawn.covariance_m2;
            let [x_m, y_m] = drawn.error_m;
            Step {
                time_s: number as f64,
                truth: Pose::default(),
                estimate: Pose {
                    x_m,
                    y_m,
                    ..Pose::default()
                },
                covariance: Some([[aa, ab, 0.0], [ba, bb, 0.0], [0.0; 3]]),
                integrity: None,
                searching: false,
                snr_db: 0.0,
                faults: ActiveFaults::default(),
            }
        };
        RunRecord {
            run,
            steps: self.run(seed, run).enumerate().map(step).collect(),
            aoa_estimates: Vec::new(),
            bursts_received: 0,
            ranges: 0,
            accepted_ranges: 0,
            constants: None,
            out_of_reach: 0,
        }
    }
}
