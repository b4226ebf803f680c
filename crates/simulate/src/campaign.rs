//! Many simulated drives, and what they have in common.

use onboard::Custom;
use onboard::energy::{Energy, EnergyModel};
use onboard::geometry::wrap_angle;
use onboard::settings::Extent;
use rayon::ThreadPoolBuilder;
use rayon::prelude::*;

use crate::error::SimulationError;
use crate::histogram::ErrorHistogram;
use crate::integrity_summary::IntegritySummary;
use crate::record::{Found, RunRecord, Step};
use crate::run::{MakeCustom, Simulation};

/// How a campaign is carried out; none of it but `seed`, `first_run` and `runs` touches its numbers.
#[derive(Clone, Copy)]
pub struct CampaignOptions<'a> {
    /// Seed of all random streams.
    pub seed: u64,
    /// Number of the first run, for campaigns in parts.
    pub first_run: u64,
    /// Number of runs.
    pub runs: usize,
    /// Number of threads; `None` for one per core.
    pub threads: Option<usize>,
    /// Whether to keep every run's record.
    pub keep_records: bool,
    /// Keeps each run's errors at every so many SSBs, which takes far less than its record.
    pub errors_every: Option<usize>,
    /// The user's own code, made anew for each run.
    pub custom: &'a MakeCustom<'a>,
    /// Told how many runs are done; `false` stops the campaign.
    pub progress: &'a dyn Fn(usize) -> bool,
}

impl Default for CampaignOptions<'_> {
    /// One run of seed 0 on every core, with nothing kept and nobody told.
    fn default() -> Self {
        Self {
            seed: 0,
            first_run: 0,
            runs: 1,
            threads: None,
            keep_records: false,
            errors_every: None,
            custom: &|_| Ok(Custom::default()),
            progress: &|_| true,
        }
    }
}

/// Errors at one SSB, over all runs that know their pose by then; NaN where none does.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct StepStatistics {
    /// Mean of |x error| in metres.
    pub mean_abs_error_x_m: f64,
    /// Mean of |y error| in metres.
    pub mean_abs_error_y_m: f64,
    /// Root mean square of the horizontal error in metres.
    pub rms_error_m: f64,
    /// What the localizer's covariances make of it; `None` where it has none.
    pub predicted_rms_m: Option<f64>,
    /// Mean of the squared position error normalised by its covariance (NEES), 2 for a localizer
    /// that is as wrong as it says; `None` where it has no covariance, or one without area.
    pub mean_nees: Option<f64>,
    /// Root mean square of the heading error in radians.
    pub rms_heading_error_rad: f64,
    /// Mean SNR by link budget and shadowing, in dB.
    pub mean_snr_db: f64,
    /// Median of the horizontal error in metres.
    pub p50_error_m: f64,
    /// Its 90th percentile.
    pub p90_error_m: f64,
    /// Its 99th percentile.
    pub p99_error_m: f64,
}

/// One run in a line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RunSummary {
    /// Its number.
    pub run: u64,
    /// Estimated angles.
    pub executions: usize,
    /// SSB bursts listened to.
    pub listened: usize,
    /// SSBs at which no choice of angles could keep the bound of an uncertainty-driven wake-up.
    pub out_of_reach: usize,
    /// Longest time from one estimated angle to the next, in seconds; 0 with fewer than two.
    pub longest_gap_s: f64,
    /// Its energy, where the platform has figures for the method.
    pub energy: Option<Energy>,
    /// Root mean square of its horizontal error in metres.
    pub rms_error_m: f64,
    /// Its largest horizontal error in metres.
    pub max_error_m: f64,
    /// Its horizontal error at the end, in metres.
    pub final_error_m: f64,
    /// How its first pose came about; `None` if it was not found.
    pub found: Option<Found>,
}

/// What a campaign found.
#[derive(Debug, Clone, PartialEq)]
pub struct Campaign {
    /// Times of the steps in seconds.
    pub time_s: Vec<f64>,
    /// Statistics of each step.
    pub steps: Vec<StepStatistics>,
    /// The runs, by number.
    pub runs: Vec<RunSummary>,
    /// Horizontal errors of all steps of all runs that know their pose.
    pub errors: ErrorHistogram,
    /// How the runs kept to their protection levels, by number; empty where none are stated.
    pub integrity: Vec<IntegritySummary>,
    /// The runs' records, where asked for.
    pub records: Vec<RunRecord>,
    /// Errors in x and y in metres of each run at every so many SSBs, run by run, where asked for.
    pub errors_m: Vec<[f32; 2]>,
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
    errors: ErrorHistogram,
}

