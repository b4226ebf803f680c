//! Resource elements of one SSB (TS 38.211 §7.4.3.1).
//!
//! Subcarriers k = 0…239 (k = 120 at the SSB's centre frequency) times symbols l = 0…3, flattened with
//! k fastest: index k + 240·l. PBCH and its DM-RS share their places in every cell; v = PCI mod 4
//! says which quarter of them is DM-RS.

mod elements;
mod indices;

pub use elements::SsbGrid;
pub use indices::{
    PBCH_LEN, SUBCARRIERS, SYMBOLS, dmrs_indices, pbch_indices, pss_indices, sss_indices,
};
