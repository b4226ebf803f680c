//! Output of the poses as a TUM trajectory: one line for each odometry sample.

use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use onboard::live::State;
use recording::{TimedPose, tum_text};

use super::file::GrowingFile;
use super::output::Sink;
use super::record::{PoseCause, PoseRecord, Record};

/// Writer of a TUM trajectory.
pub struct Tum {
    path: PathBuf,
    file: Option<GrowingFile>,
}

impl Tum {
    /// Creates a writer to the file `path`.
    pub fn new(path: &Path) -> Self {
        Self {
            path: path.to_owned(),
            file: None,
        }
    }
}

impl Sink for Tum {
    fn open(&mut self) -> Result<bool> {
        // After a failure the file continues behind its last complete line.
        if !self.file.as_mut().is_some_and(GrowingFile::repair) {
            self.file = None;
            self.file = Some(GrowingFile::create(&self.path)?);
        }
        Ok(false)
    }

    fn take(&mut self, record: &Record) -> Result<bool> {
        // No pose is written before the first pose is found.
        if let Record::Pose(PoseRecord {
            status,
            by: PoseCause::Odometry,
        }) = record
            && let Some(pose) = status.pose
            && !matches!(status.state, State::Waiting | State::Searching)
            && let Some(file) = &mut self.file
        {
            let time_s = status.time_s;
            let line = tum_text(&[TimedPose { time_s, pose }]);
            file.write_all(line.as_bytes())
                .with_context(|| self.path.display().to_string())?;
            return Ok(true);
        }
        Ok(false)
    }

    fn flush(&mut self) -> Result<bool> {
        if let Some(file) = &mut self.file {
            file.flush()
                .with_context(|| self.path.display().to_string())?;
            file.check_exists()?;
        }
        Ok(true)
    }

    fn abandon(&mut self) {
        if let Some(file) = &mut self.file {
            file.repair();
        }
    }

    fn close(&mut self) -> Result<()> {
        self.flush().map(drop)
    }
}
