//! All SSBs of a recording whose frequency and subcarrier spacing are not known.

pub mod band;
mod placement;
mod point_search;
