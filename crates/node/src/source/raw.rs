//! Interleaved samples of all channels as raw bytes.

use super::connection::{Event, read};
use super::framing::Framing;
use crate::address::Address;
use crate::inbox::Inbox;

/// Reads samples until the node stops or the stream ends.
pub fn run(address: &Address, mut framing: Framing, inbox: &Inbox) {
    read(address, "samples", inbox, |event| match event {
        Event::Begin => framing.restart(),
        Event::Bytes(bytes) => framing.interleaved(bytes),
    });
}
