//! The estimators, as whoever uses the crate meets them.

mod arrays;
mod bad_input;
mod bounds;
mod calibration;
mod common;
mod pilots;
mod several_sources;
mod single_source;
mod unequal;
