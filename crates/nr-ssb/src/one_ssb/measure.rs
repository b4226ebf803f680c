//! Measurements of TS 38.215 §5.1 on one SSB, per antenna.

use num_complex::Complex32;

use crate::dsp::base_rate::SYMBOL_FFT;
use crate::dsp::received_grid::ReceivedGrid;
use crate::numeric::decibel::decibel;
use crate::numeric::sums::energy;
use crate::standard::grid::{SUBCARRIERS, SYMBOLS, pss_indices};

/// Number of resource blocks of an SSB.
const RESOURCE_BLOCKS: f64 = 20.0;

/// Power measurements of one SSB at one antenna. 0 dBFS is the power of a tone of amplitude one.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Measurement {
    /// SS-RSRP: power of a resource element of the SSS.
    pub ss_rsrp_dbfs: f64,
    /// SS-RSRQ: 20 resource blocks × SS-RSRP divided by the total power in the SSB's band and
    /// symbols.
    pub ss_rsrq_db: f64,
    /// SS-SINR: SS-RSRP divided by noise plus interference on a resource element.
    pub ss_sinr_db: f64,
}

/// Computes the measurements of one antenna from the received elements, the SSS power per resource
/// element and its noise variance, in the scale of an unnormalised DFT.
pub(crate) fn measure(grid: &ReceivedGrid, rsrp: f64, noise_variance: f64) -> Measurement {
    let received: f32 = grid.iter().map(energy).sum();
    let rssi = f64::from(received) / SYMBOLS as f64;
    let full_scale = (SYMBOL_FFT * SYMBOL_FFT) as f64;
    Measurement {
        ss_rsrp_dbfs: decibel(rsrp / full_scale),
        ss_rsrq_db: decibel(RESOURCE_BLOCKS * rsrp / rssi),
        ss_sinr_db: decibel(rsrp / noise_variance),
    }
}

/// Returns the power of the channel on the subcarriers of the SSS.
pub(crate) fn sss_power(channel: &[Complex32; SUBCARRIERS]) -> f64 {
    // The PSS has the same subcarriers, and its flat indices equal them because it is in symbol 0.
    mean_power(&channel[pss_indices()])
}

fn mean_power(values: &[Complex32]) -> f64 {
    let sum: f32 = values.iter().map(Complex32::norm_sqr).sum();
    f64::from(sum) / values.len() as f64
}
