//! Reception: a [`StreamReceiver`] of a sample stream, or a [`Receiver`] of windows, tracks the
//! cells of a site and creates an observation of each of their SSBs.

pub mod array_view;
pub mod despread;
mod ranging;
mod receiver;
pub mod wideband;

pub use receiver::{ReceiveError, Receiver, ReceiverConfig, SSB_SAMPLES, StreamReceiver, Window};
