//! A recording in place of a radio: as fast as it was recorded.

use std::sync::Arc;
use std::time::{Duration, Instant};

use num_complex::Complex32;
use recording::{Capture, Recording, RecordingError};

use crate::inbox::{Block, Inbox, Input};
use crate::statistics::SourceHealth;

/// Samples of a block in seconds.
const BLOCK_S: f64 = 1e-3;

/// A recording block by block, in order of time; where samples are missing between its captures none come.
pub struct Blocks {
    recording: Recording,
    rate_hz: f64,
    start_s: f64,
    block: u64,
    at: u64,
}

impl Blocks {
    /// From the first sample on, which was received at `start_s`.
    pub fn new(recording: Recording, start_s: f64, block_s: f64) -> Self {
        let rate_hz = recording.sample_rate_hz();
        Self {
            rate_hz,
            start_s,
            block: ((block_s * rate_hz) as u64).max(1),
            at: 0,
            recording,
        }
    }

    /// Time of the next block's first sample, as far as there is one.
    pub fn next_s(&self) -> Option<f64> {
        (self.at < self.recording.length()).then(|| self.time_s(self.at))
    }

    /// Length of a block that was read, in seconds.
    pub fn length_s(&self, samples: &[Vec<Complex32>]) -> f64 {
        samples.first().map_or(0, Vec::len) as f64 / self.rate_hz
    }

    fn time_s(&self, sample: u64) -> f64 {
        let captures = &self.recording.metadata().captures;
        let capture = captures.iter().rfind(|it| it.sample_start <= sample);
        let index = capture.map_or(sample, |it| global_index(it) + (sample - it.sample_start));
        self.start_s + index as f64 / self.rate_hz
    }

    /// Reads the next block and says its time; `None` at the end.
    ///
    /// # Errors
    /// Those of the file.
    pub fn read(&mut self, into: &mut Vec<Vec<Complex32>>) -> Result<Option<f64>, RecordingError> {
        let Some(time_s) = self.next_s() else {
            return Ok(None);
        };
        let captures = self.recording.metadata().captures.iter();
        let ends = captures.map(|it| it.sample_start);
        let end = ends.filter(|start| *start > self.at).min();
        let end = end.unwrap_or(u64::MAX).min(self.recording.length());
        let count = self.block.min(end - self.at);
        self.recording.read(self.at, count as usize, into)?;
        self.at += count;
        Ok(Some(time_s))
    }
}

fn global_index(capture: &Capture) -> u64 {
    let stated = capture.other.get("core:global_index");
    let stated = stated.and_then(serde_json::Value::as_u64);
    stated.unwrap_or(capture.sample_start)
}

/// Plays a recording in real time until it or the node ends.
pub fn run(recording: Recording, start_s: f64, inbox: &Inbox, health: &Arc<SourceHealth>) {
    let channels = recording.channels();
    let mut blocks = Blocks::new(recording, start_s, BLOCK_S);
    let began = Instant::now();
    let first_s = blocks.next_s().unwrap_or(start_s);
    while !inbox.is_closed() {
        let mut antennas = inbox.buffers(channels);
        match blocks.read(&mut antennas) {
            Ok(None) => break,
            Ok(Some(time_s)) => {
                let count = antennas.first().map_or(0, Vec::len);
                let end_s = time_s + blocks.length_s(&antennas);
                let due = Duration::try_from_secs_f64(end_s - first_s).unwrap_or_default();
                std::thread::sleep(due.saturating_sub(began.elapsed()));
                health.came(count as u64);
                inbox.put(Input::Samples(Block { time_s, antennas }));
            }
            Err(error) => {
                let (source, text) = ("samples", error.to_string());
                inbox.put(Input::warning(source, text));
                break;
            }
        }
    }
}
