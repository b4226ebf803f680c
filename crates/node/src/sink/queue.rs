//! Records on their way to the sinks: bounded, the oldest are dropped first.

use std::collections::VecDeque;
use std::sync::{Condvar, Mutex, PoisonError};
use std::time::Duration;

use super::record::Record;

/// Records that wait at most: some 20 s of a drive.
const MOST: usize = 4096;

#[derive(Default)]
struct Waiting {
    records: VecDeque<Record>,
    dropped: u64,
    is_closed: bool,
}

/// A queue from the pipeline to the sinks.
pub struct Queue {
    waiting: Mutex<Waiting>,
    came: Condvar,
    taken: Condvar,
    /// Whether the pipeline waits where there is no room, as it may if it plays files.
    waits: bool,
}

impl Queue {
    /// An empty queue; whoever puts into it waits for room where `waits` is true, else the oldest is dropped.
    pub fn new(waits: bool) -> Self {
        Self {
            waiting: Mutex::default(),
            came: Condvar::new(),
            taken: Condvar::new(),
            waits,
        }
    }

    /// Puts a record in.
    pub fn put(&self, record: Record) {
        let mut waiting = self.waiting.lock().unwrap_or_else(PoisonError::into_inner);
        while self.waits && waiting.records.len() >= MOST && !waiting.is_closed {
            waiting = self
                .taken
                .wait(waiting)
                .unwrap_or_else(PoisonError::into_inner);
        }
        if waiting.records.len() >= MOST {
            waiting.records.pop_front();
            waiting.dropped += 1;
        }
        // Whoever takes waits for the first alone; to wake it takes a call of the system.
        let is_first = waiting.records.is_empty();
        waiting.records.push_back(record);
        drop(waiting);
        if is_first {
            self.came.notify_one();
        }
    }

    /// Takes all there are, waiting so long for the first; `false` once it is closed and nothing is left.
    pub fn take(&self, wait: Duration, into: &mut VecDeque<Record>) -> bool {
        let mut waiting = self.waiting.lock().unwrap_or_else(PoisonError::into_inner);
        if waiting.records.is_empty() && !waiting.is_closed {
            let woken = self.came.wait_timeout(waiting, wait);
            (waiting, _) = woken.unwrap_or_else(PoisonError::into_inner);
        }
        into.append(&mut waiting.records);
        if self.waits {
            self.taken.notify_one();
        }
        !(waiting.is_closed && into.is_empty())
    }

    /// No more will come.
    pub fn close(&self) {
        self.waiting
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .is_closed = true;
        self.came.notify_all();
        self.taken.notify_all();
    }

    /// Records that were dropped.
    pub fn dropped(&self) -> u64 {
        self.waiting
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .dropped
    }
}
