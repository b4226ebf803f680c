//! The bands that cells are operated in, and what follows from them: where in frequency an SSB may
//! lie, and how many a burst set has.

mod lookup;
mod operating_band;
mod table;

pub use lookup::{LikelyLmax, all, holding, likely_lmax};
pub use operating_band::{Band, Spectrum};
