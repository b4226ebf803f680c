//! Web page and metrics.

mod board;
mod metrics;
mod server;
mod site;

pub use board::{Counters, StatusBoard};
pub use metrics::text as metrics_text;
pub use server::{open, serve};
