//! Recordings and recorded drives, from outside.

mod common;
mod recorded_drives;
mod scan;
mod sigmf;
