//! Physical broadcast channel: encoding and decoding (TS 38.212 §7.1, TS 38.211 §7.3.3).

mod combine;
mod decode;
mod encode;
mod llr;

pub use combine::Period;
pub use decode::{Decoded, Decoder};
pub use encode::encode;
pub use llr::llr;
