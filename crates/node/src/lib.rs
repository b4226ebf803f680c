//! The localizer on the vehicle, live: samples, angles and odometry in by file, socket or radio; poses out
//! by file, socket, MQTT and a page to look at.
//!
//! What it computes is [`onboard::Live`]; threads and sockets live here alone. One thread for each source fills
//! the [`inbox`], one thread ([`engine`]) takes from it and owns the pipeline, one writes what comes of it
//! ([`sink`]), one serves the page ([`web`]). Everything between them is bounded: what cannot be taken in time
//! is dropped, the oldest first, and counted.
//!
//! The parsers of whatever comes from outside are here rather than in the program, so that they can be tested
//! with hostile input.

pub mod address;
pub mod clock;
pub mod engine;
pub mod gate;
pub mod inbox;
pub mod playback;
pub mod settings;
pub mod sink;
pub mod source;
pub mod statistics;
pub mod supervisor;
pub mod web;
