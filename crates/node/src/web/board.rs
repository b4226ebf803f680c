//! State of the web page and the metrics, written by the pipeline and read by the web server.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use onboard::live::{HeadStatus, LiveEnergy, Status, StreamCounts};
use onboard::settings::Site;
use serde_json::{Value, json};

use super::site::site_json;
use crate::events;
use crate::inbox::{Inbox, Level};
use crate::sink::{Distributor, EnergyMessage, HeadMessage, PoseFields};
use crate::statistics::{
    LatencyStats, ODOMETRY_TO_POSE_TARGETS, SSB_TO_POSE_TARGETS, SourceHealth,
};

/// Maximum number of events that the page shows, one for each cause.
const EVENTS: usize = 30;
/// Maximum number of points of the track; with more, every second one is kept.
const TRACK: usize = 2000;
/// Initial distance between points of the track (m).
const TRACK_M: f64 = 0.25;

/// Counters of other parts of the node.
pub struct Counters {
    /// Queue of the inputs.
    pub inbox: Arc<Inbox>,
    /// Outputs.
    pub records: Arc<Distributor>,
    /// Latencies.
    pub latency_stats: Arc<LatencyStats>,
    /// Sources.
    pub sources: Vec<Arc<SourceHealth>>,
    /// Sample rate in Hz; 0 without samples.
    pub rate_hz: f64,
}

/// The site of the map.
#[derive(Debug, Clone, Default)]
pub struct ShownSite {
    /// Road and radio heads as JSON, with the number of the site.
    pub json: Arc<str>,
    /// Names of the radio heads, with cell and beam.
    pub heads: Arc<[(u16, u8, String)]>,
    /// Number of changes since the start.
    pub number: u64,
}

/// The newest state.
#[derive(Debug, Clone)]
pub struct Shown {
    /// Time of the drive (s).
    pub now_s: f64,
    /// Pose, state and reason.
    pub status: Status,
    /// The radio heads.
    pub heads: Vec<HeadStatus>,
    /// Number of operations and their energy.
    pub energy: LiveEnergy,
    /// Counts of the samples that the pipeline has processed.
    pub counts: StreamCounts,
}

#[derive(Default)]
struct State {
    site: ShownSite,
    shown: Option<Shown>,
    /// Time of the newest state.
    shown_at: Option<Instant>,
    number: u64,
    due: Option<Instant>,
    events: VecDeque<Row>,
    track: Vec<[f64; 2]>,
    track_m: f64,
}

/// Events of one cause.
struct Row {
    key: String,
    level: Level,
    source: &'static str,
    text: String,
    count: u64,
    time_s: Option<f64>,
    since_start_s: f64,
}

/// The state that the page and the metrics show.
pub struct StatusBoard {
    state: Mutex<State>,
    name: String,
    period: Duration,
    /// Counters of the other parts of the node.
    pub counters: Counters,
    began: Instant,
}

impl StatusBoard {
    /// Creates the board of a node without data, with its name and update period.
    pub fn new(name: &str, period: Duration, counters: Counters) -> Self {
        let state = State {
            track_m: TRACK_M,
            ..State::default()
        };
        Self {
            state: Mutex::new(state),
            name: name.to_owned(),
            period,
            counters,
            began: Instant::now(),
        }
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Sets the site of the map.
    pub fn set_site(&self, site: &Site) {
        let mut json = site_json(site, &self.name);
        let heads = site.radio_heads.iter();
        let heads = heads.map(|it| (it.pci, it.ssb_index, it.name.clone()));
        let mut state = self.lock();
        state.number += 1;
        state.site.number += 1;
        json["number"] = json!(state.site.number);
        state.site.json = json.to_string().into();
        state.site.heads = heads.collect();
    }

    /// Returns the site of the map.
    pub fn site(&self) -> ShownSite {
        self.lock().site.clone()
    }

    /// Whether the next update is due.
    pub fn is_due(&self) -> bool {
        let mut state = self.lock();
        let now = Instant::now();
        if state.due.is_some_and(|due| now < due) {
            return false;
        }
        state.due = Some(now + self.period);
        true
    }

    /// Updates the state.
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
        state.shown_at = Some(Instant::now());
        state.shown = Some(Shown {
            now_s,
            status: *status,
            heads: heads.to_vec(),
            energy: *energy,
            counts,
        });
    }

