//! Start of all configured sources.

use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use onboard::live::StreamConfig;
use recording::{LoggedAngle, OdometryChoice, OdometryLog, Recording};

use super::connection::{Event, read};
use super::framing::Framing;
use super::lines::Lines;
use super::{message, raw, recording as played, zeromq};
use crate::address::Address;
use crate::gate::RxWindow;
use crate::inbox::{Inbox, Input};
use crate::settings::{NodeSettings, SampleSource};
use crate::statistics::SourceHealth;

/// State shared between the sources and the pipeline, and the opened files.
pub struct Sources {
    /// Queue of the inputs.
    pub inbox: Arc<Inbox>,
    /// Gate of the required samples.
    pub gate: Arc<RxWindow>,
    /// Health of each source.
    pub health: Vec<Arc<SourceHealth>>,
    /// Stream of samples; `None` without samples.
    pub stream: Option<StreamConfig>,
    /// Odometry, angles and recording from files.
    pub files: Files,
    /// Defects of the files, each with its source.
    pub remarks: Vec<(&'static str, String)>,
}

/// Files for playback.
#[derive(Default)]
pub struct Files {
    /// Recording and the time of its first sample.
    pub recording: Option<(Recording, f64)>,
    /// Odometry from a file.
    pub odometry: OdometryLog,
    /// Angles from a file.
    pub angles: Vec<LoggedAngle>,
}

impl Sources {
    /// Opens the files for a vehicle with `antennas` antennas.
    ///
    /// # Errors
    /// An invalid file, or samples that do not match the vehicle.
    pub fn open(
        settings: &NodeSettings,
        antennas: usize,
        track_width_m: Option<f64>,
    ) -> Result<Self> {
        let (mut files, mut remarks) = (Files::default(), Vec::new());
        let mut stream = None;
        let mut health = Vec::new();
        if let Some(samples) = &settings.samples {
            if matches!(samples, SampleSource::Soapy(_)) && cfg!(not(feature = "soapy")) {
                bail!(
                    "samples.source is soapy; this program was built without the feature `soapy`: \
                     cargo build --release -p access-av-node --features soapy"
                );
            }
            health.push("samples");
            let found = match samples.stream() {
                Some(stated) => {
                    stream = Some(StreamConfig {
                        rate_hz: stated.rate_msps * 1e6,
                        centre_hz: stated.centre_mhz * 1e6,
                    });
                    stated.antennas.len()
                }
                None => 0,
            };
            let found = if let SampleSource::Sigmf {
                recording,
                start_time_s,
            } = samples
            {
                let recording = Recording::open_unverified(recording)?;
                recording.check_drive()?;
                let centre_hz = recording.centre_frequency_hz().with_context(|| {
                    let file = recording.data_file().display();
                    format!(
                        "{file}: no capture contains core:frequency, which is required to \
                         find the SSB"
                    )
                })?;
                stream = Some(StreamConfig {
                    rate_hz: recording.sample_rate_hz(),
                    centre_hz,
                });
                let found = recording.channels();
                files.recording = Some((recording, *start_time_s));
                found
            } else {
                found
            };
            if found != antennas {
                bail!("samples: {found} channels, and the vehicle's array has {antennas} antennas");
            }
        }
        if !settings.messages.is_empty() {
            health.push("messages");
        }
        if let Some(odometry) = &settings.odometry {
            let choice = OdometryChoice {
                topic: odometry.topic.as_deref(),
                imu_topic: odometry.imu_topic.as_deref(),
                track_width_m,
            };
            files.odometry = recording::read_odometry(odometry.file.as_ref(), &choice)?;
            let defects = files.odometry.remarks.iter();
            let defects = defects.filter(|it| it.is_defect()).map(ToString::to_string);
            remarks.extend(defects.map(|text| ("odometry", text)));
            health.push("odometry");
        }
        if let Some(angles) = &settings.angles {
            let topic = angles.topic.as_deref();
            let log = recording::read_angles(angles.file.as_ref(), topic)?;
            remarks.extend(log.remarks.iter().map(|it| ("angles", it.to_string())));
            files.angles = log.angles;
            health.push("angles");
        }
        recording::replay::check_times(&files.odometry, &files.angles)?;
        Ok(Self {
            inbox: Arc::new(Inbox::new(settings.waits())),
            gate: Arc::default(),
            health: health
                .into_iter()
                .map(|name| Arc::new(SourceHealth::new(name)))
                .collect(),
            stream,
            files,
            remarks,
        })
    }

