//! Tests of the vehicle's software through its public interface.
#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "these are tests")]

#[path = "../../../nr-ssb/tests/all/air/mod.rs"]
mod air;
mod differential;
mod gap;
mod live_ranges;
mod live_times;
mod random_drives;
mod range_drive;
mod ranges;
mod receiver;
mod recovery;
mod renamed;
mod settings;
mod starts;
mod tracker;
mod yaw_rate;

use onboard::localize::{AngleMeasurement, MeasurementKind};

/// Returns a measured electrical angle.
const fn angle(time_s: f64, phase_rad: f64, phase_sigma_rad: f64) -> AngleMeasurement {
    AngleMeasurement {
        kind: MeasurementKind::Angle,
        time_s,
        phase_rad,
        phase_sigma_rad,
        angle_rad: f64::NAN,
        snr_db: 20.0,
        resolved: true,
    }
}
