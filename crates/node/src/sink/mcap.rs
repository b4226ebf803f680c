//! MCAP files for ROS 2 tools; a new file begins by size and time.

use std::collections::HashMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use onboard::geometry::Pose;
use onboard::live::{HeadStatus, State, Status};
use recording::McapWriter;
use recording::mcap::{DiagnosticLevel, DiagnosticStatus, Frames, NoSeek, Twist};

use super::file::{GrowingFile, Tail, files_of, free_mb, keep_newest};
use super::output::Sink;
use super::record::{PoseCause, PoseRecord, Record};
use crate::health::{OutputStatus, failures_text};
use crate::inbox::Level;
use crate::settings::McapOutput;

const POSE_TOPIC: &str = "/access_av/odometry";
const VERDICT_TOPIC: &str = "/access_av/verdicts";
const PREFIX: &str = "access-av-";
const ENDING: &str = ".mcap";
const MAP_TO_ODOM: Frames<'_> = Frames {
    parent: "map",
    child: "odom",
};
/// Variance of a wheel speed in (m/s)².
const SPEED_VARIANCE: f64 = 1e-4;
/// Variance of a yaw rate in (rad/s)².
const YAW_RATE_VARIANCE: f64 = 1e-4;

/// Maximum time between two chunks. After `kill -9`, the file is readable except the last chunk and
/// the records that wait for their thread.
const CHUNK: Duration = Duration::from_secs(1);
/// Maximum number of events in one diagnostic message.
const MAX_EVENTS: usize = 100;
/// End of an MCAP file without a summary: DataEnd, Footer, magic. It follows the last chunk at any time.
const END: &[u8] = b"\x0f\x04\0\0\0\0\0\0\0\0\0\0\0\
    \x02\x14\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\
    \x89MCAP0\r\n";

type Writer = McapWriter<NoSeek<GrowingFile>>;

/// MCAP files, written one after the other.
pub struct Mcap {
    settings: McapOutput,
    file: Option<Open>,
    number: u32,
    /// Pose that uses only odometry; it defines the transform `map` → `odom`.
    odom: Pose,
    odom_s: Option<f64>,
    last_pose_s: f64,
    last_verdict_s: HashMap<(u16, u8), f64>,
    events: Vec<(Level, String)>,
}

struct Open {
    path: PathBuf,
    writer: Writer,
    tail: Tail,
    began_s: f64,
    flushed: Instant,
    /// Whether messages are in a chunk that is not complete.
    is_dirty: bool,
}

impl Mcap {
    /// Creates the output from the settings; nothing is opened.
    pub fn new(settings: &McapOutput) -> Self {
        Self {
            settings: settings.clone(),
            file: None,
            number: 0,
            odom: Pose::default(),
            odom_s: None,
            last_pose_s: f64::NEG_INFINITY,
            last_verdict_s: HashMap::new(),
            events: Vec::new(),
        }
    }

    /// Removes the oldest complete files until `min_free_mb` are free.
    ///
    /// # Errors
    /// If less is free after that, or those of the file system.
    fn ensure_space(&self) -> Result<()> {
        let (folder, limit_mb) = (&self.settings.folder, self.settings.min_free_mb);
        if limit_mb <= 0.0 || free_mb(folder)? >= limit_mb {
            return Ok(());
        }
        for file in files_of(folder, PREFIX, ENDING)? {
            if self.file.as_ref().is_some_and(|open| open.path == file) {
                continue;
            }
            fs::remove_file(&file)?;
            if free_mb(folder)? >= limit_mb {
                return Ok(());
            }
        }
        let free_mb = free_mb(folder)?;
        bail!(
            "{}: {free_mb:.1} MB are free, less than output.mcap.min_free_mb = {limit_mb}; no older file is left to \
             delete",
            folder.display()
        );
    }

