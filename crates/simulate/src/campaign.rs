//! Campaigns of simulated runs and their statistics.

use std::sync::{Mutex, PoisonError};

use onboard::Custom;
use onboard::energy::{Energy, EnergyModel, EstimateCost};
use onboard::geometry::wrap_angle;
use onboard::settings::Extent;
use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuildError, ThreadPoolBuilder};

use crate::error::SimulationError;
use crate::histogram::ErrorHistogram;
use crate::integrity_summary::IntegritySummary;
use crate::record::{Found, RunRecord, Step};
use crate::run::{MakeCustom, Simulation};

/// Options of a campaign. Only `seed`, `first_run` and `runs` influence the numerical results.
#[derive(Clone, Copy)]
pub struct CampaignOptions<'a> {
    /// Seed of all random streams.
    pub seed: u64,
    /// Number of the first run, for campaigns that are computed in parts.
    pub first_run: u64,
    /// Number of runs.
    pub runs: usize,
    /// Number of threads; `None` uses one per core.
    pub threads: Option<usize>,
    /// Whether to keep the record of every run.
    pub keep_records: bool,
    /// Whether to compute quantiles of the error. Quantiles require one histogram per step.
    pub quantiles: bool,
    /// Interval, in SSBs, at which the error and protection level of each run are kept. This takes
    /// far less memory than the records.
    pub errors_every: Option<usize>,
    /// Factory of the user's own estimator, policy and localizer, called once per run.
    pub custom: &'a MakeCustom<'a>,
    /// Cost of one angle estimate.
    pub estimate_cost: EstimateCost,
    /// Progress callback with the number of finished runs; it returns `false` to stop the campaign.
    pub progress: &'a dyn Fn(usize) -> bool,
}

impl Default for CampaignOptions<'_> {
    /// Returns options for one run with seed 0 on every core, without records and without progress
    /// reports.
    fn default() -> Self {
        Self {
            seed: 0,
            first_run: 0,
            runs: 1,
            threads: None,
            keep_records: false,
            quantiles: true,
            errors_every: None,
            custom: &|_| Ok(Custom::default()),
            estimate_cost: EstimateCost::OfMethod,
            progress: &|_| true,
        }
    }
}

/// Errors at one SSB over all runs whose pose is initialised; NaN if there is no initialised run.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct StepStatistics {
    /// Mean of |x error| in metres.
    pub mean_abs_error_x_m: f64,
    /// Mean of |y error| in metres.
    pub mean_abs_error_y_m: f64,
    /// Root mean square of the horizontal error in metres.
    pub rms_error_m: f64,
    /// RMS horizontal error in metres according to the localizer's covariances; `None` without
    /// covariances.
    pub predicted_rms_m: Option<f64>,
    /// Mean normalised estimation error squared (NEES) of the position; 2 for a consistent
    /// localizer. `None` without a covariance or with a singular covariance.
    pub mean_nees: Option<f64>,
    /// RMS heading error in radians.
    pub rms_heading_error_rad: f64,
    /// Mean SNR from link budget and shadowing, in dB.
    pub mean_snr_db: f64,
    /// Median of the horizontal error in metres; NaN if quantiles are not computed.
    pub p50_error_m: f64,
    /// 90th percentile of the horizontal error in metres; NaN if quantiles are not computed.
    pub p90_error_m: f64,
    /// 99th percentile of the horizontal error in metres; NaN if quantiles are not computed.
    pub p99_error_m: f64,
}

/// Summary of one run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RunSummary {
    /// Number of the run.
    pub run: u64,
    /// Number of angle estimates.
    pub aoa_estimates: usize,
    /// Number of SSB bursts received.
    pub bursts_received: usize,
    /// Number of SSBs at which no selection of angles could meet the target error of an
    /// uncertainty-driven wake-up policy.
    pub out_of_reach: usize,
    /// Longest time between consecutive angle estimates in seconds; 0 with fewer than two
    /// estimates.
    pub longest_gap_s: f64,
    /// Energy of the run; `None` if the platform has no figures for the method.
    pub energy: Option<Energy>,
    /// RMS horizontal error in metres.
    pub rms_error_m: f64,
    /// Maximum horizontal error in metres.
    pub max_error_m: f64,
    /// Horizontal error at the end of the run in metres.
    pub final_error_m: f64,
    /// First initialised pose; `None` if the pose was never initialised.
    pub found: Option<Found>,
}

/// Result of a campaign.
#[derive(Debug, Clone, PartialEq)]
pub struct Campaign {
    /// Times of the steps in seconds.
    pub time_s: Vec<f64>,
    /// Statistics of each step.
    pub steps: Vec<StepStatistics>,
    /// Summaries of the runs, ordered by run number.
    pub runs: Vec<RunSummary>,
    /// Histogram of the horizontal errors of all steps of all runs with an initialised pose.
    pub errors: ErrorHistogram,
    /// Integrity summaries, ordered by run number; empty if the localizer reports no protection
    /// levels.
    pub integrity: Vec<IntegritySummary>,
    /// Records of the runs, if `keep_records` is set.
    pub records: Vec<RunRecord>,
    /// Errors in x and y in metres at every `errors_every`-th SSB, run after run; empty if
    /// `errors_every` is not set.
    pub errors_m: Vec<[f32; 2]>,
    /// Protection levels in metres at the same SSBs as `errors_m`; `None` unless the state is `ok`.
    pub levels_m: Vec<Option<f32>>,
}

