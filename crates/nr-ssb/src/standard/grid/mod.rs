//! Resource elements of one SSB (TS 38.211 §7.4.3.1).
//!
//! Subcarriers k = 0…239 (k = 120 at the SSB's centre frequency) and symbols l = 0…3, stored with k
//! as the fastest index: k + 240·l. The area of PBCH and DM-RS is the same in every cell; v = PCI
//! mod 4 selects the quarter that is DM-RS.

mod elements;
mod indices;

pub use elements::SsbGrid;
pub use indices::{
    PBCH_LEN, SUBCARRIERS, SYMBOLS, dmrs_indices, pbch_indices, pss_indices, sss_indices,
};
