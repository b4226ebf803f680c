//! Events: each cause is reported when it begins and when it ends.

use std::sync::Arc;
use std::time::{Duration, Instant};

use onboard::live::{LiveError, Status};

use super::Engine;
use crate::events::Report;
use crate::health::failures_text;
use crate::inbox::Level;
use crate::sink::Record;
use crate::statistics::SourceHealth;
use crate::supervisor;

impl Engine {
    /// Reports clock steps of the angles or samples, and the begin and end of a difference between
    /// clocks.
    pub(super) fn report_clocks(&mut self) {
        if let Some(step) = self.live.take_angle_step() {
            let text = format!(
                "the clock of the angles or samples has stepped by {:+.3} s; the step is compensated",
                step.step_s
            );
            self.gate.open();
            self.event(Level::Warn, "angles", text);
        }
        let offset_s = self.live.clock_disagreement_s();
        if offset_s.is_some() != self.clocks_differ {
            self.clocks_differ = offset_s.is_some();
            let (level, text) = match offset_s {
                Some(offset_s) => (
                    Level::Warn,
                    format!(
                        "angles are {:.1} s {} the odometry: synchronize the clocks of the odometry and of the samples \
                         or angles",
                        offset_s.abs(),
                        if offset_s < 0.0 { "behind" } else { "ahead of" }
                    ),
                ),
                None => (
                    Level::Info,
                    "the clocks of angles and odometry agree".to_owned(),
                ),
            };
            self.event(level, "clocks", text);
        }
    }

    /// Reports each fault once when it begins and once when it ends.
    pub(super) fn report_faults(&mut self, status: &Status) {
        let before = std::mem::replace(&mut self.faults, status.faults);
        for active in status.faults.iter().filter(|it| !before.contains(it.fault)) {
            let text = format!("fault {}: {}", active.fault.name(), active.fault);
            self.event(Level::Warn, "monitor", text);
        }
        for ended in before.iter().filter(|it| !status.faults.contains(it.fault)) {
            let text = format!("fault {} has ended", ended.fault.name());
            self.event(Level::Info, "monitor", text);
        }
    }

    /// Reports an unknown radio head once.
    pub(super) fn report_unknown(&mut self, pci: u16, ssb_index: u8) {
        if let Some(text) = self.angle_watch.unknown(pci, ssb_index) {
            self.event(Level::Warn, "angles", text);
        }
    }

    /// Reports silent sources, and the end of their silence.
    pub(super) fn watch(&mut self, sources: &[Arc<SourceHealth>], silent_after: Duration) {
        for source in sources {
            let silent = source.silent_for();
            let is_reported = self.silent.contains(&source.name);
            if silent >= silent_after && !is_reported {
                self.silent.push(source.name);
                let text = format!("no data has arrived for {:.1} s", silent.as_secs_f64());
                self.event(Level::Warn, source.name, text);
            } else if silent < silent_after && is_reported {
                self.silent.retain(|it| *it != source.name);
                self.event(Level::Info, source.name, "sends again".to_owned());
            }
        }
        if let Some((level, text)) = self.angle_watch.change(Instant::now()) {
            self.event(level, "angles", text);
        }
    }

    /// Counts and reports rejected input.
    pub(super) fn refused(&mut self, source: &'static str, error: &LiveError) {
        let named = |name: &str| self.sources.iter().find(|it| it.name == name);
        if let Some(health) = named(source).or_else(|| named("messages")) {
            health.defect();
        }
        self.event(Level::Warn, source, format!("rejected: {error}"));
    }

    /// Reports an event; repetitions of one cause are counted and reported together.
    pub fn event(&mut self, level: Level, source: &'static str, text: String) {
        self.board
            .event(self.clock.now_s(), level, source, text.clone());
        let report = self
            .repeated
            .add(self.now_of_events_s(), level, source, text);
        if let Some(report) = report {
            self.put_event(report);
        }
    }

    /// Reports repeated events that are due; all of them if `all`.
    pub fn report_repeated(&mut self, all: bool) {
        for report in self.repeated.due(self.now_of_events_s(), all) {
            self.put_event(report);
        }
    }

    fn put_event(&mut self, report: Report) {
        let Report {
            level,
            source,
            text,
            count,
        } = report;
        self.records.put(Record::Event {
            time_s: self.clock.now_s(),
            level,
            source,
            text,
            count,
        });
    }

    /// Returns the time for reports of repeated events: real time, or the time of the drive in
    /// playback.
    fn now_of_events_s(&self) -> f64 {
        if self.records.waits() {
            self.clock.now_s().unwrap_or(0.0)
        } else {
            self.began.elapsed().as_secs_f64()
        }
    }

    /// Reports outputs that have failed or have recovered.
    pub(super) fn report_outputs(&mut self) {
        let changes = self.records.changes();
        if changes.is_empty() {
            return;
        }
        self.watchdog
            .set_outputs(failures_text(&self.records.status()));
        for change in changes {
            supervisor::log(&format!("output {}: {}", change.name, change.text));
            self.event(change.level, change.name, change.text);
        }
    }
}
