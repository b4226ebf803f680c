//! Support for vectorised loops: selection by processor, and branch-free functions.

pub(crate) mod instructions;
pub(crate) mod math;