#[derive(Default, Clone)]
struct StepSums {
    runs: f64,
    located: f64,
    abs_x_m: f64,
    abs_y_m: f64,
    square_m2: f64,
    predicted_m2: f64,
    nees: f64,
    heading_rad2: f64,
    snr_db: f64,
    errors: Option<ErrorHistogram>,
}

impl Simulation {
    /// Simulates `options.runs` runs.
    ///
    /// Runs are computed in parallel and accumulated in the order of their numbers. The result does
    /// not depend on the number of threads, and the memory for statistics does not depend on the
    /// number of runs.
    ///
    /// # Errors
    /// [`SimulationError`] of the first run that fails, or [`SimulationError::Stopped`] if the
    /// caller stopped the campaign.
    pub fn campaign(&self, options: &CampaignOptions<'_>) -> Result<Campaign, SimulationError> {
        let (seed, first, custom) = (options.seed, options.first_run, options.custom);
        let drive = |number, used| self.run_in(used, seed, first + number as u64, custom);
        self.campaign_of(options, options.runs, drive)
    }

    /// Accumulates a campaign of `count` records, which `drive` computes by index in the memory of a
    /// record that is not used any more.
    pub(crate) fn campaign_of(
        &self,
        options: &CampaignOptions<'_>,
        count: usize,
        drive: impl Fn(usize, RunRecord) -> Result<RunRecord, SimulationError> + Sync,
    ) -> Result<Campaign, SimulationError> {
        let pool = thread_pool(options.threads)?;
        let wave = 8 * pool.current_num_threads();
        let at_once = if options.keep_records {
            count
        } else {
            count.min(wave)
        };
        self.scenario().check_runs(at_once)?;
        let (cost, vehicle) = (options.estimate_cost, &self.scenario().vehicle);
        let energy = EnergyModel::with_cost(cost, vehicle, self.platform(), Extent::Value)?;
        let mut sums = vec![StepSums::new(options.quantiles); self.steps()];
        let mut runs = Vec::new();
        let mut integrity = Vec::new();
        let mut records = Vec::new();
        let (mut errors_m, mut levels_m) = (Vec::new(), Vec::new());
        let integrity_settings = self.scenario().vehicle.integrity_monitor();
        let alert_limit_m = integrity_settings.map_or(f64::INFINITY, |it| it.alert_limit_m);
        // The system clears new memory, which takes as long as a run from a trace.
        let spare = Mutex::new(Vec::new());
        let spares = || spare.lock().unwrap_or_else(PoisonError::into_inner);
        let drive = |number| {
            // Release the lock before the run.
            let used = spares().pop();
            drive(number, used.unwrap_or_default())
        };
        while runs.len() < count {
            let first = runs.len();
            let finished: Vec<_> = pool.install(|| {
                let numbers = (first..count.min(first + wave)).into_par_iter();
                numbers.map(&drive).collect()
            });
            let finished = finished.into_iter().collect::<Result<Vec<_>, _>>()?;
            pool.install(|| add_up(&finished, &mut sums));
            for record in finished {
                runs.push(summary(&record, energy.as_ref()));
                integrity.extend(IntegritySummary::new(&record, alert_limit_m));
                if let Some(every) = options.errors_every {
                    let kept = record.steps.iter().step_by(every.max(1));
                    errors_m.extend(kept.clone().map(Step::error_xy_m));
                    levels_m.extend(kept.map(Step::level_while_ok_m));
                }
                if options.keep_records {
                    records.push(record);
                } else {
                    spares().push(record);
                }
            }
            if !(options.progress)(runs.len()) {
                return Err(SimulationError::Stopped);
            }
        }
        Ok(Campaign {
            time_s: (0..self.steps())
                .map(|number| self.time_s(number))
                .collect(),
            steps: sums.iter().map(StepSums::statistics).collect(),
            runs,
            errors: all_errors(&sums),
            integrity,
            records,
            errors_m,
            levels_m,
        })
    }
}

/// Creates a thread pool with the requested number of threads, by default one per core.
pub(crate) fn thread_pool(threads: Option<usize>) -> Result<ThreadPool, ThreadPoolBuildError> {
    ThreadPoolBuilder::new()
        .num_threads(threads.unwrap_or(0))
        .build()
}

