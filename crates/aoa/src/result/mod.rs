//! What an estimate says about the direction, and about itself.

pub(crate) mod angle;
pub(crate) mod direction;
pub(crate) mod verdict;
