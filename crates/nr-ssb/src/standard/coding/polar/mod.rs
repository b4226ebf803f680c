//! The polar code of the PBCH: K = 56 bits (32 payload, 24 CRC) to N = 512 (TS 38.212 §5.3.1, §7.1.4).
//!
//! `tree` determines the leaves, `leaf` decodes them, and `checks` removes paths that violate the
//! parity checks.

mod checks;
mod code;
mod encode;
mod leaf;
mod list;
#[cfg(test)]
mod list_tests;
mod tree;

pub use code::{K, N};
pub use encode::{Codeword, encode};
pub use list::{Candidates, ListDecoder};