impl Campaign {
    /// Creates a campaign from existing records with equal numbers of steps.
    pub(crate) fn of(records: impl IntoIterator<Item = RunRecord>) -> Self {
        let mut sums = Vec::new();
        let mut campaign = Self {
            time_s: Vec::new(),
            steps: Vec::new(),
            runs: Vec::new(),
            errors: ErrorHistogram::default(),
            integrity: Vec::new(),
            records: Vec::new(),
            errors_m: Vec::new(),
            levels_m: Vec::new(),
        };
        for record in records {
            if sums.is_empty() {
                sums = vec![StepSums::new(true); record.steps.len()];
                campaign.time_s = record.steps.iter().map(|step| step.time_s).collect();
            }
            campaign.runs.push(summary(&record, None));
            add_up(&[record], &mut sums);
        }
        campaign.errors = all_errors(&sums);
        campaign.steps = sums.iter().map(StepSums::statistics).collect();
        campaign
    }
}

fn summary(record: &RunRecord, energy: Option<&EnergyModel>) -> RunSummary {
    let located = record.steps.iter().filter(|step| !step.searching);
    let (mut count, mut squares_m2, mut max_error_m, mut final_error_m) = (0, 0.0, 0.0, f64::NAN);
    for error_m in located.map(Step::error_m) {
        count += 1;
        squares_m2 += error_m * error_m;
        max_error_m = f64::max(max_error_m, error_m);
        final_error_m = error_m;
    }
    let duration_s = record.steps.last().map_or(0.0, |step| step.time_s);
    let aoa_estimates = record.aoa_estimates.as_slice();
    let times_s = aoa_estimates
        .iter()
        .map(|angle_result| angle_result.ssb.time_s);
    let gaps_s = times_s
        .clone()
        .zip(times_s.skip(1))
        .map(|(before, after)| after - before);
    RunSummary {
        run: record.run,
        aoa_estimates: record.aoa_estimates.len(),
        bursts_received: record.bursts_received,
        out_of_reach: record.out_of_reach,
        longest_gap_s: gaps_s.fold(0.0, f64::max),
        energy: energy.map(|model| {
            model.run_energy(
                record.aoa_estimates.len(),
                record.bursts_received,
                duration_s,
            )
        }),
        rms_error_m: (squares_m2 / f64::from(count)).sqrt(),
        max_error_m,
        final_error_m,
        found: record.found(),
    }
}

/// Number of steps that one thread accumulates at a time.
const CHUNK: usize = 256;

/// Accumulates the records in order, separately for each step.
fn add_up(records: &[RunRecord], sums: &mut [StepSums]) {
    let chunks = sums.par_chunks_mut(CHUNK).enumerate();
    chunks.for_each(|(number, sums)| {
        for record in records {
            for (step, sums) in record.steps.iter().skip(number * CHUNK).zip(&mut *sums) {
                sums.add(step);
            }
        }
    });
}

/// Merges the error histograms of all steps.
fn all_errors(sums: &[StepSums]) -> ErrorHistogram {
    let mut errors = ErrorHistogram::default();
    let steps = sums.iter().filter_map(|step| step.errors.as_ref());
    steps.for_each(|step| errors.merge(step));
    errors
}

impl StepSums {
    fn new(quantiles: bool) -> Self {
        Self {
            errors: quantiles.then(ErrorHistogram::default),
            ..Self::default()
        }
    }

    fn add(&mut self, step: &Step) {
        self.runs += 1.0;
        self.snr_db += step.snr_db;
        if step.searching {
            return;
        }
        self.located += 1.0;
        let error_m = step.error_m();
        let heading_rad = wrap_angle(step.estimate.heading_rad - step.truth.heading_rad);
        self.abs_x_m += (step.estimate.x_m - step.truth.x_m).abs();
        self.abs_y_m += (step.estimate.y_m - step.truth.y_m).abs();
        self.square_m2 += error_m * error_m;
        // One run without a covariance makes the sum NaN, which is reported as `None`.
        self.predicted_m2 += step.predicted_m2().unwrap_or(f64::NAN);
        self.nees += step.nees().unwrap_or(f64::NAN);
        self.heading_rad2 += heading_rad * heading_rad;
        if let Some(errors) = &mut self.errors {
            errors.add(error_m);
        }
    }

    fn statistics(&self) -> StepStatistics {
        let count = self.located;
        let number = |value: f64| (!value.is_nan()).then_some(value);
        let errors = self.errors.as_ref();
        let quantile_m = |probability| {
            let found_m = errors.and_then(|errors| errors.quantile_m(probability));
            found_m.unwrap_or(f64::NAN)
        };
        StepStatistics {
            mean_abs_error_x_m: self.abs_x_m / count,
            mean_abs_error_y_m: self.abs_y_m / count,
            rms_error_m: (self.square_m2 / count).sqrt(),
            predicted_rms_m: number((self.predicted_m2 / count).sqrt()),
            mean_nees: number(self.nees / count),
            rms_heading_error_rad: (self.heading_rad2 / count).sqrt(),
            mean_snr_db: self.snr_db / self.runs,
            p50_error_m: quantile_m(0.5),
            p90_error_m: quantile_m(0.9),
            p99_error_m: quantile_m(0.99),
        }
    }
}
