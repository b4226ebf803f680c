//! Position of an SSB in time: subcarrier spacings, SSB patterns, symbols and cyclic prefixes.

mod burst_set;
mod case;
mod sampling;
mod spacing;

pub use burst_set::Lmax;
pub use case::Case;
pub use sampling::Numerology;
pub(crate) use spacing::FR2_FROM_HZ;
pub use spacing::SubcarrierSpacing;
