//! Signal processing of one SSB: filter, transform, offset, delay, channel, and subtraction.

pub(crate) mod alignment;
pub(crate) mod base_rate;
pub(crate) mod cancel;
pub(crate) mod cfo;
pub(crate) mod channel_covariance;
pub(crate) mod channel_estimate;
pub(crate) mod demodulate;
pub(crate) mod hypotheses;
pub(crate) mod matched_filter;
pub(crate) mod pss_segments;
pub(crate) mod pss_symbol;
pub(crate) mod received_grid;
pub(crate) mod timing;
pub(crate) mod tones;
pub(crate) mod whitening;
