//! Simulated recording of a scenario: IQ samples of all antennas, odometry, site and truth.

use std::f64::consts::FRAC_PI_2;
use std::fs;
use std::path::{Path, PathBuf};

use num_complex::Complex64;
use onboard::geometry::{Pose, wrap_angle};
use onboard::receive::SSB_SAMPLES;
use onboard::settings::{Check, SettingsError, TomlFile, Vehicle};
use recording::{
    Annotation, Datatype, RecordingError, RecordingWriter, TimedPose, WriterSettings, write_file,
    write_odometry_csv, write_tum,
};
use serde_json::{Map, json};
use thiserror::Error;

use crate::channel::{HeadChannel, IqAir};
use crate::error::SimulationError;
use crate::random::Streams;
use crate::scenario::Scenario;
use crate::truth::World;
use crate::world::{Faults, Odometer, Path as DrivenPath, VehicleState};

/// Settings of a simulated recording.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SynthSettings {
    /// Seed of all random streams.
    pub seed: u64,
    /// Number of the run.
    pub run: u64,
    /// Duration of the recording in seconds [default: the whole drive].
    pub duration_s: Option<f64>,
    /// Whether the samples between the bursts are recorded too. The file size grows by the ratio of
    /// the burst period to the burst duration.
    pub continuous: bool,
    /// Format of the samples.
    pub datatype: Datatype,
}

/// Result of a simulated recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Synthesized {
    /// Path of the metadata file.
    pub recording: PathBuf,
    /// Number of recorded bursts.
    pub bursts: usize,
    /// Number of samples per antenna.
    pub samples: u64,
}

