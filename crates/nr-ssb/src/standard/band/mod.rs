//! Operating bands: possible SSB frequencies, and number of SSBs per burst set.

mod lookup;
mod operating_band;
mod table;

pub use lookup::{LikelyLmax, all, holding, likely_case, likely_lmax};
pub use operating_band::{Band, Spectrum};