    fn pose(&mut self, record: &PoseRecord) -> Result<bool> {
        let status = &record.status;
        let elapsed_s = self.odom_s.map_or(0.0, |last_s| status.time_s - last_s);
        self.odom_s = Some(status.time_s);
        if (0.0..10.0).contains(&elapsed_s) {
            let turn_rad = status.yaw_rate_radps.unwrap_or(0.0) * elapsed_s;
            self.odom = self
                .odom
                .along_chord(status.speed_mps * elapsed_s, turn_rad);
        }
        let (Some(pose), true) = (
            status.pose,
            is_due(self.last_pose_s, status.time_s, self.settings.pose_hz),
        ) else {
            return Ok(false);
        };
        // No pose is published before the first one is found.
        if matches!(status.state, State::Waiting | State::Searching) {
            return Ok(false);
        }
        self.last_pose_s = status.time_s;
        let odom = self.odom;
        let estimate = onboard::localize::PoseEstimate {
            time_s: status.time_s,
            pose,
            covariance: status.covariance,
            integrity: None,
        };
        let twist = Twist {
            speed_mps: status.speed_mps,
            speed_variance: SPEED_VARIANCE,
            yaw_rate: status.yaw_rate_radps.map(|it| (it, YAW_RATE_VARIANCE)),
        };
        let writer = self.writer(status.time_s)?;
        writer.odometry(POSE_TOPIC, Frames::MAP, &estimate, &twist)?;
        let transforms = [(MAP_TO_ODOM, between(pose, odom)), (Frames::ODOM, odom)];
        writer.transforms(status.time_s, &transforms)?;
        Ok(true)
    }

    /// Returns the file that is written; begins one if there is none.
    fn writer(&mut self, time_s: f64) -> Result<&mut Writer> {
        if self.file.is_none() {
            let since = crate::clock::unix_s();
            let name = format!("{PREFIX}{:011}-{:05}{ENDING}", since as u64, self.number);
            let path = self.settings.folder.join(name);
            self.number += 1;
            let file = GrowingFile::create_with_end(&path, END)?;
            let tail = file.tail()?;
            self.file = Some(Open {
                path,
                writer: McapWriter::appending(file)?,
                tail,
                began_s: time_s,
                flushed: Instant::now(),
                is_dirty: false,
            });
            if let Some(keep) = self.settings.keep {
                keep_newest(&self.settings.folder, PREFIX, ENDING, keep)?;
            }
        }
        let open = self.file.as_mut().context("no file is open")?;
        open.is_dirty = true;
        Ok(&mut open.writer)
    }

    /// Completes the file if it is large or old enough.
    fn rotate(&mut self, time_s: f64) -> Result<()> {
        let Some(open) = &self.file else {
            return Ok(());
        };
        let bytes = fs::metadata(&open.path).map_or(0, |it| it.len());
        let is_large = bytes as f64 >= self.settings.rotate_mb * 1e6;
        let age_s = time_s - open.began_s;
        if is_large || !(0.0..self.settings.rotate_s).contains(&age_s) {
            self.finish()?;
        }
        Ok(())
    }

    /// Completes the file with a summary.
    fn finish(&mut self) -> Result<()> {
        let Some(mut open) = self.file.take() else {
            return Ok(());
        };
        let path = open.path.display().to_string();
        let flushed = open.writer.flush();
        if let Err(error) = flushed {
            self.file = Some(open); // completed by `abandon`
            return Err(error).context(path);
        }
        let Open {
            writer, tail, path, ..
        } = open;
        tail.finalize();
        let finished = writer.finish();
        if finished.is_err() {
            complete(&path, tail);
        }
        finished.with_context(|| path.display().to_string())
    }

    /// Returns the events since the last diagnostic message.
    fn input(&mut self) -> DiagnosticStatus {
        let events = std::mem::take(&mut self.events);
        let warns = events
            .iter()
            .filter(|(level, _)| *level == Level::Warn)
            .count();
        let (level, message) = match warns {
            0 => (DiagnosticLevel::Ok, "no warnings".to_owned()),
            1 => (DiagnosticLevel::Warn, "1 warning".to_owned()),
            count => (DiagnosticLevel::Warn, format!("{count} warnings")),
        };
        let values = (1..).map(|number: usize| number.to_string());
        DiagnosticStatus {
            level,
            name: "access_av: input".to_owned(),
            message,
            values: values
                .zip(events.into_iter().map(|(_, text)| text))
                .collect(),
        }
    }
}

