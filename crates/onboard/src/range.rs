//! Ranges: measured distances to radio heads, from a two-way time of flight or a one-way delay.

use crate::settings::{RangingKind, RangingSettings, SPEED_OF_LIGHT_MPS};

/// Distance that light travels in a nanosecond (m).
pub const METRES_PER_NS: f64 = SPEED_OF_LIGHT_MPS * 1e-9;

/// Range or pseudorange to a radio head.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RangeMeasurement {
    /// Time in seconds.
    pub time_s: f64,
    /// Measured distance in metres; for a one-way delay, the delay times the speed of light.
    pub range_m: f64,
    /// Standard deviation of the noise in metres; `None` for that of the vehicle's settings.
    pub sigma_m: Option<f64>,
}

/// Clock of a radio head.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct HeadClock {
    /// Number of the oscillator, if several radio heads share it.
    pub group: Option<u16>,
    /// Standard deviation of the clock's offset (m); `None` if it is not specified.
    pub offset_std_m: Option<f64>,
    /// Random walk of the clock (m/√s); `None` if it is not specified.
    pub wander_m_per_sqrt_s: Option<f64>,
}

/// Model of the ranges of a vehicle, in metres and seconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RangeModel {
    /// Whether a range contains the clocks of vehicle and radio head.
    pub is_one_way: bool,
    /// Standard deviation of the noise (m), if it is specified.
    pub sigma_m: Option<f64>,
    /// Antenna relative to the odometer's reference point `[forward, left, up]` (m).
    pub position_m: [f64; 3],
    /// Standard deviation of the relative scale error, which all radio heads share.
    pub scale_std: f64,
    /// Standard deviation of the offset of each radio head (m) ...
    pub offset_std_m: f64,
    /// ... and its random walk (m/√m).
    pub offset_walk_m_per_sqrt_m: f64,
    /// Standard deviation of the vehicle clock's offset (m) ...
    pub clock_std_m: f64,
    /// ... and its random walk (m/√s).
    pub clock_wander_m_per_sqrt_s: f64,
    /// Standard deviation of the vehicle clock's drift (m/s) ...
    pub drift_std_mps: f64,
    /// ... and its random walk (m/s/√s).
    pub drift_walk_mps_per_sqrt_s: f64,
}

/// Standard deviation of an unspecified clock offset of a radio head (ns): cell phase
/// synchronisation accuracy of TDD cells (TS 38.133, 7.4.2).
const UNSTATED_CLOCK_STD_NS: f64 = 3000.0;

/// Random walk of an unspecified clock of a radio head (ns/√s): that of a crystal oscillator with a
/// frequency noise of 1e-9 at one second.
const UNSTATED_WANDER_NS_PER_SQRT_S: f64 = 1.0;

impl RangeModel {
    /// Creates the model of a vehicle whose array is at `array_position_m`.
    pub fn new(settings: &RangingSettings, array_position_m: [f64; 3]) -> Self {
        let is_one_way = settings.kind == RangingKind::OneWay;
        let of_clock = |ns: f64| if is_one_way { METRES_PER_NS * ns } else { 0.0 };
        Self {
            is_one_way,
            sigma_m: settings.sigma_m,
            position_m: settings.position_m.unwrap_or(array_position_m),
            scale_std: settings.scale_std(),
            offset_std_m: settings.offset_std_m,
            offset_walk_m_per_sqrt_m: settings.offset_walk_m_per_sqrt_m,
            clock_std_m: of_clock(settings.clock_offset_std_ns),
            clock_wander_m_per_sqrt_s: of_clock(settings.clock_wander_ns_per_sqrt_s),
            // A drift of 1 ppb is 1 ns/s.
            drift_std_mps: of_clock(settings.clock_drift_std_ppb),
            drift_walk_mps_per_sqrt_s: of_clock(settings.clock_drift_walk_ppb_per_sqrt_s),
        }
    }

    /// Returns the standard deviation of a radio head's clock offset (m) and its random walk
    /// (m/√s); zero for two-way ranges.
    pub fn head_clock(&self, clock: &HeadClock) -> [f64; 2] {
        if !self.is_one_way {
            return [0.0; 2];
        }
        let metres = |ns: f64| METRES_PER_NS * ns;
        let offset_m = clock.offset_std_m;
        let wander = clock.wander_m_per_sqrt_s;
        [
            offset_m.unwrap_or_else(|| metres(UNSTATED_CLOCK_STD_NS)),
            wander.unwrap_or_else(|| metres(UNSTATED_WANDER_NS_PER_SQRT_S)),
        ]
    }
}
