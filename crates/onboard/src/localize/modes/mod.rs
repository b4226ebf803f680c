//! Fault modes: a [table](table), a static bank of filters ([`Bank`]), the likelihood that weights
//! them, the test of each radio head, and the measured noise of the angles.

mod bank;
mod likelihood;
mod noise_scale;
mod odometry_test;
mod range_update;
mod subsets;
mod table;

pub(in crate::localize) use bank::{Bank, EVENT_EPOCHS, EVENT_S};
pub use likelihood::AngleEvidence;
pub(in crate::localize) use likelihood::{
    CERTAIN, log_likelihood, log_likelihood_as_stated, range_density,
};
pub use odometry_test::OdometryTest;
pub use subsets::HeadTest;
pub(in crate::localize) use subsets::RECOVERY_S;
#[cfg(test)]
pub(in crate::localize) use table::trip;
