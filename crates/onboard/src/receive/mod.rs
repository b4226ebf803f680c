//! Reception: a [`Receiver`] of windows, or the receiver of a sample stream, tracks the cells of a
//! site and creates an observation of each of their SSBs.

pub mod array_view;
pub mod despread;
mod ranging;
mod receiver;
pub mod wideband;

pub(crate) use receiver::Observer;
pub use receiver::{ReceiveError, Receiver, ReceiverConfig, SSB_SAMPLES, Window};
