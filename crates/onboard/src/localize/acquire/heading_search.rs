//! Verification of the heading with ranges.
//!
//! Ranges do not measure the heading, so that a filter with a wrong heading rejects them as soon as
//! the vehicle moves. Filters with headings in eight directions therefore run next to the solution
//! for the first metres, and after the solution is lost. The most probable one replaces the
//! solution if its ranges are certainly more probable. The search ends at the first angle, which
//! measures the heading.

use std::f64::consts::TAU;

use crate::clone_in_place::clone_in_place;
use crate::geometry::Pose;
use crate::localize::ekf::Ekf;
use crate::localize::modes::{CERTAIN, range_density};
use crate::localize::output::InitialPose;
use crate::observation::OdometrySample;
use crate::radio_head::RadioHead;
use crate::range::RangeMeasurement;

/// Number of headings.
const HEADINGS: usize = 8;

/// Standard deviation of the heading of each filter (rad): half the angle between two headings.
const HEADING_STD_RAD: f64 = TAU / (2 * HEADINGS) as f64;

/// Distance after which the search ends without a result (m).
const MAX_DRIVEN_M: f64 = 60.0;

/// Log-likelihood ratio of another heading above which the solution is in doubt: odds of 20.
const DOUBT: f64 = 3.0;

clone_in_place! {
    /// Filters with different headings.
    #[derive(Debug)]
    pub struct HeadingSearch {
        filters: Vec<Candidate>,
        /// Log-likelihood of the solution.
        solution: f64,
        begun_m: f64,
    }
}

clone_in_place! {
    #[derive(Debug)]
    struct Candidate {
        ekf: Ekf,
        log_likelihood: f64,
    }
}

impl HeadingSearch {
    /// Creates the search around the position of a filter without a road. `None` if the filter has
    /// a road, which determines the heading, or no ranges.
    pub fn new(given: &Ekf, heads: &[RadioHead], position_std_m: f64) -> Option<Self> {
        let config = given.config();
        if given.has_map() || config.ranging.is_none() {
            return None;
        }
        let estimate = given.pose(given.time_s().max(0.0));
        let here = estimate.pose;
        let position_std_m = position_std_m.hypot(estimate.principal_variances()[0].sqrt());
        let candidate = |number: usize| {
            let start = InitialPose {
                pose: Pose {
                    heading_rad: here.heading_rad + TAU * number as f64 / HEADINGS as f64,
                    ..here
                },
                position_std_m,
                heading_std_rad: HEADING_STD_RAD,
            };
            let mut ekf = Ekf::new(*config, None, heads, &start);
            ekf.resume(given);
            let log_likelihood = 0.0;
            Candidate {
                ekf,
                log_likelihood,
            }
        };
        Some(Self {
            filters: (0..HEADINGS).map(candidate).collect(),
            solution: 0.0,
            begun_m: given.driven_m(),
        })
    }

    /// Predicts with an odometry sample.
    pub fn odometry(&mut self, sample: &OdometrySample) {
        for it in &mut self.filters {
            it.ekf.odometry(sample);
        }
    }

    /// Updates with a range, before the solution is updated with it.
    pub fn update(&mut self, solution: &Ekf, head: &RadioHead, measured: &RangeMeasurement) {
        let Ok(predicted) = solution.predict_range(head, measured) else {
            return;
        };
        if predicted.is_new_sequence {
            return;
        }
        // All filters have the path of the solution: a filter far from the position would expect a blocked path, and ranges
        // would be no evidence against it.
        let (outliers, is_late) = (predicted.late_probability(), predicted.is_late());
        self.solution += range_density(&predicted, outliers).ln();
        for it in &mut self.filters {
            it.ekf.copy_paths(solution);
            let predicted = it.ekf.predict_range(head, measured);
            if let Ok(predicted) = &predicted {
                it.log_likelihood += range_density(predicted, outliers).ln();
            }
            if !is_late {
                it.ekf.update_predicted_range(&predicted);
            }
        }
    }

    fn best(&self) -> Option<&Candidate> {
        let by = |one: &&Candidate, other: &&Candidate| {
            one.log_likelihood.total_cmp(&other.log_likelihood)
        };
        self.filters.iter().max_by(by)
    }

    /// Returns the log-likelihood ratio of the most probable heading to the solution.
    fn advantage(&self) -> f64 {
        self.best()
            .map_or(0.0, |it| it.log_likelihood - self.solution)
    }

    /// Whether another heading is more probable than that of the solution.
    pub fn other_heading_is_likelier(&self) -> bool {
        self.advantage() > DOUBT
    }

    /// Returns the filter that is certainly more probable than the solution, if there is one.
    pub fn found(&self) -> Option<&Ekf> {
        self.best()
            .filter(|_| self.advantage() > CERTAIN)
            .map(|it| &it.ekf)
    }

    /// Whether the search has ended without a result.
    pub fn is_over(&self, solution: &Ekf) -> bool {
        let driven_m = solution.driven_m() - self.begun_m;
        driven_m > MAX_DRIVEN_M && !self.other_heading_is_likelier()
    }
}
