//! From samples to observations: a [`StreamReceiver`], or a [`Receiver`] of windows, keeps to the cells of a
//! site while the vehicle drives, and makes an observation of each of their SSBs.

pub mod array_view;
pub mod despread;
mod receiver;
pub mod wideband;

pub use receiver::{ReceiveError, Receiver, ReceiverConfig, SSB_SAMPLES, StreamReceiver, Window};
