//! Tests of simulated drives through the public interface.
#![allow(
    clippy::expect_used,
    clippy::print_stdout,
    clippy::unwrap_used,
    reason = "these are tests"
)]

mod allocation;
mod arrays;
mod bad_drives;
mod bad_scenarios;
mod clock;
mod common;
#[path = "../../../nr-ssb/tests/all/counting/mod.rs"]
mod counting;
mod doors;
mod gap;
mod ideal_filter;
mod integrity;
mod iq_fidelity;
mod late;
mod late_signals;
mod live;
mod locate;
mod measurement_trace;
mod monitors;
mod plant;
mod simulated_drives;
mod smoother;
mod space;
mod start;
mod statistics;
mod tr38901;
mod tracker;
mod truth;
mod wake_up;
