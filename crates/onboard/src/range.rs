//! Ranges: measured distances to radio heads, from a two-way time of flight or a one-way delay.

use crate::settings::{ArraySettings, RangingKind, RangingSettings, SPEED_OF_LIGHT_MPS};

/// Distance that light travels in a nanosecond (m).
pub const METRES_PER_NS: f64 = SPEED_OF_LIGHT_MPS * 1e-9;

/// Quantity that a [`RangeMeasurement`] measures. One file of `localize/ekf` predicts each.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum RangeQuantity {
    /// Two-way range, or one-way delay times the speed of light (m).
    #[default]
    Range,
    /// Rate of the pseudorange, from the frequency offset (m/s): positive if the distance increases.
    RangeRate {
        /// Duration over which the rate is measured (s).
        interval_s: f64,
    },
    /// Pseudorange by the carrier phase (m), known except for a multiple of the wavelength.
    CarrierPhase,
}

/// Range, range rate or carrier phase to a radio head.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RangeMeasurement {
    /// Time in seconds.
    pub time_s: f64,
    /// Measured quantity.
    pub quantity: RangeQuantity,
    /// Measured value in metres; of a range rate in m/s.
    pub value: f64,
    /// Standard deviation of the noise in the unit of the value; `None` for that of the vehicle's
    /// settings, which exists for ranges only.
    pub sigma: Option<f64>,
    /// Standard deviation of a further error of a range due to multipath (m). Ranges of a radio head share
    /// it over 20 m of travel.
    pub scatter_m: f64,
}

impl RangeMeasurement {
    /// Creates a range or pseudorange.
    pub const fn range(time_s: f64, range_m: f64, sigma_m: Option<f64>) -> Self {
        Self {
            time_s,
            quantity: RangeQuantity::Range,
            value: range_m,
            sigma: sigma_m,
            scatter_m: 0.0,
        }
    }

    /// Creates the rate of a pseudorange, measured over a duration.
    pub const fn range_rate(time_s: f64, rate_mps: f64, sigma_mps: f64, interval_s: f64) -> Self {
        Self {
            time_s,
            quantity: RangeQuantity::RangeRate { interval_s },
            value: rate_mps,
            sigma: Some(sigma_mps),
            scatter_m: 0.0,
        }
    }

    /// Creates a pseudorange by a carrier phase in radians, which decreases by 2π per wavelength of
    /// distance.
    pub const fn carrier_phase(
        time_s: f64,
        phase_rad: f64,
        sigma_rad: f64,
        wavelength_m: f64,
    ) -> Self {
        let metres_per_rad = wavelength_m / std::f64::consts::TAU;
        Self {
            time_s,
            quantity: RangeQuantity::CarrierPhase,
            value: -metres_per_rad * phase_rad,
            sigma: Some(metres_per_rad * sigma_rad),
            scatter_m: 0.0,
        }
    }
}

/// Offset of the ranges of a radio head, as surveyed.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct RangeOffset {
    /// Mean (m).
    pub mean_m: f64,
    /// Standard deviation (m); `None` for that of the vehicle's ranging.
    pub std_m: Option<f64>,
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
    /// Standard deviation of the carrier's relative frequency error, as a rate of the pseudorange
    /// (m/s); `None` if it is not specified.
    pub frequency_std_mps: Option<f64>,
}

