//! Playback of files in order of time, which gives the poses of `access-av record locate` bit by bit.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use anyhow::Result;
use num_complex::Complex32;
use onboard::burst::first_burst;
use onboard::live::AngleObservation;
use onboard::observation::OdometrySample;
use recording::LoggedAngle;

use crate::engine::{Engine, TICK};
use crate::settings::Pace;
use crate::source::{Blocks, Files};
use crate::statistics::SourceHealth;

/// Duration of the samples that are processed together, in seconds, equal to that of `access-av
/// record locate`.
const BLOCK_S: f64 = 0.02;
/// Duration of samples that are read beyond the last required burst, in seconds: a burst and the
/// receiver's filter.
const AHEAD_S: f64 = 0.01;

/// Plays the files until they end or the node is stopped.
///
/// # Errors
/// Error of a file or of the pipeline.
pub fn play(
    engine: &mut Engine,
    files: Files,
    health: &[Arc<SourceHealth>],
    pace: Pace,
    stop: &AtomicBool,
) -> Result<()> {
    let blocks = files
        .recording
        .map(|(recording, start_s)| Blocks::new(recording, start_s, BLOCK_S));
    let mut player = Player {
        engine,
        blocks,
        samples: Vec::new(),
        angles: &files.angles,
        health,
        stop,
        pace: (pace == Pace::RealTime).then(Instant::now),
        first_s: None,
    };
    for sample in &files.odometry.samples {
        if stop.load(Ordering::Acquire) {
            break;
        }
        player.odometry(sample)?;
    }
    if !stop.load(Ordering::Acquire) {
        player.process_until(f64::INFINITY)?;
    }
    player.engine.live_mut().flush()?;
    player.engine.publish_angles(None)?;
    Ok(())
}

struct Player<'a> {
    engine: &'a mut Engine,
    blocks: Option<Blocks>,
    samples: Vec<Vec<Complex32>>,
    angles: &'a [LoggedAngle],
    health: &'a [Arc<SourceHealth>],
    stop: &'a AtomicBool,
    /// Start of the playback in real time; `None` for playback at maximum speed.
    pace: Option<Instant>,
    first_s: Option<f64>,
}

impl Player<'_> {
    fn odometry(&mut self, sample: &OdometrySample) -> Result<()> {
        self.process_until(sample.time_s)?;
        self.wait_for(sample.time_s);
        self.came("odometry", 1);
        self.engine.odometry(sample, None)?;
        self.engine.tick()?;
        Ok(())
    }

    /// Processes every burst that began before `time_s`.
    fn process_until(&mut self, time_s: f64) -> Result<()> {
        self.process_angles_before(time_s)?;
        while let Some(blocks) = &mut self.blocks
            && let Some(next_s) = blocks.next_s()
            && next_s <= time_s + AHEAD_S
            && !self.stop.load(Ordering::Acquire)
        {
            let Some(block_s) = blocks.read(&mut self.samples)? else {
                break;
            };
            let next_s = blocks.next_s();
            let length_s = blocks.length_s(&self.samples);
            let antennas: Vec<&[Complex32]> = self.samples.iter().map(Vec::as_slice).collect();
            let live = self.engine.live_mut();
            // A difference below one sample period at any rate is not a gap.
            let ends = next_s.is_none_or(|next_s| next_s > block_s + length_s + 1e-8);
            live.receive(block_s, &antennas)?;
            if ends {
                live.end_segment()?;
            }
            live.process_until(time_s)?;
            self.engine.publish_angles(None)?;
            let samples = self.samples.first().map_or(0, Vec::len);
            self.came("samples", samples as u64);
            self.wait_for(block_s);
            self.engine.see(block_s);
            if time_s.is_infinite() {
                self.engine.tick()?;
            }
        }
        self.engine.live_mut().process_until(time_s)?;
        Ok(self.engine.publish_angles(None)?)
    }

    fn process_angles_before(&mut self, time_s: f64) -> Result<()> {
        while let Some(first) = self.angles.first()
            && first.ssb.time_s < time_s
        {
            let (burst, later) = self.angles.split_at(first_burst(self.angles));
            self.wait_for(first.ssb.time_s);
            for angle in burst {
                self.engine
                    .live_mut()
                    .angle(&AngleObservation::from(angle))?;
            }
            self.engine.live_mut().flush()?;
            self.engine.publish_angles(None)?;
            self.came("angles", burst.len() as u64);
            self.angles = later;
        }
        Ok(())
    }

    fn came(&self, name: &str, items: u64) {
        let health = self.health.iter().find(|it| it.name == name);
        health.inspect(|it| it.came(items));
    }

    fn wait_for(&mut self, time_s: f64) {
        let first_s = *self.first_s.get_or_insert(time_s);
        if let Some(began) = self.pace {
            let due = Duration::try_from_secs_f64(time_s - first_s).unwrap_or_default();
            // During a gap of the drive, the watchdog is notified and a stop is possible.
            while !self.stop.load(Ordering::Acquire)
                && let left = due.saturating_sub(began.elapsed())
                && !left.is_zero()
            {
                std::thread::sleep(left.min(TICK));
                self.engine.alive();
            }
        }
    }
}
