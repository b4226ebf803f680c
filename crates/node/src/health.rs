//! Health of the outputs: whether each works, since when and why not, and what was lost.
//!
//! The thread of an output writes its [`OutputHealth`]; the pipeline, the page and the metrics read it.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use schemars::JsonSchema;
use serde::Serialize;

use crate::inbox::Level;

/// A write that has not returned for this long counts as a failure of its output: a reader has stopped reading,
/// or storage hangs. Failures are reported within 2 s; a healthy write takes milliseconds.
const STALLED: Duration = Duration::from_millis(1500);
/// Maximum number of unreported changes of one output. The pipeline collects them every 50 ms.
const MAX_CHANGES: usize = 16;

/// Health of one output at one time.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(extend("additionalProperties" = false))]
pub struct OutputStatus {
    /// Name of the output: `json`, `tum`, `mcap` or `mqtt`.
    pub name: &'static str,
    /// Whether the output works.
    pub ok: bool,
    /// Cause of the failure; null while the output works.
    pub cause: Option<String>,
    /// Time since the failure, in seconds; null while the output works.
    pub failed_for_s: Option<f64>,
    /// Number of failures since the start of the node.
    pub failures: u64,
    /// Number of attempts to open the output again since the start of the node.
    pub retries: u64,
    /// Number of records written since the start of the node.
    pub written: u64,
    /// Number of records lost since the start of the node, because the output had failed or was too slow.
    pub dropped: u64,
}

/// A failure or recovery that has not been reported yet.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Change {
    /// Name of the output.
    pub name: &'static str,
    /// `Warn` for a failure, `Info` for a recovery.
    pub level: Level,
    /// Description for events.
    pub text: String,
}

struct Failure {
    cause: String,
    since: Instant,
    /// Records that were lost before this failure.
    dropped_before: u64,
    /// Whether the failure is a write that does not return.
    is_stall: bool,
}

#[derive(Default)]
struct State {
    failure: Option<Failure>,
    changes: VecDeque<Change>,
    /// Start of the write that is in progress.
    busy_since: Option<Instant>,
}

/// Health of one output, shared between threads.
pub struct OutputHealth {
    /// Name of the output.
    pub name: &'static str,
    state: Mutex<State>,
    failures: AtomicU64,
    retries: AtomicU64,
    written: AtomicU64,
    dropped: AtomicU64,
}

