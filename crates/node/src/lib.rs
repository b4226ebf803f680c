//! The localizer on the vehicle, live: samples, angles and odometry in by file, socket or radio; poses out
//! by file, socket, MQTT and a page to look at.
//!
//! What it computes is [`onboard::Live`]; threads and sockets live here alone. One thread for each source fills
//! the [`inbox`], one thread ([`engine`]) takes from it and owns the pipeline, one thread for each output writes
//! its records ([`sink`]), one serves the page ([`web`]). Everything between them is bounded: what cannot be taken
//! in time is dropped, the oldest first, and counted. An output that fails does not affect the others
//! ([`health`]).
//!
//! The parsers of whatever comes from outside are here rather than in the program, so that they can be tested
//! with hostile input.

pub mod address;
mod angle_watch;
pub mod clock;
pub mod engine;
pub mod events;
pub mod gate;
pub mod health;
pub mod inbox;
mod interruption;
pub mod playback;
pub mod settings;
pub mod sink;
pub mod source;
pub mod state;
pub mod statistics;
pub mod supervisor;
pub mod web;
