//! Covariance of the antenna signals, the sufficient statistic of all estimators.

pub(crate) mod averaging;
pub(crate) mod sample;
