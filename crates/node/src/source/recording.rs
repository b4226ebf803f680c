//! Recording in place of a radio, played in real time.

use std::sync::Arc;
use std::time::{Duration, Instant};

use num_complex::Complex32;
use recording::{Recording, RecordingError, Segment};

use crate::gate::RxWindow;
use crate::inbox::{Block, Inbox, Input};
use crate::statistics::SourceHealth;

/// Duration of a block in seconds if all samples are required.
const BLOCK_S: f64 = 1e-3;
/// Maximum duration of a block in a window in seconds. A window is read as a whole at its end; a
/// burst of SSBs is within half a frame (5 ms).
const WINDOW_S: f64 = 10e-3;

/// Recording as blocks in order of time; gaps between segments give no blocks.
pub struct Blocks {
    recording: Recording,
    segments: Vec<Segment>,
    rate_hz: f64,
    start_s: f64,
    /// Maximum duration of a block in seconds.
    pub block_s: f64,
    at: u64,
}

impl Blocks {
    /// Creates the blocks from the first sample, which was received at `start_s`.
    pub fn new(recording: Recording, start_s: f64, block_s: f64) -> Self {
        let rate_hz = recording.sample_rate_hz();
        Self {
            rate_hz,
            start_s,
            block_s,
            at: 0,
            segments: recording.segments(),
            recording,
        }
    }

    /// Returns the time of the next block's first sample; `None` at the end.
    pub fn next_s(&self) -> Option<f64> {
        (self.at < self.recording.length()).then(|| self.time_s(self.at))
    }

    /// Returns the duration of a block in seconds.
    pub fn length_s(&self, samples: &[Vec<Complex32>]) -> f64 {
        samples.first().map_or(0, Vec::len) as f64 / self.rate_hz
    }

    fn time_s(&self, sample: u64) -> f64 {
        self.start_s + self.index(sample) as f64 / self.rate_hz
    }

    /// Returns the segment that contains a sample of the file.
    fn segment(&self, sample: u64) -> Option<&Segment> {
        self.segments.iter().rfind(|it| it.start <= sample)
    }

    /// Returns the index of a sample of the file including missing samples.
    fn index(&self, sample: u64) -> u64 {
        self.segment(sample)
            .map_or(sample, |it| it.number_of(sample))
    }

    /// Returns the end of the segment that contains the next sample.
    fn segment_end(&self) -> u64 {
        let end = self.segment(self.at).map(|it| it.start + it.length);
        end.unwrap_or(self.recording.length())
    }

    /// Skips the samples that were received before `time_s` and returns their number.
    pub fn skip_to(&mut self, time_s: f64) -> u64 {
        let (first, wanted) = (self.at, (time_s - self.start_s) * self.rate_hz);
        while self.at < self.recording.length() {
            let missing = (wanted - self.index(self.at) as f64).ceil();
            if missing <= 0.0 {
                break;
            }
            self.at += (missing as u64).min(self.segment_end() - self.at);
        }
        self.at - first
    }

    /// Reads the next block and returns its time; `None` at the end.
    ///
    /// # Errors
    /// Errors of the file.
    pub fn read(&mut self, into: &mut Vec<Vec<Complex32>>) -> Result<Option<f64>, RecordingError> {
        let Some(time_s) = self.next_s() else {
            return Ok(None);
        };
        let block = ((self.block_s * self.rate_hz) as u64).max(1);
        let count = block.min(self.segment_end() - self.at);
        self.recording.read(self.at, count as usize, into)?;
        self.at += count;
        Ok(Some(time_s))
    }
}

/// Plays a recording in real time until it ends or the node stops. Samples that the gate does not require are
/// not read, like with a radio that is switched off.
pub fn run(
    recording: Recording,
    start_s: f64,
    gate: &RxWindow,
    inbox: &Inbox,
    health: &Arc<SourceHealth>,
) {
    let channels = recording.channels();
    let mut blocks = Blocks::new(recording, start_s, BLOCK_S);
    let began = Instant::now();
    let first_s = blocks.next_s().unwrap_or(start_s);
    let until = |time_s: f64| {
        let due = Duration::try_from_secs_f64(time_s - first_s).unwrap_or_default();
        due.saturating_sub(began.elapsed())
    };
    while let Some(next_s) = blocks.next_s()
        && !inbox.is_closed()
    {
        let wanted = gate.wanted();
        blocks.block_s = wanted.map_or(BLOCK_S, |[_, until_s]| {
            (until_s - next_s).clamp(BLOCK_S, WINDOW_S)
        });
        let on_s = match wanted {
            Some([from_s, _]) if from_s > next_s => from_s,
            // The window is over, and the next one is not set yet.
            Some([_, until_s]) if until_s <= next_s => next_s + BLOCK_S,
            _ => next_s,
        };
        if on_s > next_s {
            let off = until(on_s);
            health.rests(blocks.skip_to(on_s), off);
            std::thread::sleep(off);
            inbox.put(Input::Slept(on_s));
            continue;
        }
        std::thread::sleep(until(next_s + blocks.block_s));
        let mut antennas = inbox.buffers(channels);
        match blocks.read(&mut antennas) {
            Ok(None) => break,
            Ok(Some(time_s)) => {
                let count = antennas.first().map_or(0, Vec::len);
                health.came(count as u64);
                inbox.put(Input::Samples(Block {
                    time_s,
                    offset_s: None,
                    antennas,
                }));
            }
            Err(error) => {
                let (source, text) = ("samples", error.to_string());
                inbox.put(Input::warning(source, text));
                break;
            }
        }
    }
}
