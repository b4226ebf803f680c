//! Ranges and delays that were measured elsewhere.

use super::{Live, finite};
use crate::live::LiveError;
use crate::localize::UpdateReason;
use crate::localize::UpdateResult;
use crate::range::{METRES_PER_NS, RangeMeasurement};

/// Maximum magnitude of a range (m): above it, its unit is wrong.
const MAX_RANGE_M: f64 = 1e7;

/// Magnitude of a delay (ns) below which it is probably in seconds: a delay of 10 km is 3e-5 s.
const MIN_DELAY_NS: f64 = 1e-4;

/// Range or one-way delay to a radio head, measured by another receiver.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RangeObservation {
    /// Physical cell identity of the radio head.
    pub pci: u16,
    /// SSB index of the radio head.
    pub ssb_index: u8,
    /// Time in seconds.
    pub time_s: f64,
    /// Two-way range in metres, or one-way delay in nanoseconds.
    pub value: RangeValue,
    /// Standard deviation in the unit of the value; `None` for that of the vehicle's settings.
    pub sigma: Option<f64>,
}

/// Measured distance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RangeValue {
    /// Two-way range in metres.
    RangeM(f64),
    /// One-way delay in nanoseconds, by the clocks of vehicle and radio head.
    DelayNs(f64),
}

impl Live {
    /// Processes a range or delay, and returns the verdict of the localizer.
    ///
    /// # Errors
    /// [`LiveError::Value`] for an invalid value, or a kind that differs from `ranging.kind` of the
    /// vehicle; [`LiveError::Time`] and [`LiveError::AngleAhead`] for an implausible time;
    /// [`LiveError::Custom`].
    pub fn range(&mut self, range: &RangeObservation) -> Result<UpdateResult, LiveError> {
        let (what, value, metres) = match range.value {
            RangeValue::RangeM(range_m) => ("a range in m", range_m, 1.0),
            RangeValue::DelayNs(delay_ns) => ("a delay in ns", delay_ns, METRES_PER_NS),
        };
        finite(what, value)?;
        let invalid = |what, value, allowed| LiveError::Value {
            what,
            value,
            allowed,
        };
        let is_delay = matches!(range.value, RangeValue::DelayNs(_));
        if self.vehicle.ranging.is_none() || is_delay != self.vehicle.has_one_way_ranging() {
            let allowed = if is_delay {
                "ranging.kind of the vehicle file must be \"one-way\" for delays"
            } else {
                "ranging.kind of the vehicle file must be \"two-way\" for ranges"
            };
            return Err(invalid(what, value, allowed));
        }
        if is_delay && value != 0.0 && value.abs() < MIN_DELAY_NS {
            let allowed = "it must be in nanoseconds, and is probably in seconds";
            return Err(invalid(what, value, allowed));
        }
        if (metres * value).abs() > MAX_RANGE_M {
            let allowed = "its magnitude must be below 10,000 km; check its unit";
            return Err(invalid(what, value, allowed));
        }
        if let Some(sigma) = range.sigma
            && !(sigma > 0.0 && sigma.is_finite())
        {
            let what = "the standard deviation of a range";
            return Err(invalid(what, sigma, "it must be positive"));
        }
        self.process_angles()?;
        let newest = self.onboard.newest_odometry();
        let time_s = self.clocks.accept_burst("range", range.time_s, newest)?;
        self.see(time_s);
        let sigma_m = range.sigma.map(|sigma| metres * sigma);
        let measured = RangeMeasurement::range(time_s, metres * value, sigma_m);
        let verdict = (self.onboard)
            .range(range.pci, range.ssb_index, &measured)
            .map_err(LiveError::Custom)?;
        if verdict.accepted {
            self.last_angle_s = Some(time_s);
        }
        let is_judged = verdict.accepted || verdict.reason == UpdateReason::Outlier;
        if is_judged && self.clocks.agree() {
            self.confirmation.angle(range.pci, verdict.accepted);
        }
        Ok(verdict)
    }
}
