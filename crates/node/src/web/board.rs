//! What page and metrics show: kept by the pipeline, read by whoever asks.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use onboard::live::{HeadStatus, LiveEnergy, Status, StreamCounts};
use serde_json::{Value, json};

use crate::inbox::{Inbox, Level};
use crate::sink::Queue;
use crate::statistics::{Punctuality, SourceHealth};

/// Events that the page shows.
const EVENTS: usize = 30;
/// Places of the track; with more, every second one is kept.
const TRACK: usize = 2000;
/// Distance between places of the track, at first (m).
const TRACK_M: f64 = 0.25;

/// What others count.
pub struct Counters {
    /// Input.
    pub inbox: Arc<Inbox>,
    /// Output.
    pub records: Arc<Queue>,
    /// Punctuality.
    pub punctuality: Arc<Punctuality>,
    /// The sources.
    pub sources: Vec<Arc<SourceHealth>>,
    /// Rate of the samples; 0 without.
    pub rate_hz: f64,
    /// Names of the radio heads, with cell and beam.
    pub heads: Vec<(u16, u8, String)>,
}

/// As things stood when they were shown last.
#[derive(Debug, Clone)]
pub struct Shown {
    /// Time of the drive (s).
    pub now_s: f64,
    /// Pose, state and why.
    pub status: Status,
    /// The radio heads.
    pub heads: Vec<HeadStatus>,
    /// What was done.
    pub energy: LiveEnergy,
    /// What came of the samples that the pipeline was given.
    pub counts: StreamCounts,
}

#[derive(Default)]
struct State {
    shown: Option<Shown>,
    number: u64,
    due: Option<Instant>,
    events: VecDeque<Value>,
    track: Vec<[f64; 2]>,
    track_m: f64,
}

/// The board.
pub struct Board {
    state: Mutex<State>,
    period: Duration,
    /// What others count.
    pub counters: Counters,
    began: Instant,
}

impl Board {
    /// An empty one, to be written so often.
    pub fn new(period: Duration, counters: Counters) -> Self {
        let state = State {
            track_m: TRACK_M,
            ..State::default()
        };
        Self {
            state: Mutex::new(state),
            period,
            counters,
            began: Instant::now(),
        }
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Whether it is time to write again.
    pub fn is_due(&self) -> bool {
        let mut state = self.lock();
        let now = Instant::now();
        if state.due.is_some_and(|due| now < due) {
            return false;
        }
        state.due = Some(now + self.period);
        true
    }

    /// Writes how things stand.
    pub fn show(
        &self,
        now_s: f64,
        status: &Status,
        heads: &[HeadStatus],
        energy: &LiveEnergy,
        counts: StreamCounts,
    ) {
        let mut state = self.lock();
        if let Some(pose) = status.pose
            && status.state.is_localized()
        {
            state.add_to_track([pose.x_m, pose.y_m]);
        }
        state.number += 1;
        state.shown = Some(Shown {
            now_s,
            status: *status,
            heads: heads.to_vec(),
            energy: *energy,
            counts,
        });
    }

    /// Writes an event.
    pub fn event(&self, time_s: Option<f64>, level: Level, source: &str, text: &str) {
        let mut state = self.lock();
        if state.events.len() == EVENTS {
            state.events.pop_front();
        }
        let since_start_s = self.began.elapsed().as_secs_f64();
        state.events.push_back(json!({
            "time_s": time_s, "since_start_s": since_start_s, "level": level, "source": source,
            "text": text,
        }));
        state.number += 1;
    }

    /// Number of what was written last.
    pub fn number(&self) -> u64 {
        self.lock().number
    }

    /// As things stood last.
    pub fn shown(&self) -> Option<Shown> {
        self.lock().shown.clone()
    }

    /// Where the vehicle was.
    pub fn track(&self) -> Vec<[f64; 2]> {
        self.lock().track.clone()
    }

    /// Everything that the page shows and that changes, as JSON.
    pub fn to_json(&self) -> Value {
        let state = self.lock();
        let (shown, events) = (state.shown.clone(), state.events.clone());
        drop(state);
        let counters = &self.counters;
        let punctuality = &counters.punctuality;
        let [dropped_blocks, dropped_messages] = counters.inbox.dropped();
        let sources: Vec<Value> = counters.sources.iter().map(|it| source_json(it)).collect();
        let mut value = json!({
            "uptime_s": self.began.elapsed().as_secs_f64(),
            "events": events,
            "sources": sources,
            "dropped": {
                "blocks": dropped_blocks, "messages": dropped_messages,
                "records": counters.records.dropped(),
            },
            "latency": {
                "ssb_to_pose": punctuality.ssb_to_pose.quantiles(),
                "odometry_to_pose": punctuality.odometry_to_pose.quantiles(),
                "jitter": punctuality.jitter.quantiles(),
            },
        });
        if let Some(shown) = shown {
            value["pose"] = crate::sink::status_json(&shown.status);
            value["what_to_do"] = json!(shown.status.reason.what_to_do());
            value["now_s"] = json!(shown.now_s);
            let heads = shown.heads.iter();
            value["heads"] = heads
                .map(|it| crate::sink::head_json(it, shown.now_s))
                .collect();
            value["energy"] = crate::sink::energy_json(&shown.energy);
            value["duty"] = json!(self.duty(&shown));
            value["found_by_search"] = json!(shown.counts.found);
        }
        value
    }

    /// Share of the samples that were looked at.
    pub fn duty(&self, shown: &Shown) -> Option<f64> {
        let samples = self
            .counters
            .sources
            .iter()
            .find(|it| it.name == "samples")?;
        let came_s = samples.items() as f64 / self.counters.rate_hz;
        (came_s > 0.0).then(|| (shown.counts.taken_s / came_s).min(1.0))
    }
}

impl State {
    fn add_to_track(&mut self, place: [f64; 2]) {
        let far = |last: &[f64; 2]| (place[0] - last[0]).hypot(place[1] - last[1]) >= self.track_m;
        if self.track.last().is_none_or(far) {
            self.track.push(place);
        }
        if self.track.len() > TRACK {
            let mut number = 0;
            self.track.retain(|_| {
                number += 1;
                number % 2 == 1
            });
            self.track_m *= 2.0;
        }
    }
}

fn source_json(source: &SourceHealth) -> Value {
    json!({
        "name": source.name,
        "silent_s": source.silent_for().as_secs_f64(),
        "items": source.items(),
        "defects": source.defects(),
    })
}
