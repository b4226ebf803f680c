//! When an angle of arrival is worth its energy.

mod fixed;
mod pid;
mod uncertainty;

pub use fixed::FixedInterval;
pub use pid::{Adaptive, Controller, Pid};
pub use uncertainty::UncertaintyDriven;

use crate::BoxError;

/// What a policy may base its decision on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WakeUpInputs {
    /// Time of the SSB in seconds.
    pub time_s: f64,
    /// Its sensed SNR in dB.
    pub sensed_snr_db: f64,
    /// What the link budget promises at the estimated place, in dB.
    pub expected_snr_db: f64,
    /// Speed by the odometer, in m/s.
    pub speed_mps: f64,
}

/// What a policy says about an SSB.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WakeUpDecision {
    /// Whether its angle is to be estimated.
    pub estimate: bool,
    /// The wake-up time that was in force, in seconds.
    pub wake_up_time_s: f64,
}

/// The wake-up policy a scenario chooses.
#[derive(Debug)]
pub enum Policy {
    /// At a fixed interval.
    Fixed(FixedInterval),
    /// By Algorithm 1, or by a controller put in its place.
    Adaptive(Adaptive),
}

impl Policy {
    /// Whether the receiver listens at all at `time_s`.
    pub fn listens(&self, time_s: f64) -> bool {
        match self {
            Self::Fixed(policy) => policy.is_due(time_s),
            Self::Adaptive(policy) => policy.listens(time_s),
        }
    }

    /// Whether the angle of the SSB at hand is to be estimated.
    ///
    /// # Errors
    /// Whatever a controller put in by the user fails with.
    pub fn decide(&mut self, inputs: &WakeUpInputs) -> Result<WakeUpDecision, BoxError> {
        match self {
            Self::Fixed(policy) => Ok(policy.decide(inputs.time_s)),
            Self::Adaptive(policy) => policy.decide(inputs),
        }
    }
}

/// Clock readings this close count as equal: far below any SSB period, far above rounding.
const SAME_TIME_S: f64 = 1e-9;
