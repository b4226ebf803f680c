//! Bounded queue of records for one output.

use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use super::record::Record;

/// Maximum number of records that wait: about 20 s of a drive.
const CAPACITY: usize = 4096;
/// Interval at which a waiting producer checks whether the output still works.
const CHECK: Duration = Duration::from_millis(100);

#[derive(Default)]
struct Waiting {
    records: VecDeque<Arc<Record>>,
    is_closed: bool,
}

/// Queue from the pipeline to one output.
#[derive(Default)]
pub struct Queue {
    waiting: Mutex<Waiting>,
    came: Condvar,
    taken: Condvar,
}

impl Queue {
    fn lock(&self) -> MutexGuard<'_, Waiting> {
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Adds a record. While the queue is full and `waits` returns true, the caller waits; otherwise the oldest
    /// record is dropped. Returns the number of dropped records.
    pub fn put(&self, record: Arc<Record>, waits: impl Fn() -> bool) -> u64 {
        let mut waiting = self.lock();
        while waiting.records.len() >= CAPACITY && !waiting.is_closed && waits() {
            let wait_result = self.taken.wait_timeout(waiting, CHECK);
            (waiting, _) = wait_result.unwrap_or_else(PoisonError::into_inner);
        }
        let mut dropped = 0;
        if waiting.records.len() >= CAPACITY {
            waiting.records.pop_front();
            dropped = 1;
        }
        // The consumer waits only for the first record; each notification is a system call.
        let is_first = waiting.records.is_empty();
        waiting.records.push_back(record);
        drop(waiting);
        if is_first {
            self.came.notify_one();
        }
        dropped
    }

    /// Takes all records, waiting up to `wait` for the first; returns `false` once the queue is closed and empty.
    pub fn take(&self, wait: Duration, into: &mut VecDeque<Arc<Record>>) -> bool {
        let mut waiting = self.lock();
        if waiting.records.is_empty() && !waiting.is_closed {
            let wait_result = self.came.wait_timeout(waiting, wait);
            (waiting, _) = wait_result.unwrap_or_else(PoisonError::into_inner);
        }
        into.append(&mut waiting.records);
        self.taken.notify_one();
        !(waiting.is_closed && into.is_empty())
    }

    /// Ends the queue: no more records will be added.
    pub fn close(&self) {
        self.lock().is_closed = true;
        self.came.notify_all();
        self.taken.notify_all();
    }
}
