//! Inputs, each with its own thread.

mod connection;
mod framing;
mod lines;
mod message;
mod raw;
mod recording;
#[cfg(feature = "soapy")]
mod soapy;
mod start;
mod zeromq;
mod zmtp;

pub use framing::{Framing, View};
pub use lines::Lines;
pub use message::parse;
pub use recording::Blocks;
pub use start::{Files, Sources, start};
pub use zmtp::{answer, greet};
