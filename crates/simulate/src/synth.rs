//! A scenario as somebody on the vehicle would have recorded it: samples of all antennas, odometry,
//! the site, and beside them the truth.

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::{Map, json};
use thiserror::Error;

use crate::channel::{HeadChannel, IqAir};
use crate::observation::ANTENNAS;
use crate::random::Streams;
use crate::receive::SSB_SAMPLES;
use crate::recording::{
    Annotation, Datatype, RecordingError, RecordingWriter, Site, TimedPose, WriterSettings,
    write_odometry_csv, write_tum,
};
use crate::scenario::{Check, Scenario, ScenarioError};
use crate::world::{Faults, Odometer, RadioHead, Vehicle, VehicleState};

/// How a scenario is recorded.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SynthSettings {
    /// Seed of all random streams.
    pub seed: u64,
    /// Number of the run.
    pub run: u64,
    /// Seconds recorded from the start on; the whole drive without.
    pub duration_s: Option<f64>,
    /// Whether the time between the bursts is recorded too, which makes the file larger by the
    /// burst's share of the period.
    pub continuous: bool,
    /// Format of the samples.
    pub datatype: Datatype,
}

/// What was written.
#[derive(Debug, Clone, PartialEq)]
pub struct Synthesized {
    /// The recording's metadata.
    pub recording: PathBuf,
    /// Number of bursts in it.
    pub bursts: usize,
    /// Samples per antenna.
    pub samples: u64,
}

/// Why a scenario cannot be recorded.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum SynthError {
    /// The scenario cannot be sent as samples.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
    /// A file cannot be written.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// An SSB cannot be built.
    #[error("samples: {0}")]
    Samples(#[from] nr_ssb::Error),
}

/// Writes a drive into `directory`: `iq.sigmf-meta` and `iq.sigmf-data`, `odometry.csv`,
/// `site.toml`, `scenario.toml`, and the truth in `truth.tum` and the recording's annotations.
///
/// # Errors
/// [`SynthError`].
pub fn synthesize(
    scenario: &Scenario,
    settings: &SynthSettings,
    directory: &Path,
) -> Result<Synthesized, SynthError> {
    scenario.check_sends_samples(&Check {
        file: &scenario.name,
    })?;
    let streams = Streams::new(settings.seed, settings.run);
    let vehicle = Vehicle::new(scenario.build_track()?, &scenario.motion, streams);
    let end_s = settings
        .duration_s
        .unwrap_or(f64::INFINITY)
        .min(vehicle.duration_s());
    let mut air = IqAir::new(scenario, streams)?;
    if settings.continuous {
        air = air.continuous();
    }
    let io = |file: &Path| {
        let file = file.to_owned();
        move |source| RecordingError::io(&file, source)
    };
    fs::create_dir_all(directory).map_err(io(directory))?;

    let text_files = [
        (
            "site.toml",
            Site::of_scenario(scenario, vehicle.at(0.0).pose, *air.channel_gains()),
        ),
        ("scenario.toml", scenario.to_toml()),
    ];
    for (name, text) in text_files {
        let file = directory.join(name);
        fs::write(&file, text).map_err(io(&file))?;
    }
    write_odometry(
        scenario,
        &vehicle,
        streams,
        end_s,
        &directory.join("odometry.csv"),
    )?;

    let mut writer = RecordingWriter::create(
        &directory.join("iq"),
        WriterSettings {
            datatype: settings.datatype,
            channels: ANTENNAS,
            sample_rate_hz: air.sample_rate_hz(),
            frequency_hz: scenario.ssb.carrier_mhz * 1e6,
            description: format!(
                "Simulated from the scenario `{}`, seed {}, run {}. Channel k is antenna k, counted \
             along the vehicle's forward axis.",
                scenario.name, settings.seed, settings.run
            ),
            global: Map::new(),
        },
    )?;
    let mut heads: Vec<HeadChannel> = scenario
        .radio_heads
        .iter()
        .enumerate()
        .map(|(index, head)| HeadChannel::new(scenario, RadioHead::from(head), index, streams))
        .collect();
    let mut snrs_db = vec![0.0; heads.len()];
    let mut truth = Vec::new();
    let mut number = 0u64;
    loop {
        let time_s = number as f64 * scenario.ssb.period_s();
        if time_s > end_s {
            break;
        }
        let here = vehicle.at(time_s);
        truth.push(TimedPose {
            time_s,
            pose: here.pose,
        });
        for (head, snr_db) in heads.iter_mut().zip(&mut snrs_db) {
            *snr_db = head.next_snr_db(&here);
        }
        let burst = air.receive(number, |time_s| vehicle.at(time_s), &heads, &snrs_db)?;
        if !settings.continuous || number == 0 {
            writer.begin_capture(burst.start);
        }
        for ((head, snr_db), start) in heads.iter().zip(&snrs_db).zip(&burst.ssb_starts) {
            let place = writer.length() as f64 + start - burst.start as f64;
            writer.annotate(annotation(scenario, head, &here, *snr_db, place));
        }
        writer.write(&burst.antennas.each_ref().map(Vec::as_slice))?;
        number += 1;
    }
    write_tum(&directory.join("truth.tum"), &truth)?;
    let samples = writer.length();
    Ok(Synthesized {
        recording: writer.finish()?,
        bursts: truth.len(),
        samples,
    })
}

