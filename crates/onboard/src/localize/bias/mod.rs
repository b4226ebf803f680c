//! Time-correlated (multipath) bias of each radio head's angles, estimated together with the state:
//! a jump process, whose hypotheses of value and level are merged to one Gaussian after each angle.

mod error_correlation;
mod jump_process;
mod mixture_update;
mod multipath_bias;
mod persistent_bias;
mod range_states;

pub(in crate::localize) use error_correlation::{AngleError, ErrorCorrelation};
pub(in crate::localize) use jump_process::{
    Dependence, JumpHypotheses, MAX_VARIANCE, VALUE_M, independent, share,
};
pub use multipath_bias::MultipathBias;
pub(in crate::localize) use range_states::{
    CLOCK, DRIFT, HeadState, RANGE_SCALE, RangeTerms, common_phase,
};