impl OutputHealth {
    /// Creates the health of a working output that has written nothing.
    pub fn new(name: &'static str) -> Self {
        Self {
            name,
            state: Mutex::default(),
            failures: AtomicU64::new(0),
            retries: AtomicU64::new(0),
            written: AtomicU64::new(0),
            dropped: AtomicU64::new(0),
        }
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Whether the output works.
    pub fn is_ok(&self) -> bool {
        self.lock().failure.is_none()
    }

    /// Records a failure. A failure during a failure changes the cause and is not reported again.
    pub fn fail(&self, cause: String) {
        self.set_failure(cause, false);
    }

    fn set_failure(&self, cause: String, is_stall: bool) {
        let mut state = self.lock();
        if let Some(failure) = &mut state.failure {
            (failure.cause, failure.is_stall) = (cause, is_stall);
            return;
        }
        self.failures.fetch_add(1, Ordering::Relaxed);
        let text = format!("output failed: {cause}; it is retried, other outputs continue");
        state.report(self.name, Level::Warn, text);
        state.failure = Some(Failure {
            cause,
            since: Instant::now(),
            dropped_before: self.dropped(),
            is_stall,
        });
    }

    /// Records that the output works.
    pub fn recover(&self) {
        let mut state = self.lock();
        if let Some(failure) = state.failure.take() {
            let lost = self.dropped().saturating_sub(failure.dropped_before);
            let failed_s = failure.since.elapsed().as_secs_f64();
            let text = format!(
                "output works again after {failed_s:.1} s; {lost} records were not written"
            );
            state.report(self.name, Level::Info, text);
        }
    }

    /// Marks the start (`true`) or end (`false`) of a write.
    pub fn set_busy(&self, busy: bool) {
        self.lock().busy_since = busy.then(Instant::now);
    }

    /// Counts a write that does not return as a failure, and its return as the end of that failure.
    pub fn check_stall(&self) {
        let state = self.lock();
        let is_stalled = state.busy_since.is_some_and(|it| it.elapsed() > STALLED);
        let was_stalled = state.failure.as_ref().is_some_and(|it| it.is_stall);
        let (is_ok, is_busy) = (state.failure.is_none(), state.busy_since.is_some());
        drop(state);
        if is_stalled && is_ok {
            let seconds = STALLED.as_secs_f64();
            let cause = format!(
                "a write has not returned for {seconds} s: the reader does not read, or storage hangs"
            );
            self.set_failure(cause, true);
        } else if was_stalled && !is_busy {
            self.recover();
        }
    }

    /// Counts an attempt to open the output again.
    pub fn count_retry(&self) {
        self.retries.fetch_add(1, Ordering::Relaxed);
    }

    /// Counts written records.
    pub fn count_written(&self, records: u64) {
        self.written.fetch_add(records, Ordering::Relaxed);
    }

    /// Counts lost records.
    pub fn count_dropped(&self, records: u64) {
        self.dropped.fetch_add(records, Ordering::Relaxed);
    }

    /// Returns the number of lost records.
    pub fn dropped(&self) -> u64 {
        self.dropped.load(Ordering::Relaxed)
    }

    /// Returns the changes since the last call, and removes them.
    pub fn take_changes(&self) -> VecDeque<Change> {
        std::mem::take(&mut self.lock().changes)
    }

    /// Returns the current health.
    pub fn status(&self) -> OutputStatus {
        let state = self.lock();
        let failure = state.failure.as_ref();
        OutputStatus {
            name: self.name,
            ok: failure.is_none(),
            cause: failure.map(|it| it.cause.clone()),
            failed_for_s: failure.map(|it| it.since.elapsed().as_secs_f64()),
            failures: self.failures.load(Ordering::Relaxed),
            retries: self.retries.load(Ordering::Relaxed),
            written: self.written.load(Ordering::Relaxed),
            dropped: self.dropped(),
        }
    }
}

impl State {
    fn report(&mut self, name: &'static str, level: Level, text: String) {
        if self.changes.len() < MAX_CHANGES {
            self.changes.push_back(Change { name, level, text });
        }
    }
}

/// Returns one line that names the failed outputs and their causes; `None` if all outputs work.
pub fn failures_text(outputs: &[OutputStatus]) -> Option<String> {
    let failed: Vec<String> = outputs
        .iter()
        .filter_map(|it| Some(format!("{} ({})", it.name, it.cause.as_ref()?)))
        .collect();
    (!failed.is_empty()).then(|| format!("failed outputs: {}", failed.join(", ")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failure_and_its_recovery_are_reported_once_each() {
        let health = OutputHealth::new("tum");
        health.fail("disk full".to_owned());
        health.count_dropped(3);
        health.fail("still full".to_owned());
        let status = health.status();
        assert!(!status.ok && status.failures == 1 && status.dropped == 3);
        assert_eq!(status.cause.as_deref(), Some("still full"));
        let line = failures_text(&[status, OutputHealth::new("json").status()]);
        assert_eq!(line.unwrap(), "failed outputs: tum (still full)");
        health.recover();
        health.recover();
        let changes = health.take_changes();
        let levels: Vec<Level> = changes.iter().map(|it| it.level).collect();
        assert_eq!(levels, [Level::Warn, Level::Info]);
        assert!(changes[0].text.contains("disk full"), "{changes:?}");
        assert!(changes[1].text.contains("3 records"), "{changes:?}");
        assert!(health.is_ok() && health.take_changes().is_empty());
        assert_eq!(failures_text(&[health.status()]), None);
    }
}
