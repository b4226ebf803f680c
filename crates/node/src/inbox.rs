//! Bounded queue of inputs. If the queue is full, the oldest inputs are dropped, or the producer
//! waits if it reads a file.

use std::collections::VecDeque;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use num_complex::Complex32;
use onboard::geometry::Pose;
use onboard::live::{AngleObservation, RangeObservation};
use onboard::observation::OdometrySample;
use schemars::JsonSchema;
use serde::Serialize;

/// Maximum size of waiting samples in bytes: 0.1 s of four antennas at 3.84 Msps.
pub const MAX_SAMPLE_BYTES: usize = 12 << 20;
/// Maximum number of waiting inputs other than samples.
pub const MAX_WAITING_INPUTS: usize = 4096;
/// Maximum number of buffers kept for reuse.
const MAX_REUSED_BUFFERS: usize = 8;

/// Samples of every antenna in the order of the array.
#[derive(Debug)]
pub struct Block {
    /// Sample time of the first sample in seconds.
    pub time_s: f64,
    /// Time minus sample time in seconds; `None` unless the arrival of counted samples is measured.
    pub offset_s: Option<f64>,
    /// Samples of each antenna, in equal numbers.
    pub antennas: Vec<Vec<Complex32>>,
}

impl Block {
    /// Returns the number of samples per antenna.
    pub fn length(&self) -> usize {
        self.antennas.first().map_or(0, Vec::len)
    }

    fn bytes(&self) -> usize {
        let samples: usize = self.antennas.iter().map(Vec::len).sum();
        samples * size_of::<Complex32>()
    }
}

/// Severity of an event.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Level {
    /// Information.
    Info,
    /// Warning.
    Warn,
}

/// Command from a message.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Command {
    /// Sets the pose, with the covariance of (x, y, heading) if it is known.
    SetPose {
        /// Time of the pose in seconds; `None` for the present.
        time_s: Option<f64>,
        /// New pose.
        pose: Pose,
        /// Covariance of (x, y, heading), row-major, in m², m·rad and rad².
        covariance: Option<[[f64; 3]; 3]>,
    },
    /// Resets all estimates and searches for the pose.
    Reset,
    /// Excludes a cell.
    Exclude(u16),
    /// Includes an excluded cell again.
    Readmit(u16),
}

/// Input of the pipeline.
#[derive(Debug)]
pub enum Input {
    /// Samples.
    Samples(Block),
    /// Time up to which the sources dropped samples that were not required (s).
    Slept(f64),
    /// Odometry.
    Odometry(OdometrySample),
    /// An angle.
    Angle(AngleObservation),
    /// A range or delay.
    Range(RangeObservation),
    /// A command.
    Command(Command),
    /// Event of a source.
    Remark {
        /// Severity.
        level: Level,
        /// Name of the source.
        source: &'static str,
        /// Description.
        text: String,
    },
    /// End of a source.
    End,
}

impl Input {
    /// Creates a warning.
    pub const fn warning(source: &'static str, text: String) -> Self {
        let level = Level::Warn;
        Self::Remark {
            level,
            source,
            text,
        }
    }
}

/// Waiting inputs.
#[derive(Default)]
struct Waiting {
    inputs: VecDeque<(Instant, Input)>,
    sample_bytes: usize,
    others: usize,
    spare: Vec<Vec<Vec<Complex32>>>,
    dropped_blocks: u64,
    dropped_others: u64,
    is_closed: bool,
}

/// Queue from all sources to the pipeline.
#[derive(Default)]
pub struct Inbox {
    waiting: Mutex<Waiting>,
    came: Condvar,
    taken: Condvar,
    /// Whether a producer waits for space instead of dropping inputs, which is correct for files.
    waits: bool,
}

impl Inbox {
    /// Creates an empty queue. If `waits` is true, producers of inputs other than samples wait for
    /// space.
    pub fn new(waits: bool) -> Self {
        Self {
            waits,
            ..Self::default()
        }
    }

    fn lock(&self) -> MutexGuard<'_, Waiting> {
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Adds an input. If the queue is full, drops the oldest input of its kind or waits for space.
    pub fn put(&self, input: Input) {
        let mut waiting = self.lock();
        while self.waits && waiting.others >= MAX_WAITING_INPUTS && !waiting.is_closed {
            waiting = (self.taken.wait(waiting)).unwrap_or_else(PoisonError::into_inner);
        }
        let waiting = &mut *waiting;
        match (&input, waiting.inputs.back_mut()) {
            (Input::Slept(new_s), Some((_, Input::Slept(until_s)))) => {
                *until_s = *new_s;
                return;
            }
            (Input::Samples(block), _) => {
                waiting.sample_bytes += block.bytes();
                while waiting.sample_bytes > MAX_SAMPLE_BYTES && waiting.drop_oldest(true) {}
            }
            _ => {
                waiting.others += 1;
                while waiting.others > MAX_WAITING_INPUTS && waiting.drop_oldest(false) {}
            }
        }
        // The consumer waits only for the first input; each notification is a system call.
        if waiting.inputs.is_empty() {
            self.came.notify_one();
        }
        waiting.inputs.push_back((Instant::now(), input));
    }

