//! Wake-up as late as a bound on the error allows, and earlier where information is cheap.
//!
//! The paper's t_max keeps a position uncertainty x̃_max by a worst case: the distance driven at
//! top speed. The filter knows its error and how it grows, so the rule can be exact: wake up at
//! the last SSB before the error would, with the stated confidence, exceed the bound, and take the
//! fewest angles that keep it. Where not even all of them do, the bound is out of reach there, and
//! [`WakeUpPolicy::keeps_bound`] says so.
//!
//! An angle is worth what it takes off the variance of the position a little further on, where
//! what it says of heading and odometer has become position too. That depends on where the vehicle
//! is: beside a radio head an angle is worth many of those from afar. Of a constant energy the most
//! is made where the last angle bought everywhere takes away the same (equal marginal gains), so
//! an angle of at least that worth, `least_gain_m2`, is taken before the bound demands it: the
//! stretch ahead, where none is worth as much, then begins with a small error.
//!
//! A wake-up costs before its first angle: the receiver settles and is on for the burst, whatever is
//! estimated from it. What that is in executions the platform knows; where it is many, all radio
//! heads of a burst are heard at once and the next burst is farther off.
//!
//! Of what an angle says the most depends on the SNR of its SSB, which a receiver that listens knows
//! before any angle is estimated. Given `snr_headroom_db`, an angle's worth is judged by that.

use super::policy::{SAME_TIME_S, Situation, WakeUpPolicy};
use crate::BoxError;
use crate::gaussian::RadialQuantile;
use crate::localize::Ekf;
use crate::localize::ekf::state::Belief;
use crate::observation::SensedSsb;
use crate::radio_head::RadioHead;
use crate::settings::{Site, UncertaintySettings, Vehicle};
use crate::thermal::ThermalNoise;

/// Longest wake-up time it looks ahead for, in seconds.
const HORIZON_S: f64 = 20.0;

/// How much further on an angle's worth is judged, in metres.
const LOOK_AHEAD_M: f64 = 10.0;

/// Most radio heads among which it chooses.
const MOST_HEADS: usize = 64;

/// The uncertainty-driven policy.
#[derive(Clone, Debug)]
pub struct UncertaintyDriven {
    bound_m: f64,
    quantile: RadialQuantile,
    wake_up_cost: f64,
    least_gain_m2: f64,
    snr_headroom_db: Option<f64>,
    period_s: f64,
    base_s: f64,
    last_wake_up_s: Option<f64>,
    thermal: ThermalNoise,
}

impl UncertaintyDriven {
    /// The policy for a site's SSBs. `wake_up_cost` is the energy of a wake-up before its first
    /// angle, in executions.
    pub fn new(
        settings: &UncertaintySettings,
        wake_up_cost: f64,
        site: &Site,
        vehicle: &Vehicle,
    ) -> Self {
        Self {
            bound_m: settings.bound_m,
            quantile: RadialQuantile::new(1.0 - settings.confidence),
            wake_up_cost,
            least_gain_m2: settings.least_gain_m2,
            snr_headroom_db: settings.snr_headroom_db,
            period_s: site.ssb.period_s(),
            base_s: settings.base_ms.unwrap_or(0.0) * 1e-3,
            last_wake_up_s: None,
            thermal: ThermalNoise::new(site, vehicle),
        }
    }

    /// Whether the error keeps the bound until the SSB after `time_s` without another angle.
    pub fn keeps(&self, ekf: &Ekf, time_s: f64) -> bool {
        self.error_m(ekf, time_s + self.period_s) <= self.bound_m
    }

