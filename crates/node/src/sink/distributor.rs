//! Distribution of every record to every output. An output that fails or is slow does not affect
//! the others.

use std::sync::Arc;

use super::queue::Queue;
use super::record::Record;
use crate::health::{Change, OutputHealth, OutputStatus};

/// Queue and health of one output.
#[derive(Clone)]
pub struct Lane {
    /// Records that wait for the output.
    pub queue: Arc<Queue>,
    /// Health of the output.
    pub health: Arc<OutputHealth>,
}

/// Distributor of every record to every output.
pub struct Distributor {
    lanes: Vec<Lane>,
    /// Whether a full queue of a working output makes the pipeline wait, as in playback; otherwise the oldest
    /// record is dropped.
    waits: bool,
}

impl Distributor {
    /// Creates a distributor to outputs with these names.
    pub fn new(names: &[&'static str], waits: bool) -> Self {
        let lane = |name: &&'static str| Lane {
            queue: Arc::default(),
            health: Arc::new(OutputHealth::new(name)),
        };
        Self {
            lanes: names.iter().map(lane).collect(),
            waits,
        }
    }

    /// Whether the pipeline waits for working outputs.
    pub const fn waits(&self) -> bool {
        self.waits
    }

    /// Returns the queue and health of each output.
    pub fn lanes(&self) -> &[Lane] {
        &self.lanes
    }

    /// Puts a record into the queue of every output.
    pub fn put(&self, record: Record) {
        let record = Arc::new(record);
        for lane in &self.lanes {
            let waits = || self.waits && lane.health.is_ok();
            let dropped = lane.queue.put(Arc::clone(&record), waits);
            if dropped > 0 {
                lane.health.count_dropped(dropped);
            }
        }
    }

    /// Closes all queues, so that no more records are accepted.
    pub fn close(&self) {
        self.lanes.iter().for_each(|it| it.queue.close());
    }

    /// Returns the health of each output.
    pub fn status(&self) -> Vec<OutputStatus> {
        self.lanes.iter().map(|it| it.health.status()).collect()
    }

    /// Returns the number of records lost by all outputs.
    pub fn dropped(&self) -> u64 {
        self.lanes.iter().map(|it| it.health.dropped()).sum()
    }

    /// Returns the failures and recoveries since the last call, and removes them.
    pub fn changes(&self) -> Vec<Change> {
        if !self.waits {
            // A reader of a playback may pause it.
            self.lanes.iter().for_each(|it| it.health.check_stall());
        }
        let changes = self.lanes.iter().flat_map(|it| it.health.take_changes());
        changes.collect()
    }
}

#[cfg(test)]
mod tests {
    use std::collections::VecDeque;
    use std::time::{Duration, Instant};

    use super::*;
    use crate::inbox::Level;

    fn event(number: usize) -> Record {
        Record::Event {
            time_s: None,
            level: Level::Info,
            source: "test",
            text: number.to_string(),
            count: 1,
        }
    }

    #[test]
    fn playback_waits_for_a_working_output_and_not_for_a_failed_one() {
        let distributor = Distributor::new(&["json", "tum"], true);
        let [working, failed] = distributor.lanes() else {
            panic!("two lanes");
        };
        failed.health.fail("disk full".to_owned());
        let count = 10_000;
        let taken = std::thread::scope(|scope| {
            scope.spawn(|| {
                (0..count).for_each(|number| distributor.put(event(number)));
                distributor.close();
            });
            let (mut all, mut batch) = (0, VecDeque::new());
            while working.queue.take(Duration::from_secs(10), &mut batch) {
                all += batch.len();
                batch.clear();
            }
            all
        });
        assert_eq!(taken, count);
        let dropped: Vec<u64> = distributor.status().iter().map(|it| it.dropped).collect();
        assert_eq!(dropped, [0, count as u64 - 4096]);
    }

    #[test]
    fn a_live_pipeline_never_waits() {
        let distributor = Distributor::new(&["json"], false);
        let began = Instant::now();
        (0..10_000).for_each(|number| distributor.put(event(number)));
        assert!(began.elapsed() < Duration::from_secs(5));
        assert_eq!(distributor.dropped(), 10_000 - 4096);
    }
}
