//! Recorded samples before any search.

pub mod diagnose;
pub mod front_end;
