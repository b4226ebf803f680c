//! Threads of the outputs, with retries of a failed output.

use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::mpsc::{self, Sender};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use anyhow::Result;

use super::distributor::{Distributor, Lane};
use super::json::Json;
use super::mcap::Mcap;
use super::mqtt::Mqtt;
use super::output::Sink;
use super::record::Record;
use super::tum::Tum;
use crate::settings::Outputs;

/// Maximum time between two calls of [`Sink::flush`].
const FLUSH: Duration = Duration::from_millis(200);
/// Time from a failure to the first retry. It doubles with each retry that fails.
const FIRST_RETRY: Duration = Duration::from_millis(250);
/// Maximum time between retries, so that an output works again within 5 s after the cause has
/// ended.
const MAX_RETRY: Duration = Duration::from_secs(2);
/// Maximum time for which the start of the node waits for the outputs. A slower output opens later.
const START_PATIENCE: Duration = Duration::from_millis(500);
/// Maximum time without progress of an output that finishes after the last record.
const END_PATIENCE: Duration = Duration::from_secs(5);

/// Creates the outputs of the settings; nothing is opened.
pub fn sinks(
    settings: &Outputs,
    node: &str,
    alert_limit_m: f64,
) -> Vec<(&'static str, Box<dyn Sink>)> {
    let mut sinks: Vec<(&'static str, Box<dyn Sink>)> = Vec::new();
    if let Some(json) = &settings.json {
        sinks.push(("json", Box::new(Json::new(json))));
    }
    if let Some(tum) = &settings.tum {
        sinks.push(("tum", Box::new(Tum::new(tum))));
    }
    if let Some(mcap) = &settings.mcap {
        sinks.push(("mcap", Box::new(Mcap::new(mcap))));
    }
    if let Some(mqtt) = &settings.mqtt {
        sinks.push(("mqtt", Box::new(Mqtt::new(mqtt, node, alert_limit_m))));
    }
    sinks
}

/// The threads of all outputs.
pub struct Running {
    threads: Vec<JoinHandle<()>>,
    records: Arc<Distributor>,
}

/// Starts a thread for each output, and waits up to 0.5 s until all are open. The names in `records` are those of
/// `sinks`, in the same order.
///
/// # Errors
/// If a thread cannot be started.
pub fn start(
    sinks: Vec<(&'static str, Box<dyn Sink>)>,
    records: &Arc<Distributor>,
) -> Result<Running> {
    let mut threads = Vec::new();
    let (opened, openings) = mpsc::channel();
    for ((name, sink), lane) in sinks.into_iter().zip(records.lanes()) {
        let runner = Runner::new(sink, lane.clone());
        let thread = thread::Builder::new().name(name.to_owned());
        let opened = opened.clone();
        threads.push(thread.spawn(move || runner.run(&opened))?);
    }
    let due = Instant::now() + START_PATIENCE;
    for _ in &threads {
        let left = due.saturating_duration_since(Instant::now());
        if openings.recv_timeout(left).is_err() {
            break;
        }
    }
    Ok(Running {
        threads,
        records: Arc::clone(records),
    })
}

impl Running {
    /// Waits until every working output has written all records and is complete; the queues must be closed.
    /// Returns the outputs that have failed, one line each.
    pub fn finish(self) -> Vec<String> {
        let lanes = self.records.lanes();
        let mut failed = Vec::new();
        for (thread, lane) in self.threads.into_iter().zip(lanes) {
            let mut progress = (Instant::now(), 0);
            while !thread.is_finished() {
                let status = lane.health.status();
                let done = status.written + status.dropped;
                if done != progress.1 {
                    progress = (Instant::now(), done);
                }
                // In playback, the reader of an output determines the speed.
                let may_abandon = !self.records.waits() || !status.ok;
                if may_abandon && progress.0.elapsed() > END_PATIENCE {
                    lane.health
                        .fail("it was not complete 5 s after the last record".to_owned());
                    break;
                }
                thread::sleep(Duration::from_millis(5));
            }
            if thread.is_finished() && thread.join().is_err() {
                lane.health.fail("its thread has panicked".to_owned());
            }
            let status = lane.health.status();
            if let Some(cause) = status.cause {
                let (name, dropped) = (status.name, status.dropped);
                failed.push(format!(
                    "output.{name} had failed at the end of the node: {cause}; {dropped} records were not written"
                ));
            }
        }
        failed
    }
}

/// Retries of a failed output.
struct Retry {
    due: Instant,
    wait: Duration,
}

struct Runner {
    sink: Box<dyn Sink>,
    lane: Lane,
    /// Whether the output is open. It works once a flush has succeeded after opening.
    is_open: bool,
    retry: Retry,
    /// Records taken since the last complete flush. They are lost if the output fails.
    unwritten: u64,
}

impl Runner {
    fn new(sink: Box<dyn Sink>, lane: Lane) -> Self {
        Self {
            sink,
            lane,
            is_open: false,
            retry: Retry {
                due: Instant::now(),
                wait: FIRST_RETRY,
            },
            unwritten: 0,
        }
    }

    fn run(mut self, opened: &Sender<()>) {
        self.open();
        // The receiver no longer exists if opening took long.
        let _ = opened.send(());
        let mut taken = VecDeque::new();
        let queue = Arc::clone(&self.lane.queue);
        while queue.take(FLUSH, &mut taken) {
            if !self.is_open && Instant::now() >= self.retry.due {
                self.lane.health.count_retry();
                self.open();
            }
            for record in taken.drain(..) {
                self.take(&record);
            }
            self.flush();
        }
        self.close();
    }

    /// Runs an operation of the output, which may block; a failure discards what was not written.
    fn attempt<T>(&mut self, operation: impl FnOnce(&mut dyn Sink) -> Result<T>) -> Option<T> {
        self.lane.health.set_busy(true);
        let done = operation(&mut *self.sink);
        self.lane.health.set_busy(false);
        match done {
            Ok(value) => Some(value),
            Err(error) => {
                self.sink.abandon();
                self.lane
                    .health
                    .count_dropped(std::mem::take(&mut self.unwritten));
                self.lane.health.fail(format!("{error:#}"));
                self.is_open = false;
                self.retry.due = Instant::now() + self.retry.wait;
                self.retry.wait = (2 * self.retry.wait).min(MAX_RETRY);
                None
            }
        }
    }

    fn open(&mut self) {
        let opened = self.attempt(|sink| sink.open());
        self.is_open = opened.is_some();
        if opened == Some(true) {
            self.succeed();
        }
    }

    fn take(&mut self, record: &Record) {
        if self.is_open {
            // The record is counted as lost if writing it fails.
            self.unwritten += 1;
            if self.attempt(|sink| sink.take(record)) == Some(false) {
                self.unwritten -= 1;
            }
        } else {
            self.lane.health.count_dropped(1);
        }
    }

    fn flush(&mut self) {
        if self.is_open && self.attempt(|sink| sink.flush()) == Some(true) && self.unwritten > 0 {
            self.succeed();
        }
    }

    fn close(&mut self) {
        if self.is_open && self.attempt(|sink| sink.close()).is_some() {
            self.succeed();
        }
    }

    /// Records that the output works.
    fn succeed(&mut self) {
        self.lane
            .health
            .count_written(std::mem::take(&mut self.unwritten));
        self.lane.health.recover();
        self.retry.wait = FIRST_RETRY;
    }
}