/// Model of the ranges of a vehicle, in metres and seconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RangeModel {
    /// Whether a range contains the clocks of vehicle and radio head.
    pub is_one_way: bool,
    /// Standard deviation of the noise (m), if it is specified.
    pub sigma_m: Option<f64>,
    /// Position of the ranging antenna relative to the odometer's reference point `[forward, left,
    /// up]` (m).
    pub position_m: [f64; 3],
    /// Position of the antenna whose carrier phases are used, the first one of the array (m).
    pub phase_position_m: [f64; 3],
    /// Standard deviation of the relative scale error, which all radio heads share.
    pub scale_std: f64,
    /// Standard deviation of the offset of each radio head (m).
    pub offset_std_m: f64,
    /// Random walk of the offset of each radio head (m/√m).
    pub offset_walk_m_per_sqrt_m: f64,
    /// Standard deviation of the vehicle clock's offset (m).
    pub clock_std_m: f64,
    /// Random walk of the vehicle clock's offset (m/√s).
    pub clock_wander_m_per_sqrt_s: f64,
    /// Standard deviation of the vehicle clock's drift (m/s).
    pub drift_std_mps: f64,
    /// Random walk of the vehicle clock's drift (m/s/√s).
    pub drift_walk_mps_per_sqrt_s: f64,
    /// Wavelength of the carrier (m).
    pub wavelength_m: f64,
    /// Whether range rates are used.
    pub uses_range_rate: bool,
    /// Whether carrier phases are used.
    pub uses_carrier_phase: bool,
}

/// Standard deviation of an unspecified clock offset of a radio head (ns): cell phase
/// synchronisation accuracy of TDD cells (TS 38.133, 7.4.2).
const UNSTATED_CLOCK_STD_NS: f64 = 3000.0;

/// Random walk of an unspecified clock of a radio head (ns/√s): that of a crystal oscillator with a
/// frequency noise of 1e-9 at one second.
const UNSTATED_WANDER_NS_PER_SQRT_S: f64 = 1.0;

/// Standard deviation of an unspecified frequency error of a radio head (ppb): maximum error of a
/// wide-area base station (TS 38.104, 6.5.1).
const UNSTATED_FREQUENCY_STD_PPB: f64 = 50.0;

/// Returns the position of the first antenna of an array in a row; that of the array's centre
/// otherwise.
fn first_antenna_m(array: &ArraySettings, wavelength_m: f64) -> [f64; 3] {
    let [forward_m, left_m, up_m] = array.position_m;
    let behind = 0.5 * (f64::from(array.elements) - 1.0) * array.spacing_wavelengths;
    let behind_m = if array.shape.is_row() {
        behind * wavelength_m
    } else {
        0.0
    };
    let (sin, cos) = array.mounting_rad.sin_cos();
    [forward_m - behind_m * cos, left_m - behind_m * sin, up_m]
}

impl RangeModel {
    /// Creates the model of a vehicle with this array.
    pub fn new(settings: &RangingSettings, array: &ArraySettings, wavelength_m: f64) -> Self {
        let is_one_way = settings.kind == RangingKind::OneWay;
        let of_clock = |ns: f64| if is_one_way { METRES_PER_NS * ns } else { 0.0 };
        Self {
            is_one_way,
            sigma_m: settings.sigma_m,
            position_m: settings.position_m.unwrap_or(array.position_m),
            phase_position_m: (settings.position_m)
                .unwrap_or_else(|| first_antenna_m(array, wavelength_m)),
            scale_std: settings.scale_std(),
            offset_std_m: settings.offset_std_m,
            offset_walk_m_per_sqrt_m: settings.offset_walk_m_per_sqrt_m,
            clock_std_m: of_clock(settings.clock_offset_std_ns),
            clock_wander_m_per_sqrt_s: of_clock(settings.clock_wander_ns_per_sqrt_s),
            // A drift of 1 ppb is 1 ns/s.
            drift_std_mps: of_clock(settings.clock_frequency_std_ppb),
            drift_walk_mps_per_sqrt_s: of_clock(settings.clock_drift_walk_ppb_per_sqrt_s),
            wavelength_m,
            uses_range_rate: is_one_way && settings.range_rate,
            uses_carrier_phase: is_one_way && settings.carrier_phase,
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

    /// Returns the standard deviation of a radio head's frequency error, as a rate of the
    /// pseudorange (m/s).
    pub fn frequency_std_mps(&self, clock: &HeadClock) -> f64 {
        // 1 ppb is 1 ns/s.
        let usual = METRES_PER_NS * UNSTATED_FREQUENCY_STD_PPB;
        clock.frequency_std_mps.unwrap_or(usual)
    }
}
