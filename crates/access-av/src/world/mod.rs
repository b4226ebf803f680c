//! The truth: where the road runs, how the vehicle moves on it, what its odometer makes of that.

mod radio_head;
mod track;

pub use radio_head::RadioHead;
pub use track::{Projection, Segment, Track, TrackError};
