//! What runs on the vehicle, from outside.

#[path = "../../../nr-ssb/tests/all/air/mod.rs"]
mod air;
mod differential;
mod gap;
mod random_drives;
mod receiver;
mod recovery;
mod settings;
mod tracker;
mod yaw_rate;