    /// Takes the oldest input with its arrival time; `None` after the timeout `wait`, or if the
    /// queue is closed and empty.
    pub fn take(&self, wait: Duration) -> Option<(Instant, Input)> {
        let mut waiting = self.lock();
        if waiting.inputs.is_empty() && !waiting.is_closed {
            let (wait_result, _) = self
                .came
                .wait_timeout(waiting, wait)
                .unwrap_or_else(PoisonError::into_inner);
            waiting = wait_result;
        }
        let (came, input) = waiting.inputs.pop_front()?;
        match &input {
            Input::Samples(block) => waiting.sample_bytes -= block.bytes(),
            _ => waiting.others -= 1,
        }
        if self.waits {
            self.taken.notify_one();
        }
        Some((came, input))
    }

    /// Closes the queue and wakes the consumer.
    pub fn close(&self) {
        self.lock().is_closed = true;
        self.came.notify_all();
        self.taken.notify_all();
    }

    /// Whether the queue is closed.
    pub fn is_closed(&self) -> bool {
        self.lock().is_closed
    }

    /// Returns empty buffers for `antennas` antennas, reused if possible.
    pub fn buffers(&self, antennas: usize) -> Vec<Vec<Complex32>> {
        let mut buffers = self.lock().spare.pop().unwrap_or_default();
        buffers.resize_with(antennas, Vec::new);
        buffers
    }

    /// Returns the buffers of a block for reuse.
    pub fn give_back(&self, mut antennas: Vec<Vec<Complex32>>) {
        antennas.iter_mut().for_each(Vec::clear);
        let mut waiting = self.lock();
        if waiting.spare.len() < MAX_REUSED_BUFFERS {
            waiting.spare.push(antennas);
        }
    }

    /// Returns the number of dropped blocks of samples and of other dropped inputs since the start.
    pub fn dropped(&self) -> [u64; 2] {
        let waiting = self.lock();
        [waiting.dropped_blocks, waiting.dropped_others]
    }
}

impl Waiting {
    /// Drops the oldest block of samples, or the oldest other input; returns `false` if there is
    /// none.
    fn drop_oldest(&mut self, samples: bool) -> bool {
        let of_kind = |(_, it): &(Instant, Input)| matches!(it, Input::Samples(_)) == samples;
        let Some(place) = self.inputs.iter().position(of_kind) else {
            return false;
        };
        if let Some((_, Input::Samples(block))) = self.inputs.remove(place) {
            self.sample_bytes -= block.bytes();
            self.dropped_blocks += 1;
        } else {
            self.others -= 1;
            self.dropped_others += 1;
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn block(time_s: f64) -> Input {
        Input::Samples(Block {
            time_s,
            offset_s: None,
            antennas: vec![vec![Complex32::ZERO; 65_536]; 4],
        })
    }

    #[test]
    fn the_oldest_samples_are_dropped_and_counted_and_odometry_is_not() {
        let inbox = Inbox::default();
        inbox.put(Input::Odometry(OdometrySample::of_speed(0.0, 1.0, None)));
        for number in 0..12 {
            inbox.put(block(f64::from(number)));
        }
        // A block has 2 MiB, so that six blocks fit.
        assert_eq!(inbox.dropped(), [6, 0]);
        let wait = Duration::ZERO;
        assert!(matches!(inbox.take(wait), Some((_, Input::Odometry(_)))));
        for number in 6..12 {
            let Some((_, Input::Samples(block))) = inbox.take(wait) else {
                panic!("no samples");
            };
            assert_eq!(block.time_s, f64::from(number));
            inbox.give_back(block.antennas);
        }
        assert!(inbox.take(wait).is_none());
        assert!(
            inbox
                .buffers(4)
                .iter()
                .all(|it| it.is_empty() && it.capacity() > 0)
        );
    }

    #[test]
    fn a_producer_that_reads_files_waits_and_nothing_is_dropped() {
        let inbox = Inbox::new(true);
        let sent = MAX_WAITING_INPUTS + 1000;
        std::thread::scope(|scope| {
            scope.spawn(|| {
                for number in 0..sent {
                    let sample = OdometrySample::of_speed(number as f64, 1.0, None);
                    inbox.put(Input::Odometry(sample));
                }
            });
            for number in 0..sent {
                let Some((_, Input::Odometry(sample))) = inbox.take(Duration::from_secs(10)) else {
                    panic!("no odometry");
                };
                assert_eq!(sample.time_s, number as f64);
            }
        });
        assert_eq!(inbox.dropped(), [0, 0]);
    }

    #[test]
    fn repeated_sleep_inputs_are_merged() {
        let inbox = Inbox::default();
        for number in 0..10_000 {
            inbox.put(Input::Slept(f64::from(number)));
        }
        assert!(matches!(
            inbox.take(Duration::ZERO),
            Some((_, Input::Slept(9999.0)))
        ));
        assert!(inbox.take(Duration::ZERO).is_none());
        for _ in 0..MAX_WAITING_INPUTS + 3 {
            inbox.put(Input::Command(Command::Reset));
        }
        assert_eq!(inbox.dropped(), [0, 3]);
    }
}