/// Error of a simulated recording.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum SynthError {
    /// The scenario cannot be synthesised as samples.
    #[error(transparent)]
    Settings(#[from] SettingsError),
    /// A file cannot be written.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// An SSB cannot be built.
    #[error("samples: {0}")]
    Samples(#[from] nr_ssb::Error),
    /// The drive cannot be simulated.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
    /// The caller stopped the recording; no file was written.
    #[error("stopped")]
    Stopped,
}

/// Simulates a drive and writes the recording to `directory`.
///
/// - `iq.sigmf-meta`, `iq.sigmf-data`: samples, with the truth of each SSB as annotations
/// - `odometry.csv`: odometry samples
/// - `truth.tum`: true poses
/// - `site.toml`, `vehicle.toml`: nominal models
/// - `scenario.toml`: the scenario
///
/// `progress` gets the recorded fraction of the drive and returns `false` to stop.
///
/// # Errors
/// [`SynthError`].
pub fn synthesize(
    scenario: &Scenario,
    settings: &SynthSettings,
    directory: &Path,
    progress: &mut dyn FnMut(f64) -> bool,
) -> Result<Synthesized, SynthError> {
    scenario.check_sends_samples(Check {
        file: &scenario.name,
    })?;
    let streams = Streams::new(settings.seed, settings.run);
    let mut drawn = World::new(scenario)?.draw(streams);
    let mut channels = HeadChannel::all(&mut drawn, streams);
    let path = drawn.path;
    let at_reception =
        |time_s| path.at_reception(time_s, drawn.vehicle.receiver.angle_time_offset_s);
    let end_s = path
        .duration_s()
        .min(settings.duration_s.unwrap_or(f64::INFINITY));
    let mut air = IqAir::new(scenario, streams)?;
    if settings.continuous {
        air = air.continuous();
    }
    fs::create_dir_all(directory).map_err(|source| RecordingError::io(directory, source))?;

    let vehicle = configured_vehicle(scenario, drawn.given_start, air.channel_gains());
    let mut writer = RecordingWriter::create(
        &directory.join("iq"),
        WriterSettings {
            datatype: settings.datatype,
            channels: scenario.vehicle.array.elements.into(),
            sample_rate_hz: air.sample_rate_hz(),
            frequency_hz: scenario.site.carrier_mhz * 1e6,
            description: format!(
                "Simulated from the scenario `{}`, seed {}, run {}. Channel k is antenna k, counted \
             along the vehicle's forward axis.",
                scenario.name, settings.seed, settings.run
            ),
            global: Map::new(),
        },
    )?;
    let mut snrs_db = vec![0.0; channels.len()];
    let cfos_hz: Vec<f64> = (0..channels.len()).map(|index| air.cfo_hz(index)).collect();
    let mut truth = Vec::new();
    let mut number = 0u64;
    loop {
        let time_s = number as f64 * scenario.site.ssb.period_s();
        if time_s > end_s {
            break;
        }
        truth.push(TimedPose {
            time_s,
            pose: path.at(time_s).pose,
        });
        let here = at_reception(time_s);
        for (head, snr_db) in channels.iter_mut().zip(&mut snrs_db) {
            *snr_db = head.next_snr_db(&here);
        }
        let burst = air.receive(number, at_reception, &channels, &snrs_db)?;
        if !settings.continuous || number == 0 {
            writer.begin_capture(burst.start);
        }
        let (begin, starts) = (burst.start as f64, &burst.ssb_starts);
        for (index, (head, start)) in channels.iter().zip(starts).enumerate() {
            let received = Received {
                snr_db: snrs_db.get(index).copied().unwrap_or(f64::NAN),
                cfo_hz: cfos_hz.get(index).copied().unwrap_or(f64::NAN),
                sample_start: writer.length() as f64 + start - begin,
            };
            writer.annotate(annotation(scenario, head, &here, &received));
        }
        let antennas: Vec<_> = burst.antennas.iter().map(Vec::as_slice).collect();
        writer.write(&antennas)?;
        number += 1;
        if !progress((time_s / end_s).min(1.0)) {
            return Err(SynthError::Stopped);
        }
    }
    write_settings(directory, scenario, &vehicle)?;
    let odometry = directory.join("odometry.csv");
    write_odometry(scenario, &path, drawn.odometer, end_s, &odometry)?;
    write_tum(&directory.join("truth.tum"), &truth)?;
    let samples = writer.length();
    Ok(Synthesized {
        recording: writer.finish()?,
        bursts: truth.len(),
        samples,
    })
}

/// Writes the nominal models to `site.toml` and `vehicle.toml`, and the scenario to
/// `scenario.toml`.
pub(crate) fn write_settings(
    directory: &Path,
    scenario: &Scenario,
    vehicle: &Vehicle,
) -> Result<(), RecordingError> {
    for (name, text) in [
        ("site.toml", scenario.site.to_toml()),
        ("vehicle.toml", vehicle.to_toml()),
        ("scenario.toml", scenario.to_toml()),
    ] {
        write_file(&directory.join(name), text.as_bytes())?;
    }
    Ok(())
}

/// Returns the vehicle as its owner would describe it: with the given start, the calibrated channel
/// gains and a tracker as localizer.
fn configured_vehicle(scenario: &Scenario, start: Pose, channel_gains: &[Complex64]) -> Vehicle {
    let mut vehicle = scenario.vehicle.clone();
    let gains = channel_gains.iter().map(|gain| [gain.re, gain.im]);
    vehicle.array.channel_gains = Some(gains.collect());
    vehicle.start.pose = vehicle.start.known.then_some(start);
    vehicle
}

fn write_odometry(
    scenario: &Scenario,
    path: &DrivenPath,
    mut odometer: Odometer,
    end_s: f64,
    file: &Path,
) -> Result<(), RecordingError> {
    let mut faults = Faults::new(&scenario.faults);
    let count = (end_s / odometer.period_s()).floor() as usize + 1;
    let samples: Vec<_> = (0..count)
        .filter_map(|number| {
            let time_s = number as f64 * odometer.period_s();
            let sample = odometer.sample(path.at(time_s))?;
            Some(faults.slip(sample))
        })
        .collect();
    write_odometry_csv(file, &samples)
}

/// Reception of an SSB: SNR, frequency offset due to the oscillators, first sample.
struct Received {
    snr_db: f64,
    cfo_hz: f64,
    sample_start: f64,
}

fn annotation(
    scenario: &Scenario,
    channel: &HeadChannel,
    vehicle: &VehicleState,
    received: &Received,
) -> Annotation {
    let sample_start = received.sample_start;
    let head = channel.head();
    let ssb_freq_hz = scenario.site.carrier_mhz * 1e6;
    let scs_hz = scenario.site.ssb.subcarrier_spacing_khz * 1e3;
    let [along, left] = channel.array().line_of_sight(vehicle, head).towards;
    let level = along.hypot(left);
    let ssb = json!({
        "pci": head.pci,
        "ssb_index": head.ssb_index,
        "snr_db": received.snr_db,
        "cfo_hz": received.cfo_hz,
        "scs_hz": scs_hz,
        "ssb_freq_hz": ssb_freq_hz,
        "ssb_first_sample_incl_cp": sample_start,
    });
    let array = &scenario.vehicle.array;
    let angle = if array.shape.is_row() {
        // A linear array measures the angle from its axis only: sides and elevation are not
        // distinguished.
        json!({
            "azimuth_from_broadside_deg": along.clamp(-1.0, 1.0).asin().to_degrees(),
            "element_spacing_wavelengths": array.spacing_wavelengths,
        })
    } else {
        // Broadside is a quarter turn clockwise from the axis.
        json!({
            "azimuth_from_broadside_deg": wrap_angle(left.atan2(along) + FRAC_PI_2).to_degrees(),
            "elevation_deg": level.min(1.0).acos().to_degrees(),
            "element_places_wavelengths":
                array.any_manifold().and_then(|it| it.places_wavelengths()),
        })
    };
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
