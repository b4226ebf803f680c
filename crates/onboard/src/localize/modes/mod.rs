//! A static multiple-model bank of filters, one for each fault mode.

mod bank;
mod config;
mod head_test;
mod hypotheses;
mod likelihood;
mod noise_ratio;
mod slip;
mod table;

pub(in crate::localize) use bank::Bank;
pub use config::IntegrityConfig;
pub use head_test::HeadTest;
pub(in crate::localize) use hypotheses::FaultModes;
