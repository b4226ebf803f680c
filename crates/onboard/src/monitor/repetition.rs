//! Runs of repeated values of a source with noise.
//!
//! The rate of repetitions is estimated while the vehicle moves. Under independent repetitions, a run of `n` has the
//! probability `rateⁿ`. A source without noise, or with a coarse resolution, repeats often and is never suspicious.

/// Minimum number of values from which the rate is estimated.
const MIN_SAMPLES: u32 = 50;
/// Number of values at which all counts are halved.
const MAX_SAMPLES: u32 = 400;
/// Negative logarithm of the probability of a suspicious run without a fault: 1e-6.
const EVIDENCE: f64 = 13.8;
/// Minimum number of repetitions of a suspicious run.
const MIN_RUN: u32 = 5;

/// Counts of repeated values.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Repetitions {
    samples: u32,
    repeated: u32,
    run: u32,
    /// Whether the current run belongs to a fault, so that it does not change the estimated rate.
    is_fault: bool,
}

impl Repetitions {
    /// Returns the number of values from which the rate is estimated.
    pub const fn samples(&self) -> u32 {
        self.samples
    }

    /// Returns the length of the current run.
    pub const fn run(&self) -> u32 {
        self.run
    }

    /// Counts a value that repeats the previous one.
    pub const fn repeat(&mut self) {
        self.run = self.run.saturating_add(1);
    }

    /// Counts a value that differs from the previous one. Returns how often the counts were halved.
    pub fn change(&mut self) -> u32 {
        let halved = self.count_run();
        self.samples += 1;
        halved
    }

    /// Adds the current run to the counts, and begins a new one. Returns how often the counts were halved.
    pub fn count_run(&mut self) -> u32 {
        let run = std::mem::take(&mut self.run);
        if !std::mem::take(&mut self.is_fault) {
            self.samples = self.samples.saturating_add(run);
            self.repeated = self.repeated.saturating_add(run);
        }
        let mut halved = 0;
        while self.samples >= MAX_SAMPLES {
            self.samples /= 2;
            self.repeated /= 2;
            halved += 1;
        }
        halved
    }

    /// Discards the current run.
    pub const fn interrupt(&mut self) {
        (self.run, self.is_fault) = (0, false);
    }

    /// Whether the current run is improbable for the source.
    pub fn is_suspicious(&self) -> bool {
        let rate = f64::from(self.repeated + 1) / (f64::from(self.samples) + 2.0);
        self.samples >= MIN_SAMPLES
            && self.run >= MIN_RUN
            && -f64::from(self.run) * rate.ln() >= EVIDENCE
    }

    /// Marks the current run as that of a fault.
    pub const fn mark_fault(&mut self) {
        self.is_fault = self.run > 0;
    }
}
