//! Poses as a TUM trajectory, one for each odometry sample.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

use anyhow::Result;
use onboard::live::State;
use recording::{TimedPose, tum_text};

use super::file::create;
use super::record::{By, PoseRecord, Record};

/// A trajectory being written.
pub struct Tum(BufWriter<File>);

impl Tum {
    /// Begins the file.
    ///
    /// # Errors
    /// Those of the file system.
    pub fn new(path: &Path) -> Result<Self> {
        Ok(Self(create(path)?))
    }

    /// Writes a pose; none while the first is searched for.
    pub fn take(&mut self, record: &Record) -> Result<()> {
        if let Record::Pose(PoseRecord {
            status,
            by: By::Odometry,
        }) = record
            && let Some(pose) = status.pose
            && !matches!(status.state, State::Waiting | State::Searching)
        {
            let time_s = status.time_s;
            self.0
                .write_all(tum_text(&[TimedPose { time_s, pose }]).as_bytes())?;
        }
        Ok(())
    }

    /// Writes all to the disk.
    pub fn flush(&mut self) -> Result<()> {
        Ok(self.0.flush()?)
    }
}