impl Sink for Mcap {
    fn open(&mut self) -> Result<bool> {
        let folder = &self.settings.folder;
        fs::create_dir_all(folder)
            .with_context(|| format!("output.mcap.folder: {}", folder.display()))?;
        self.ensure_space()?;
        Ok(false)
    }

    fn take(&mut self, record: &Record) -> Result<bool> {
        match record {
            Record::Pose(pose) if pose.by == PoseCause::Odometry => self.pose(pose),
            Record::Pose(_) => Ok(false),
            Record::Verdict(outcome) => {
                let ssb = outcome.angle_result.ssb;
                let head = (ssb.pci, ssb.ssb_index);
                let last_s = self.last_verdict_s.entry(head).or_insert(f64::NEG_INFINITY);
                if !is_due(*last_s, ssb.time_s, self.settings.verdict_hz) {
                    return Ok(false);
                }
                *last_s = ssb.time_s;
                let writer = self.writer(ssb.time_s)?;
                writer.verdict(VERDICT_TOPIC, &outcome.angle_result)?;
                Ok(true)
            }
            Record::Status {
                status,
                heads,
                outputs,
                time_s,
                ..
            } => {
                if let Err(error) = self.ensure_space() {
                    self.finish()?;
                    return Err(error);
                }
                let statuses = [
                    diagnosis(status, heads),
                    self.input(),
                    diagnosis_of_outputs(outputs),
                ];
                self.writer(*time_s)?.diagnostics(*time_s, &statuses)?;
                self.rotate(*time_s)?;
                Ok(true)
            }
            Record::Event {
                level,
                source,
                text,
                count,
                ..
            } => {
                let times = if *count > 1 {
                    format!(" ({count} times)")
                } else {
                    String::new()
                };
                if self.events.len() < MAX_EVENTS {
                    self.events
                        .push((*level, format!("{source}: {text}{times}")));
                }
                Ok(false)
            }
        }
    }

    fn flush(&mut self) -> Result<bool> {
        let Some(open) = &mut self.file else {
            return Ok(true);
        };
        if open.is_dirty && open.flushed.elapsed() >= CHUNK {
            let done = open.writer.flush();
            done.with_context(|| open.path.display().to_string())?;
            (open.flushed, open.is_dirty) = (Instant::now(), false);
        }
        open.tail.check_exists()?;
        Ok(!open.is_dirty)
    }

    fn abandon(&mut self) {
        if let Some(open) = self.file.take() {
            let Open {
                path, writer, tail, ..
            } = open;
            // Dropping the writer would otherwise complete the file with data that were counted as lost.
            tail.stop();
            drop(writer);
            complete(&path, tail);
        }
    }

    fn close(&mut self) -> Result<()> {
        self.finish()
    }
}

/// Ends a file after a failure behind its last complete chunk, or removes a file without any.
fn complete(path: &Path, tail: Tail) {
    tail.stop();
    // Either may fail on a full or missing disk. Readers accept a file without an end.
    if tail.flushed() == 0 {
        let _ = fs::remove_file(path);
    } else {
        let _ = tail.complete();
    }
}

/// Returns the health of the outputs as a diagnostic status.
fn diagnosis_of_outputs(outputs: &[OutputStatus]) -> DiagnosticStatus {
    let failed = failures_text(outputs);
    let level = match failed {
        None => DiagnosticLevel::Ok,
        Some(_) => DiagnosticLevel::Error,
    };
    let value = |it: &OutputStatus| {
        let state = it.cause.as_deref().unwrap_or("ok");
        let OutputStatus {
            failures,
            retries,
            written,
            dropped,
            ..
        } = it;
        format!(
            "{state}; {failures} failures, {retries} retries, {written} written, {dropped} dropped"
        )
    };
    DiagnosticStatus {
        level,
        name: "access_av: outputs".to_owned(),
        message: failed.unwrap_or_else(|| "all outputs work".to_owned()),
        values: outputs
            .iter()
            .map(|it| (it.name.to_owned(), value(it)))
            .collect(),
    }
}

