//! The time-correlated (multipath) bias of each radio head's angles, estimated together with the state: a jump process
//! whose value and size are hypotheses, mixed into one Gaussian after each angle.

mod correlated_bias;
mod jump_process;

pub use correlated_bias::CorrelatedBias;
pub(in crate::localize) use jump_process::{JumpHypotheses, MOST_VARIANCE, independent, repeats};
