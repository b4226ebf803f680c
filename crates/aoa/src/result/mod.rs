//! Results: directions, uncertainty and reliability.

pub(crate) mod angle;
pub(crate) mod azimuth_elevation;
pub(crate) mod direction;
pub(crate) mod goodness_of_fit;
pub(crate) mod verdict;
