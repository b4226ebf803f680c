//! Recorded samples before anything is looked for in them.

pub mod diagnose;
pub mod front_end;
