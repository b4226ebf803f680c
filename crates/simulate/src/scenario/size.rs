//! Size of a drive before it is simulated.

use onboard::road::Road;
use onboard::settings::{Check, SettingsError, Site, Vehicle};

use super::motion::MotionSettings;

/// Maximum number of SSBs or odometry samples of a drive without `allow_large`. It corresponds to
/// several hours with four radio heads.
const MAX_SSBS: f64 = 5e6;
/// Maximum memory without `allow_large`, in bytes.
const MAX_BYTES: f64 = 1.5e9;
/// Memory of the statistics of one burst over all runs in bytes, mainly for the quantiles.
const BYTES_PER_BURST: f64 = 1300.0;
/// Memory of a step of a run, including its table row, in bytes.
const BYTES_PER_STEP: f64 = 500.0;
/// Memory of an SSB of a run, including its table row, in bytes.
const BYTES_PER_ANGLE: f64 = 400.0;

/// Upper bounds of the duration, computation and memory of a drive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DriveSize {
    /// Time from the start to the destination in seconds.
    pub duration_s: f64,
    /// Number of SSB bursts.
    pub bursts: f64,
    /// Number of SSBs of all radio heads.
    pub angles: f64,
    /// Number of odometry samples.
    pub odometry_samples: f64,
}

impl DriveSize {
    /// Computes the size of a drive of `vehicle` along `road`.
    pub(super) fn new(
        motion: &MotionSettings,
        site: &Site,
        vehicle: &Vehicle,
        road: &Road,
    ) -> Self {
        let top_speed_mps = motion.top_speed_kmh.unwrap_or(vehicle.top_speed_kmh) / 3.6;
        let acceleration_mps2 = (motion.acceleration_mps2).unwrap_or(vehicle.acceleration_mps2);
        // Each leg takes one ramp longer than at constant top speed. Short legs take less.
        let legs = motion.stops.iter().filter(|it| it.at_m > motion.start_at_m);
        let ramps_s = (1.0 + legs.clone().count() as f64) * top_speed_mps / acceleration_mps2;
        let dwell_s: f64 = legs.map(|stop| stop.dwell_s).sum();
        let driven_m = road.length_m() - motion.start_at_m;
        let duration_s = driven_m / top_speed_mps + ramps_s + dwell_s;
        let bursts = duration_s / site.ssb.period_s();
        Self {
            duration_s,
            bursts,
            angles: bursts * site.radio_heads.len() as f64,
            odometry_samples: duration_s * vehicle.odometer.rate_hz,
        }
    }

    /// Returns the memory of `runs` simultaneous runs in bytes.
    pub fn bytes(&self, runs: usize) -> f64 {
        let of_run = self.bursts * BYTES_PER_STEP + self.angles * BYTES_PER_ANGLE;
        self.bursts * BYTES_PER_BURST + runs as f64 * of_run
    }

    /// Rejects a drive that needs too much time or memory.
    pub(super) fn check(&self, check: Check<'_>) -> Result<(), SettingsError> {
        let (hours, angles, gigabytes) =
            (self.duration_s / 3600.0, self.angles, self.bytes(1) * 1e-9);
        let most = self.angles.max(self.odometry_samples);
        check.that(
            most <= MAX_SSBS && self.bytes(1) <= MAX_BYTES,
            "motion",
            format!("a drive of {hours:.1} h, {angles:.1e} SSBs and {gigabytes:.1} GB"),
            &format!(
                "at most {MAX_SSBS:.0e} SSBs or odometry samples and {:.1} GB are allowed \
                 without allow_large = true (--allow-large); shorten the road or the stops, or \
                 raise top_speed_kmh",
                MAX_BYTES * 1e-9
            ),
        )
    }

    /// Rejects a campaign whose runs do not fit into the usual memory.
    pub(super) fn check_runs(&self, runs: usize, check: Check<'_>) -> Result<(), SettingsError> {
        let max_gb = MAX_BYTES * 1e-9;
        check.that(
            self.bytes(runs) <= MAX_BYTES,
            "runs",
            format!("{runs} in memory, {:.1} GB", self.bytes(runs) * 1e-9),
            &format!(
                "at most {max_gb:.1} GB are allowed without allow_large = true (--allow-large); \
                 drive in several parts, or keep no trajectories"
            ),
        )
    }
}
