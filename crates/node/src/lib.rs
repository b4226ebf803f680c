//! Live localizer on the vehicle. Inputs are samples, angles and odometry from files, sockets or
//! radios. Outputs are poses to files, sockets, MQTT and a web page.
//!
//! The localizer is [`onboard::Live`]; this crate adds threads and sockets. Each source has a
//! thread that fills the [`inbox`]. One thread ([`engine`]) owns the pipeline and takes from the
//! inbox. Each output has a thread that writes its records ([`sink`]), and one thread serves the
//! web page ([`web`]). All queues are bounded: inputs that cannot be processed in time are dropped,
//! oldest first, and counted. A failed output does not affect the others ([`health`]).
//!
//! The parsers of external input are in this library instead of the program, so that fuzz tests can
//! call them.

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