fn write_odometry(
    scenario: &Scenario,
    vehicle: &Vehicle,
    streams: Streams,
    end_s: f64,
    file: &Path,
) -> Result<(), RecordingError> {
    let mut odometer = Odometer::new(scenario.odometer, vehicle.at(0.0), streams);
    let mut faults = Faults::new(scenario);
    let count = (end_s / odometer.period_s()).floor() as usize + 1;
    let samples: Vec<_> = (0..count)
        .filter_map(|number| {
            let time_s = number as f64 * odometer.period_s();
            let sample = odometer.sample(vehicle.at(time_s))?;
            Some(faults.slip(sample))
        })
        .collect();
    write_odometry_csv(file, &samples)
}

fn annotation(
    scenario: &Scenario,
    channel: &HeadChannel,
    vehicle: &VehicleState,
    snr_db: f64,
    sample_start: f64,
) -> Annotation {
    let head = channel.head();
    let ssb_freq_hz = scenario.ssb.carrier_mhz * 1e6;
    let scs_hz = scenario.ssb.subcarrier_spacing_khz * 1e3;
    let bearing_rad = vehicle.pose.point().bearing_rad(head.position);
    let angle_rad = bearing_rad - vehicle.pose.heading_rad - scenario.array.mounting_angle_rad;
    let ssb = json!({
        "pci": head.pci,
        "ssb_index": head.ssb_index,
        "snr_db": snr_db,
        "scs_hz": scs_hz,
        "ssb_freq_hz": ssb_freq_hz,
        "ssb_first_sample_incl_cp": sample_start,
    });
    // The array sees the angle from its axis, whichever side the wave comes from.
    let angle = json!({
        "angle_from_axis_deg": angle_rad.cos().acos().to_degrees(),
        "element_spacing_wavelengths": scenario.array.spacing_wavelengths,
    });
    let pose = json!({
        "time_s": vehicle.time_s,
        "x_m": vehicle.pose.x_m,
        "y_m": vehicle.pose.y_m,
        "heading_rad": vehicle.pose.heading_rad,
    });
    Annotation {
        sample_start: sample_start.round() as u64,
        sample_count: Some(SSB_SAMPLES as u64),
        freq_lower_edge_hz: Some(ssb_freq_hz - 120.0 * scs_hz),
        freq_upper_edge_hz: Some(ssb_freq_hz + 120.0 * scs_hz),
        label: Some(format!("SSB pci={} idx={}", head.pci, head.ssb_index)),
        other: Map::from_iter([
            ("nr:ssb".to_owned(), ssb),
            ("aoa:truth".to_owned(), angle),
            ("access_av:truth".to_owned(), pose),
        ]),
    }
}
