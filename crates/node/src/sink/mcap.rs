//! MCAP files for ROS 2 tools, a new one by size and time.

use std::collections::HashMap;
use std::fs::{self, File};
use std::io::BufWriter;
use std::path::PathBuf;

use anyhow::{Context, Result};
use onboard::geometry::Pose;
use onboard::live::{HeadStatus, State, Status};
use recording::McapWriter;
use recording::mcap::{DiagnosticLevel, DiagnosticStatus, Frames, Twist};

use super::file::{create, keep_newest};
use super::record::{By, PoseRecord, Record};
use crate::inbox::Level;
use crate::settings::McapOutput;

const POSE_TOPIC: &str = "/access_av/odometry";
const VERDICT_TOPIC: &str = "/access_av/verdicts";
const PREFIX: &str = "access-av-";
const MAP_TO_ODOM: Frames<'_> = Frames {
    parent: "map",
    child: "odom",
};
/// Variance of a wheel speed in (m/s)² and of a gyroscope's rate in (rad/s)².
const SPEED_VARIANCE: f64 = 1e-4;
const YAW_RATE_VARIANCE: f64 = 1e-4;

/// Files being written, one after the other.
pub struct Mcap {
    settings: McapOutput,
    file: Option<Open>,
    number: u32,
    /// Where odometry alone would have it: what `map` → `odom` is told by.
    odom: Pose,
    odom_s: Option<f64>,
    last_pose_s: f64,
    last_verdict_s: HashMap<(u16, u8), f64>,
    events: Vec<(Level, String)>,
}

struct Open {
    path: PathBuf,
    writer: McapWriter<BufWriter<File>>,
    began_s: f64,
}

impl Mcap {
    /// Nothing is written yet; the folder is made.
    ///
    /// # Errors
    /// Those of the file system.
    pub fn new(settings: &McapOutput) -> Result<Self> {
        let folder = &settings.folder;
        let named = || format!("output.mcap.folder: {}", folder.display());
        fs::create_dir_all(folder).with_context(named)?;
        Ok(Self {
            settings: settings.clone(),
            file: None,
            number: 0,
            odom: Pose::default(),
            odom_s: None,
            last_pose_s: f64::NEG_INFINITY,
            last_verdict_s: HashMap::new(),
            events: Vec::new(),
        })
    }

    /// Writes a record.
    pub fn take(&mut self, record: &Record) -> Result<()> {
        match record {
            Record::Pose(pose) if pose.by == By::Odometry => self.pose(pose),
            Record::Pose(_) => Ok(()),
            Record::Verdict(outcome) => {
                let ssb = outcome.execution.ssb;
                let head = (ssb.pci, ssb.ssb_index);
                let last_s = self.last_verdict_s.entry(head).or_insert(f64::NEG_INFINITY);
                if !is_due(*last_s, ssb.time_s, self.settings.verdict_hz) {
                    return Ok(());
                }
                *last_s = ssb.time_s;
                let writer = self.writer(ssb.time_s)?;
                Ok(writer.verdict(VERDICT_TOPIC, &outcome.execution)?)
            }
            Record::Status {
                status,
                heads,
                time_s,
                ..
            } => {
                let input = self.input();
                let writer = self.writer(*time_s)?;
                writer.diagnostics(*time_s, &[diagnosis(status, heads), input])?;
                self.rotate(*time_s)
            }
            Record::Event {
                level,
                source,
                text,
                ..
            } => {
                self.events.push((*level, format!("{source}: {text}")));
                Ok(())
            }
        }
    }

    fn pose(&mut self, record: &PoseRecord) -> Result<()> {
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
            return Ok(());
        };
        // Nothing is published before the pose is known.
        if matches!(status.state, State::Waiting | State::Searching) {
            return Ok(());
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
        Ok(writer.transforms(status.time_s, &transforms)?)
    }

    /// The file being written; one is begun where there is none.
    fn writer(&mut self, time_s: f64) -> Result<&mut McapWriter<BufWriter<File>>> {
        if self.file.is_none() {
            let since = crate::clock::unix_s();
            let name = format!("{PREFIX}{:011}-{:05}.mcap", since as u64, self.number);
            let path = self.settings.folder.join(name);
            self.number += 1;
            let writer = McapWriter::compressed(create(&path)?)?;
            self.file = Some(Open {
                path,
                writer,
                began_s: time_s,
            });
            if let Some(keep) = self.settings.keep {
                keep_newest(&self.settings.folder, PREFIX, ".mcap", keep)?;
            }
        }
        let open = self.file.as_mut().context("no file is open")?;
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

    /// Completes the file.
    pub fn finish(&mut self) -> Result<()> {
        if let Some(open) = self.file.take() {
            let named = || open.path.display().to_string();
            open.writer.finish().with_context(named)?;
        }
        Ok(())
    }

    /// What was remarkable since the last diagnosis.
    fn input(&mut self) -> DiagnosticStatus {
        let events = std::mem::take(&mut self.events);
        let warns = events
            .iter()
            .filter(|(level, _)| *level == Level::Warn)
            .count();
        let (level, message) = match warns {
            0 => (DiagnosticLevel::Ok, "nothing to remark".to_owned()),
            1 => (DiagnosticLevel::Warn, "1 remarkable item".to_owned()),
            count => (DiagnosticLevel::Warn, format!("{count} remarkable items")),
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

/// Whether so many a second are due again; the drive may have begun anew.
fn is_due(last_s: f64, time_s: f64, rate_hz: f64) -> bool {
    // A hundredth less, for the jitter of what comes.
    rate_hz > 0.0 && (time_s < last_s || time_s - last_s >= 0.99 / rate_hz)
}

/// Pose of the frame `odom` in the map, from a pose told in both.
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
    for head in heads {
        let name = format!("PCI {}, SSB {}", head.head.pci, head.head.ssb_index);
        let snr = head
            .snr_db
            .map_or("not heard".to_owned(), |it| format!("{it:.1} dB"));
        let (accepted, refused) = (head.accepted, head.refused);
        values.push((
            name,
            format!("{snr}, {accepted} accepted, {refused} refused"),
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
    fn the_map_holds_odom_holds_the_vehicle() {
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
    fn rates_hold_and_begin_anew_with_the_drive() {
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
