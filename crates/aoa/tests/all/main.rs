//! Tests of the estimators through the public interface.
#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "these are tests")]

mod arrays;
mod bad_input;
mod bounds;
mod calibration;
mod common;
mod few_snapshots;
mod goodness_of_fit;
mod pilots;
mod several_sources;
mod single_source;
mod unequal;
