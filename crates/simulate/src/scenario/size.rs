//! How large a drive is, before it is driven.

use onboard::road::Road;
use onboard::settings::{Check, SettingsError, Site, Vehicle};

use super::motion::MotionSettings;

/// Radio heads times SSB bursts, or odometry samples, of a drive that nobody is asked about: some
/// hours past four radio heads.
const MOST_LOOKS: f64 = 5e6;
/// Memory that nobody is asked about.
const MOST_BYTES: f64 = 1.5e9;
/// Memory of a burst's statistics over all runs, most of it for the quantiles.
const BYTES_PER_BURST: f64 = 1300.0;
/// Memory of a run's step and angle, and as columns of its tables.
const BYTES_PER_STEP: f64 = 500.0;
const BYTES_PER_LOOK: f64 = 400.0;

/// How long a drive takes, and what there is to compute and to keep of it; from above.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DriveSize {
    /// From the start to the destination.
    pub duration_s: f64,
    /// SSB bursts.
    pub bursts: f64,
    /// SSBs: those of all radio heads.
    pub looks: f64,
    /// Odometry samples.
    pub odometry_samples: f64,
}

impl DriveSize {
    /// The size of a drive of `vehicle` along `road`.
    pub(super) fn new(
        motion: &MotionSettings,
        site: &Site,
        vehicle: &Vehicle,
        road: &Road,
    ) -> Self {
        let top_speed_mps = motion.top_speed_kmh.unwrap_or(vehicle.top_speed_kmh) / 3.6;
        let acceleration_mps2 = (motion.acceleration_mps2).unwrap_or(vehicle.acceleration_mps2);
        // Each leg takes one ramp more than at top speed throughout, or less if it is short.
        let legs = motion.stops.iter().filter(|it| it.at_m > motion.start_at_m);
        let ramps_s = (1.0 + legs.clone().count() as f64) * top_speed_mps / acceleration_mps2;
        let dwell_s: f64 = legs.map(|stop| stop.dwell_s).sum();
        let driven_m = road.length_m() - motion.start_at_m;
        let duration_s = driven_m / top_speed_mps + ramps_s + dwell_s;
        let bursts = duration_s / site.ssb.period_s();
        Self {
            duration_s,
            bursts,
            looks: bursts * site.radio_heads.len() as f64,
            odometry_samples: duration_s * vehicle.odometer.rate_hz,
        }
    }

    /// Memory of so many runs that are in it at the same time, in bytes.
    pub fn bytes(&self, runs: usize) -> f64 {
        let of_run = self.bursts * BYTES_PER_STEP + self.looks * BYTES_PER_LOOK;
        self.bursts * BYTES_PER_BURST + runs as f64 * of_run
    }

    /// Refuses a drive that would take hours and gigabytes.
    pub(super) fn check(&self, check: Check<'_>) -> Result<(), SettingsError> {
        let (hours, looks, gigabytes) =
            (self.duration_s / 3600.0, self.looks, self.bytes(1) * 1e-9);
        let most = self.looks.max(self.odometry_samples);
        check.that(
            most <= MOST_LOOKS && self.bytes(1) <= MOST_BYTES,
            "motion",
            format!("a drive of {hours:.1} h, {looks:.1e} SSBs and {gigabytes:.1} GB"),
            &format!(
                "at most {MOST_LOOKS:.0e} SSBs or odometry samples and {:.1} GB are taken \
                 without allow_large = true (--allow-large); shorten the road or the stops, or \
                 raise top_speed_kmh",
                MOST_BYTES * 1e-9
            ),
        )
    }

    /// Refuses a campaign that keeps more runs than usual memory holds.
    pub(super) fn check_runs(&self, runs: usize, check: Check<'_>) -> Result<(), SettingsError> {
        let most_gb = MOST_BYTES * 1e-9;
        check.that(
            self.bytes(runs) <= MOST_BYTES,
            "runs",
            format!("{runs} in memory, {:.1} GB", self.bytes(runs) * 1e-9),
            &format!(
                "at most {most_gb:.1} GB are taken without allow_large = true (--allow-large); \
                 drive in several parts, or keep no trajectories"
            ),
        )
    }
}
