//! Tests of the SSB processing through the public interface.
#![allow(
    clippy::expect_used,
    clippy::print_stdout,
    clippy::unwrap_used,
    reason = "these are tests"
)]

mod air;
mod allocation;
mod burst_sets;
mod captures;
mod clocks;
mod common;
mod counting;
mod detection;
mod distorted;
mod estimates;
mod golden;
mod loaded;
mod moving;
mod noise_only;
mod noisy;
mod observables;
mod off_raster;
mod pbch;
mod properties;
mod receiver;
mod recordings;
mod stream;
mod tones;
mod track;
mod vectors;