impl Simulation {
    /// Drives many times.
    ///
    /// Runs are computed in parallel and added up in order of their numbers: the result does not
    /// depend on the number of threads, and memory not on the number of runs.
    ///
    /// # Errors
    /// [`SimulationError`] of the first run that fails, or that the caller stopped it.
    pub fn campaign(&self, options: &CampaignOptions<'_>) -> Result<Campaign, SimulationError> {
        let pool = ThreadPoolBuilder::new()
            .num_threads(options.threads.unwrap_or(0))
            .build()?;
        let wave = 8 * pool.current_num_threads();
        let at_once = if options.keep_records {
            options.runs
        } else {
            options.runs.min(wave)
        };
        self.scenario().check_runs(at_once)?;
        let energy = EnergyModel::new(&self.scenario().vehicle, self.platform(), Extent::Value)?;
        let mut sums = vec![StepSums::default(); self.steps()];
        let mut errors = ErrorHistogram::default();
        let mut runs = Vec::new();
        let mut integrity = Vec::new();
        let mut records = Vec::new();
        let mut errors_m = Vec::new();
        let integrity_settings = self.scenario().vehicle.integrity;
        let alert_limit_m = integrity_settings.map_or(f64::INFINITY, |it| it.alert_limit_m);
        while runs.len() < options.runs {
            let first = options.first_run + runs.len() as u64;
            let count = wave.min(options.runs - runs.len()) as u64;
            let (seed, custom) = (options.seed, options.custom);
            let finished: Vec<Result<RunRecord, SimulationError>> = pool.install(|| {
                let numbers = (first..first + count).into_par_iter();
                numbers.map(|run| self.run(seed, run, custom)).collect()
            });
            for record in finished {
                let record = record?;
                add_up(&record, &mut sums, &mut errors);
                runs.push(summary(&record, energy.as_ref()));
                integrity.extend(IntegritySummary::new(&record, alert_limit_m));
                if let Some(every) = options.errors_every {
                    let kept = record.steps.iter().step_by(every.max(1));
                    errors_m.extend(kept.map(Step::error_xy_m));
                }
                if options.keep_records {
                    records.push(record);
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
            errors,
            integrity,
            records,
            errors_m,
        })
    }
}

impl Campaign {
    /// The campaign of these runs, of equally many steps each.
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
        };
        for record in records {
            if sums.is_empty() {
                sums = vec![StepSums::default(); record.steps.len()];
                campaign.time_s = record.steps.iter().map(|step| step.time_s).collect();
            }
            add_up(&record, &mut sums, &mut campaign.errors);
            campaign.runs.push(summary(&record, None));
        }
        campaign.steps = sums.iter().map(StepSums::statistics).collect();
        campaign
    }
}

fn summary(record: &RunRecord, energy: Option<&EnergyModel>) -> RunSummary {
    let located = || record.steps.iter().filter(|step| !step.searching);
    let errors_m = || located().map(Step::error_m);
    let duration_s = record.steps.last().map_or(0.0, |step| step.time_s);
    let executions = record.executions.as_slice();
    let times_s = executions.iter().map(|execution| execution.ssb.time_s);
    let gaps_s = times_s
        .clone()
        .zip(times_s.skip(1))
        .map(|(before, after)| after - before);
    let squares_m2: f64 = errors_m().map(|error_m| error_m * error_m).sum();
    RunSummary {
        run: record.run,
        executions: record.executions.len(),
        listened: record.listened,
        out_of_reach: record.out_of_reach,
        longest_gap_s: gaps_s.fold(0.0, f64::max),
        energy: energy
            .map(|model| model.of_run(record.executions.len(), record.listened, duration_s)),
        rms_error_m: (squares_m2 / located().count() as f64).sqrt(),
        max_error_m: errors_m().fold(0.0, f64::max),
        final_error_m: errors_m().next_back().unwrap_or(f64::NAN),
        found: record.found(),
    }
}

fn add_up(record: &RunRecord, sums: &mut [StepSums], errors: &mut ErrorHistogram) {
    for (step, sums) in record.steps.iter().zip(sums) {
        sums.runs += 1.0;
        sums.snr_db += step.snr_db;
        if step.searching {
            continue;
        }
        sums.located += 1.0;
        let error_m = step.error_m();
        let heading_rad = wrap_angle(step.estimate.heading_rad - step.truth.heading_rad);
        sums.abs_x_m += (step.estimate.x_m - step.truth.x_m).abs();
        sums.abs_y_m += (step.estimate.y_m - step.truth.y_m).abs();
        sums.square_m2 += error_m * error_m;
        // A single run without makes the sum NaN, and the mean none.
        sums.predicted_m2 += step.predicted_m2().unwrap_or(f64::NAN);
        sums.nees += step.nees().unwrap_or(f64::NAN);
        sums.heading_rad2 += heading_rad * heading_rad;
        sums.errors.add(error_m);
        errors.add(error_m);
    }
}

impl StepSums {
    fn statistics(&self) -> StepStatistics {
        let count = self.located;
        let number = |value: f64| (!value.is_nan()).then_some(value);
        let quantile_m = |probability| self.errors.quantile_m(probability).unwrap_or(f64::NAN);
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