    /// Adds an event. Events of one cause are one row with their number; the newest row is the last.
    pub fn event(&self, time_s: Option<f64>, level: Level, source: &'static str, text: String) {
        let mut state = self.lock();
        let key = events::key(&text);
        let is_same = |it: &Row| it.source == source && it.level == level && it.key == key;
        let same = state.events.iter().position(is_same);
        let same = same.and_then(|index| state.events.remove(index));
        if state.events.len() == EVENTS {
            state.events.pop_front();
        }
        state.events.push_back(Row {
            key,
            level,
            source,
            text,
            count: same.map_or(1, |it| it.count + 1),
            time_s,
            since_start_s: self.began.elapsed().as_secs_f64(),
        });
        state.number += 1;
    }

    /// Returns the number of the newest update.
    pub fn number(&self) -> u64 {
        self.lock().number
    }

    /// Returns the newest state.
    pub fn shown(&self) -> Option<Shown> {
        self.lock().shown.clone()
    }

    /// Returns the track of the vehicle.
    pub fn track(&self) -> Vec<[f64; 2]> {
        self.lock().track.clone()
    }

    /// Returns everything that the page shows and that changes, as JSON.
    pub fn to_json(&self) -> Value {
        let state = self.lock();
        let (shown, shown_at) = (state.shown.clone(), state.shown_at);
        let site_number = state.site.number;
        let events: Vec<Value> = state.events.iter().map(row_json).collect();
        drop(state);
        let counters = &self.counters;
        let latency_stats = &counters.latency_stats;
        let [dropped_blocks, dropped_messages] = counters.inbox.dropped();
        let sources: Vec<Value> = counters.sources.iter().map(|it| source_json(it)).collect();
        let mut value = json!({
            "uptime_s": self.began.elapsed().as_secs_f64(),
            "site_number": site_number,
            "age_s": shown_at.map(|it| it.elapsed().as_secs_f64()),
            "events": events,
            "sources": sources,
            "outputs": counters.records.status(),
            "dropped": {
                "blocks": dropped_blocks, "messages": dropped_messages,
                "records": counters.records.dropped(),
            },
            "latency": {
                "ssb_to_pose": latency_stats.ssb_to_pose.quantiles(),
                "odometry_to_pose": latency_stats.odometry_to_pose.quantiles(),
                "jitter": latency_stats.jitter.quantiles(),
            },
            "latency_targets": {
                "ssb_to_pose": SSB_TO_POSE_TARGETS,
                "odometry_to_pose": ODOMETRY_TO_POSE_TARGETS,
            },
        });
        if let Some(shown) = shown {
            value["pose"] = json!(PoseFields::from(&shown.status));
            value["what_to_do"] = json!(shown.status.reason.what_to_do());
            value["now_s"] = json!(shown.now_s);
            let heads = shown.heads.iter();
            value["heads"] = heads
                .map(|it| json!(HeadMessage::new(it, shown.now_s)))
                .collect();
            value["energy"] = json!(EnergyMessage::from(&shown.energy));
            value["duty"] = json!(self.duty(&shown));
            value["found_by_search"] = json!(shown.counts.found);
        }
        value
    }

    /// Returns the fraction of the samples that were processed; `None` without samples.
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
    fn add_to_track(&mut self, point: [f64; 2]) {
        let far = |last: &[f64; 2]| (point[0] - last[0]).hypot(point[1] - last[1]) >= self.track_m;
        if self.track.last().is_none_or(far) {
            self.track.push(point);
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

fn row_json(row: &Row) -> Value {
    json!({
        "time_s": row.time_s, "since_start_s": row.since_start_s, "level": row.level,
        "source": row.source, "text": row.text, "count": row.count,
    })
}

fn source_json(source: &SourceHealth) -> Value {
    json!({
        "name": source.name,
        "silent_s": source.silent_for().as_secs_f64(),
        "items": source.items(),
        "defects": source.defects(),
    })
}