    fn health(&self, name: &str) -> Option<Arc<SourceHealth>> {
        self.health.iter().find(|it| it.name == name).cloned()
    }
}

/// Starts the threads of all sources; files are played in real time. [`Input::End`] follows after
/// all finite sources have ended.
///
/// # Errors
/// An error if a thread cannot be started.
pub fn start(settings: &NodeSettings, sources: &mut Sources) -> Result<()> {
    let files = std::mem::take(&mut sources.files);
    let mut threads = Vec::new();
    let mut spawn = |name: &str, work: Box<dyn FnOnce(&Inbox) + Send>| -> Result<()> {
        let inbox = Arc::clone(&sources.inbox);
        let named = thread::Builder::new().name(name.to_owned());
        threads.push(named.spawn(move || work(&inbox))?);
        Ok(())
    };
    if let (Some(samples), Some(health)) = (&settings.samples, sources.health("samples")) {
        let inbox = Arc::clone(&sources.inbox);
        let gate = Arc::clone(&sources.gate);
        match samples {
            SampleSource::Sigmf { .. } => {
                if let Some((recording, start_s)) = files.recording {
                    let work = move |inbox: &Inbox| {
                        played::run(recording, start_s, &gate, inbox, &health);
                    };
                    spawn("samples", Box::new(work))?;
                }
            }
            SampleSource::Raw {
                address,
                format,
                stream,
            } => {
                let framing = Framing::new(stream, *format, gate, inbox, health);
                let address = address.clone();
                spawn(
                    "samples",
                    Box::new(move |inbox| raw::run(&address, framing, inbox)),
                )?;
            }
            SampleSource::Zeromq {
                endpoints,
                format,
                stream,
            } => {
                let framing = Framing::new(stream, *format, gate, inbox, health);
                let endpoints = endpoints.clone();
                spawn(
                    "samples",
                    Box::new(move |inbox| zeromq::run(&endpoints, framing, inbox)),
                )?;
            }
            #[cfg(feature = "soapy")]
            SampleSource::Soapy(radio) => {
                // SoapySDR converts the samples to this format.
                let format = crate::settings::SampleFormat::Cf32;
                let framing = Framing::new(&radio.stream, format, Arc::clone(&gate), inbox, health);
                let radio = radio.clone();
                let work = move |inbox: &Inbox| super::soapy::run(&radio, framing, &gate, inbox);
                spawn("samples", Box::new(work))?;
            }
            #[cfg(not(feature = "soapy"))]
            SampleSource::Soapy(_) => {} // rejected when the files are opened
        }
    }
    for address in &settings.messages {
        if let Some(health) = sources.health("messages") {
            let address = address.clone();
            let work = move |inbox: &Inbox| messages(&address, inbox, &health);
            spawn("messages", Box::new(work))?;
        }
    }
    if let Some(health) = sources.health("odometry") {
        let log = files.odometry.samples.into_iter();
        let log = log.map(|it| (it.time_s, Input::Odometry(it))).collect();
        spawn("odometry", Box::new(move |inbox| play(log, inbox, &health)))?;
    }
    if let Some(health) = sources.health("angles") {
        let log = files
            .angles
            .iter()
            .map(|it| (it.ssb.time_s, Input::Angle(it.into())))
            .collect();
        spawn("angles", Box::new(move |inbox| play(log, inbox, &health)))?;
    }
    let inbox = Arc::clone(&sources.inbox);
    thread::Builder::new()
        .name("sources".to_owned())
        .spawn(move || {
            for thread in threads {
                // A source that panicked has ended as well.
                let _ = thread.join();
            }
            inbox.put(Input::End);
        })?;
    Ok(())
}

/// Plays timed inputs in real time, starting with the first.
fn play(log: Vec<(f64, Input)>, inbox: &Inbox, health: &SourceHealth) {
    let began = Instant::now();
    let first_s = log.first().map_or(0.0, |(time_s, _)| *time_s);
    for (time_s, input) in log {
        let due = Duration::try_from_secs_f64(time_s - first_s).unwrap_or_default();
        thread::sleep(due.saturating_sub(began.elapsed()));
        if inbox.is_closed() {
            return;
        }
        health.came(1);
        inbox.put(input);
    }
}

/// Reads newline-delimited JSON until it ends or the node stops.
fn messages(address: &Address, inbox: &Inbox, health: &SourceHealth) {
    let mut lines = Lines::default();
    let mut take = |line: Option<&[u8]>| {
        let parsed = match line {
            Some(line) => message::parse(line),
            None => Err("a line of more than 64 KiB".to_owned()),
        };
        match parsed {
            Ok(None) => {}
            Ok(Some(input)) => {
                health.came(1);
                inbox.put(input);
            }
            Err(why) => {
                health.defect();
                // Report the first errors and then every 1000th.
                if health.defects() <= 10 || health.defects().is_multiple_of(1000) {
                    let (source, text) = ("messages", format!("{address}: message ignored: {why}"));
                    inbox.put(Input::warning(source, text));
                }
            }
        }
    };
    read(address, "messages", inbox, |event| match event {
        Event::Begin => lines = Lines::default(),
        Event::Bytes(bytes) => lines.push(bytes, &mut take),
    });
    lines.finish(&mut take);
}