/// Whether the next message is due at this rate. Time may have gone back, after a restart of the drive.
fn is_due(last_s: f64, time_s: f64, rate_hz: f64) -> bool {
    // One percent less than a period, because odometry has jitter.
    rate_hz > 0.0 && (time_s < last_s || time_s - last_s >= 0.99 / rate_hz)
}

/// Returns the pose of the frame `odom` in the map, given one pose in both frames.
fn between(in_map: Pose, in_odom: Pose) -> Pose {
    let heading_rad = onboard::geometry::wrap_angle(in_map.heading_rad - in_odom.heading_rad);
    let (sin, cos) = heading_rad.sin_cos();
    Pose {
        x_m: in_map.x_m - cos * in_odom.x_m + sin * in_odom.y_m,
        y_m: in_map.y_m - sin * in_odom.x_m - cos * in_odom.y_m,
        heading_rad,
    }
}

fn diagnosis(status: &Status, heads: &[HeadStatus]) -> DiagnosticStatus {
    let level = match status.state {
        State::Ok | State::Unmonitored => DiagnosticLevel::Ok,
        State::Degraded | State::Searching => DiagnosticLevel::Warn,
        State::Lost | State::Unavailable => DiagnosticLevel::Error,
        State::Waiting => DiagnosticLevel::Stale,
    };
    let mut values = vec![
        ("state".to_owned(), status.state.name().to_owned()),
        (
            "what to do".to_owned(),
            status.reason.what_to_do().to_owned(),
        ),
        ("tracked SSBs".to_owned(), status.tracked.to_string()),
    ];
    if let Some(level_m) = status.protection_level_m {
        values.push(("protection_level_m".to_owned(), format!("{level_m:.3}")));
    }
    if let Some(hypothesis) = status.selected_hypothesis {
        let name = hypothesis.name().to_owned();
        values.push(("selected_hypothesis".to_owned(), name));
    }
    for active in status.faults.iter() {
        values.push((
            format!("fault {}", active.fault.name()),
            active.fault.to_string(),
        ));
    }
    for head in heads {
        let name = format!("PCI {}, SSB {}", head.head.pci, head.head.ssb_index);
        let snr = head
            .snr_db
            .map_or("not received".to_owned(), |it| format!("{it:.1} dB"));
        let (accepted, refused) = (head.accepted, head.refused);
        values.push((
            name,
            format!("{snr}, {accepted} accepted, {refused} rejected"),
        ));
    }
    DiagnosticStatus {
        level,
        name: "access_av: localizer".to_owned(),
        message: status.reason.to_string(),
        values,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_nested_from_map_over_odom_to_the_vehicle() {
        let in_map = Pose {
            x_m: 3.0,
            y_m: -4.0,
            heading_rad: 2.0,
        };
        let in_odom = Pose {
            x_m: 10.0,
            y_m: 5.0,
            heading_rad: -0.7,
        };
        let odom = between(in_map, in_odom);
        let (sin, cos) = odom.heading_rad.sin_cos();
        let x_m = odom.x_m + cos * in_odom.x_m - sin * in_odom.y_m;
        let y_m = odom.y_m + sin * in_odom.x_m + cos * in_odom.y_m;
        assert!((x_m - in_map.x_m).abs() < 1e-12 && (y_m - in_map.y_m).abs() < 1e-12);
        assert!((odom.heading_rad + in_odom.heading_rad - in_map.heading_rad).abs() < 1e-12);
    }

    #[test]
    fn rates_are_limited_and_restart_with_the_drive() {
        let mut last_s = f64::NEG_INFINITY;
        let times = (0..100).map(|number| f64::from(number) * 0.02);
        let due = times.filter(|time_s| {
            let due = is_due(last_s, *time_s, 5.0);
            if due {
                last_s = *time_s;
            }
            due
        });
        assert_eq!(due.count(), 10);
        assert!(is_due(100.0, 0.0, 5.0));
        assert!(!is_due(f64::NEG_INFINITY, 0.0, 0.0));
    }
}
