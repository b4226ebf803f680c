//! Tests of the vehicle's software through its public interface.
#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "these are tests")]

#[path = "../../../nr-ssb/tests/all/air/mod.rs"]
mod air;
mod differential;
mod gap;
mod live_ranges;
mod live_times;
mod random_drives;
mod range_drive;
mod ranges;
mod receiver;
mod recovery;
mod renamed;
mod settings;
mod starts;
mod tracker;
mod yaw_rate;
