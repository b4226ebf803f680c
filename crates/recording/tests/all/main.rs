//! Tests of recordings and recorded drives through the public interface.
#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "these are tests")]

mod common;
mod diagnosis;
mod ranges;
mod recorded_drives;
mod scan;
mod sigmf;
