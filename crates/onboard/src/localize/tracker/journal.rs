//! Looking back on the drive.

use super::filter::Tracker;
use crate::localize::pose_estimate::PoseEstimate;
use crate::localize::smoother::Journal;

impl Tracker {
    /// Keeps a journal from now on, from which the drive can be smoothed; it grows by about 2 kB
    /// with each odometry sample.
    pub fn keep_journal(&mut self) {
        self.journal.get_or_insert_default();
    }

    /// The poses at the odometry samples since the journal was begun, by everything that is known
    /// now; none without a journal.
    pub fn smoothed(&self) -> Vec<PoseEstimate> {
        let journal = self.journal.iter();
        let beliefs = journal.flat_map(Journal::smoothed);
        beliefs
            .map(|(time_s, belief)| self.pose_of(&belief, time_s, 0.0))
            .collect()
    }

    pub(super) fn ask(&mut self, time_s: f64) {
        if let Some(journal) = &mut self.journal {
            journal.asked(time_s, &self.belief, self.errors.with_state());
        }
    }
}
