//! Interface of wake-up policies.

use crate::BoxError;
use crate::link_budget::LinkBudget;
use crate::localize::Localizer;
use crate::observation::SsbDetection;
use crate::radio_head::RadioHead;
use crate::settings::SnrSetPoint;

/// Maximum difference of times that count as equal, in seconds: a clock error of 60 ppm over the
/// longest SSB period (160 ms), far below the shortest period (5 ms). The interval between received
/// SSBs differs from the period by a fraction of a sample.
pub const SAME_TIME_S: f64 = 1e-5;

/// Information for the decision of a policy, in addition to the measured SSBs.
#[derive(Clone, Copy)]
pub struct Situation<'a> {
    /// Time of the burst in seconds.
    pub time_s: f64,
    /// Time of the newest input, burst or odometry, in seconds. The localizer is ahead of a burst
    /// that arrives late.
    pub now_s: f64,
    /// Speed measured by the odometer, in m/s.
    pub speed_mps: f64,
    /// Localizer: pose estimate, and its covariance if it is the tracker.
    pub localizer: &'a dyn Localizer,
    /// Radio heads in line of sight, with the attenuation of walls.
    pub heads: &'a [RadioHead],
    /// Link budget between the radio heads and the vehicle.
    pub budget: &'a LinkBudget,
    /// Height of the array in metres.
    pub height_m: f64,
}

impl Situation<'_> {
    /// Returns the radio head that transmits an SSB, if it is known and in line of sight.
    pub fn head(&self, ssb: &SsbDetection) -> Option<&RadioHead> {
        let mut heads = self.heads.iter();
        heads.find(|head| head.sends(ssb.pci, ssb.ssb_index))
    }

    /// Returns the strongest measured SSB of a known radio head, and the radio head.
    pub fn strongest<'s>(
        &self,
        sensed: &'s [SsbDetection],
    ) -> Option<(&'s SsbDetection, &RadioHead)> {
        let known = sensed.iter().filter_map(|ssb| Some((ssb, self.head(ssb)?)));
        known.max_by(|a, b| a.0.snr_db.total_cmp(&b.0.snr_db))
    }

    /// Returns the SNR threshold minus the SNR of an SSB, in dB.
    ///
    /// # Errors
    /// Errors of the localizer.
    pub fn snr_shortfall_db(
        &self,
        set_point: SnrSetPoint,
        ssb: &SsbDetection,
        head: &RadioHead,
    ) -> Result<f64, BoxError> {
        let set_point_db = match set_point {
            SnrSetPoint::Expected { offset_db } => self.expected_snr_db(head)? + offset_db,
            SnrSetPoint::Absolute { snr_db } => snr_db,
        };
        Ok(set_point_db - ssb.snr_db)
    }

    /// Returns the SNR that the link budget predicts for a radio head at the estimated position, in
    /// dB.
    ///
    /// # Errors
    /// Errors of the localizer.
    pub fn expected_snr_db(&self, head: &RadioHead) -> Result<f64, BoxError> {
        let place = self.localizer.pose(self.now_s)?.pose.point();
        let distance_m = head.distance_m(place, self.height_m);
        Ok(self.budget.snr_db(head, distance_m))
    }
}

/// Wake-up policy: decides when an angle of arrival is estimated. The smallest example is
/// [`FixedInterval`](super::FixedInterval).
pub trait WakeUpPolicy: Send {
    /// Whether the receiver is on for the current burst, before anything about the burst is known.
    ///
    /// # Errors
    /// Errors of the policy; an error ends the drive.
    fn listens(&mut self, now: &Situation<'_>) -> Result<bool, BoxError>;

    /// Marks in `chosen`, initially all false, the measured SSBs from which angles are estimated,
    /// and returns the current wake-up time in seconds. At least one SSB is of a known radio head.
    ///
    /// # Errors
    /// Errors of the policy; an error ends the drive.
    fn decide(
        &mut self,
        now: &Situation<'_>,
        sensed: &[SsbDetection],
        chosen: &mut [bool],
    ) -> Result<f64, BoxError>;

    /// Whether the error stays below the policy's target until the next burst, if the policy has a
    /// target. `false` after a burst means that the target cannot be reached, or not at an
    /// acceptable energy.
    fn keeps_bound(&self, _now: &Situation<'_>) -> Option<bool> {
        None
    }
}
