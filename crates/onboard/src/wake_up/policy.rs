//! The door for wake-up policies.

use crate::BoxError;
use crate::link_budget::LinkBudget;
use crate::localize::Localizer;
use crate::observation::SensedSsb;
use crate::radio_head::RadioHead;
use crate::settings::SnrSetPoint;

/// Clock readings this close count as equal: a clock 60 ppm off over the longest SSB period (160 ms), far below the
/// shortest (5 ms). SSBs that are received come a fraction of a sample sooner or later than a period after the last.
pub const SAME_TIME_S: f64 = 1e-5;

/// What a policy may base its decision on, beside what is sensed of the SSBs.
#[derive(Clone, Copy)]
pub struct Situation<'a> {
    /// Time of the burst in seconds.
    pub time_s: f64,
    /// Time of the newest that came in, this burst or odometry, in seconds: where a burst comes late,
    /// the localizer is beyond it.
    pub now_s: f64,
    /// Speed by the odometer, in m/s.
    pub speed_mps: f64,
    /// The localizer, which knows where the vehicle is and, if it is the tracker, how well.
    pub localizer: &'a dyn Localizer,
    /// The radio heads of the site that are in sight, with the power that walls leave of theirs.
    pub heads: &'a [RadioHead],
    /// What their SSBs should be received with.
    pub budget: &'a LinkBudget,
    /// Height of the array in metres.
    pub height_m: f64,
}

impl Situation<'_> {
    /// The radio head that sends an SSB, if the site has it and it is in sight.
    pub fn head(&self, ssb: &SensedSsb) -> Option<&RadioHead> {
        let mut heads = self.heads.iter();
        heads.find(|head| head.sends(ssb.pci, ssb.ssb_index))
    }

    /// The strongest of the sensed SSBs that are on the map, and its radio head.
    pub fn strongest<'s>(&self, sensed: &'s [SensedSsb]) -> Option<(&'s SensedSsb, &RadioHead)> {
        let known = sensed.iter().filter_map(|ssb| Some((ssb, self.head(ssb)?)));
        known.max_by(|a, b| a.0.snr_db.total_cmp(&b.0.snr_db))
    }

    /// By how much the SNR of an SSB falls short of a set point, in dB; negative above it.
    ///
    /// # Errors
    /// Whatever the localizer fails with.
    pub fn snr_shortfall_db(
        &self,
        set_point: SnrSetPoint,
        ssb: &SensedSsb,
        head: &RadioHead,
    ) -> Result<f64, BoxError> {
        let set_point_db = match set_point {
            SnrSetPoint::Expected { offset_db } => self.expected_snr_db(head)? + offset_db,
            SnrSetPoint::Absolute { snr_db } => snr_db,
        };
        Ok(set_point_db - ssb.snr_db)
    }

    /// The SNR that the link budget promises of a radio head at the estimated place, in dB.
    ///
    /// # Errors
    /// Whatever the localizer fails with.
    pub fn expected_snr_db(&self, head: &RadioHead) -> Result<f64, BoxError> {
        let place = self.localizer.pose(self.now_s)?.pose.point();
        let distance_m = head.distance_m(place, self.height_m);
        Ok(self.budget.snr_db(head, distance_m))
    }
}

/// When an angle of arrival is worth its energy. The smallest one to copy from is
/// [`FixedInterval`](super::FixedInterval).
pub trait WakeUpPolicy: Send {
    /// Whether the receiver listens to the burst at hand, of which nothing is known yet.
    ///
    /// # Errors
    /// Whatever a user's policy fails with; it ends the drive.
    fn listens(&mut self, now: &Situation<'_>) -> Result<bool, BoxError>;

    /// Marks in `chosen` which of the sensed SSBs are worth an angle, none of them at first, and
    /// returns the wake-up time that is in force, in seconds. At least one of them is on the map.
    ///
    /// # Errors
    /// Whatever a user's policy fails with; it ends the drive.
    fn decide(
        &mut self,
        now: &Situation<'_>,
        sensed: &[SensedSsb],
        chosen: &mut [bool],
    ) -> Result<f64, BoxError>;

    /// Whether the error keeps the policy's own bound until the next burst, if it has one. `false`
    /// after a burst whose angles were free to be taken says that the bound is out of reach there,
    /// or not worth its price.
    fn keeps_bound(&self, _now: &Situation<'_>) -> Option<bool> {
        None
    }
}