    /// The angles to take, one bit for each radio head: as many as make the most of the energy of
    /// the wake-up, if they are worth it or demanded, and more where only more keep the bound until
    /// the next SSB. Where nothing keeps it, those worth their energy. `snr_db` is what a radio head at a distance is received with.
    fn choice(
        &self,
        ekf: &Ekf,
        time_s: f64,
        heads: &[RadioHead],
        snr_db: impl Fn(&RadioHead, f64) -> f64,
    ) -> u64 {
        let demanded = !self.keeps(ekf, time_s);
        let mut belief = ekf.forecast(time_s);
        let ahead_m = ekf.speed_mps() * (time_s - ekf.time_s()).max(0.0);
        let ahead = ekf.transition(&belief, LOOK_AHEAD_M);
        let spread = |belief: &Belief| ahead.principal_variances(belief).iter().sum::<f64>();
        let next = ekf.transition(&belief, ekf.speed_mps() * self.period_s);
        let keeps = |belief: &Belief| {
            self.quantile.radius(next.principal_variances(belief)) <= self.bound_m
        };
        let before = spread(&belief);
        let (mut taken, mut best, mut most_m2) = (0u64, 0u64, 0.0);
        let (mut improving, mut kept) = (true, !demanded);
        for count in 1..=heads.len().min(MOST_HEADS) {
            let next = (heads.iter().enumerate().take(MOST_HEADS))
                .filter(|(index, _)| taken >> index & 1 == 0)
                .filter_map(|(index, head)| {
                    let sigma_rad = |distance_m| self.thermal.sigma_rad(snr_db(head, distance_m));
                    let thermal = |distance_m| sigma_rad(distance_m).powi(2);
                    let after = ekf.predicted_update(&belief, ahead_m, head, thermal)?;
                    Some((index, after, spread(&after)))
                })
                .min_by(|a, b| a.2.total_cmp(&b.2));
            let Some((index, after, left)) = next else {
                break;
            };
            taken |= 1 << index;
            belief = after;
            let cost = (self.wake_up_cost + count as f64) / (self.wake_up_cost + 1.0);
            let gain_m2 = (before - left) / cost;
            improving &= gain_m2 > most_m2;
            if improving {
                (best, most_m2) = (taken, gain_m2);
            }
            if !kept && keeps(&belief) {
                // The angles are taken in the same order for either purpose.
                best |= taken;
                kept = true;
            }
            if !improving && kept {
                break;
            }
        }
        if (demanded && kept) || most_m2 >= self.least_gain_m2 {
            best
        } else {
            0
        }
    }

    /// Time from `time_s` on for which the bound holds without another angle, in seconds: the
    /// latest wake-up.
    fn wake_up_time_s(&self, ekf: &Ekf, time_s: f64) -> f64 {
        let holds =
            |periods: f64| self.error_m(ekf, time_s + periods * self.period_s) <= self.bound_m;
        let (mut low, mut high) = (0.0, (HORIZON_S / self.period_s).ceil());
        if holds(high) {
            return high * self.period_s;
        }
        while high - low > 1.0 {
            let middle = (0.5 * (low + high)).floor();
            if holds(middle) {
                low = middle;
            } else {
                high = middle;
            }
        }
        (low * self.period_s).max(self.period_s)
    }

    fn error_m(&self, ekf: &Ekf, time_s: f64) -> f64 {
        let belief = ekf.forecast(time_s);
        self.quantile.radius(Ekf::principal_variances(&belief))
    }
}

/// A localizer that is no such filter, or does not know yet where it is, takes every angle.
impl WakeUpPolicy for UncertaintyDriven {
    /// Whether the error would exceed the bound at the SSB after, or an angle is worth its energy
    /// anyway.
    fn listens(&mut self, now: &Situation<'_>) -> Result<bool, BoxError> {
        let is_free = |last_s: f64| now.time_s - last_s + SAME_TIME_S >= self.base_s;
        if !self.last_wake_up_s.is_none_or(is_free) {
            return Ok(false);
        }
        let ekf = now.localizer.worst_case();
        let headroom_db = self.snr_headroom_db.unwrap_or(0.0);
        let snr_db =
            |head: &RadioHead, distance_m| now.budget.snr_db(head, distance_m) + headroom_db;
        Ok(ekf.is_none_or(|ekf| self.choice(ekf, now.now_s, now.heads, snr_db) != 0))
    }

    fn decide(
        &mut self,
        now: &Situation<'_>,
        sensed: &[SensedSsb],
        chosen: &mut [bool],
    ) -> Result<f64, BoxError> {
        self.last_wake_up_s = Some(now.time_s);
        let Some(ekf) = now.localizer.worst_case() else {
            chosen.fill(true);
            return Ok(self.period_s);
        };
        let snr_db = |head: &RadioHead, distance_m| {
            let sends = |ssb: &&SensedSsb| head.sends(ssb.pci, ssb.ssb_index);
            let ssb = (self.snr_headroom_db).and_then(|_| sensed.iter().find(sends));
            ssb.map_or_else(|| now.budget.snr_db(head, distance_m), |ssb| ssb.snr_db)
        };
        let choice = self.choice(ekf, now.now_s, now.heads, snr_db);
        for (ssb, chosen) in sensed.iter().zip(chosen) {
            let sends = |head: &RadioHead| head.sends(ssb.pci, ssb.ssb_index);
            *chosen = (now.heads.iter().position(sends))
                .is_some_and(|index| index < MOST_HEADS && choice >> index & 1 == 1);
        }
        Ok(self.wake_up_time_s(ekf, now.now_s))
    }

    fn keeps_bound(&self, now: &Situation<'_>) -> Option<bool> {
        let ekf = now.localizer.ekf()?;
        Some(self.keeps(ekf, now.now_s))
    }
}
