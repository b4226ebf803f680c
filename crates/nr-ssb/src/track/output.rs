//! Result of the tracking of one SSB.

use num_complex::Complex64;

use crate::dsp::received_grid::PerAntenna;
use crate::one_ssb::measure::Measurement;
use crate::standard::grid::SYMBOLS;
use crate::standard::message::payload::BchPayload;
use crate::standard::pci::Pci;

/// SSB of a tracked cell.
#[derive(Debug, Clone, PartialEq)]
pub struct TrackerOutput {
    /// Physical cell identity.
    pub pci: Pci,
    /// SSB index (beam) from the DM-RS; in a burst set of 64 the three high bits from its time.
    pub ssb_index: u8,
    /// Whether the SSB is in the second half of the frame: from the DM-RS for Lmax 4, otherwise
    /// from the PBCH if decoded.
    pub half_frame: Option<bool>,
    /// First sample of the SSB including its cyclic prefix, at the base rate.
    pub sample_start: f64,
    /// Filtered carrier frequency offset after this SSB, in Hz.
    pub cfo_hz: f64,
    /// SNR of a resource element, mean over the antennas, in dB.
    pub snr_db: f64,
    /// Despread pilots of each symbol and antenna: received elements times conjugated pilots,
    /// summed over the subcarriers after the compensation of the delay, divided by the square root
    /// of the number of pilots. The noise variance is that of a resource element, in the scale of
    /// an unnormalised DFT.
    pub blocks: [PerAntenna<Complex64>; SYMBOLS],
    /// Delay in samples of the SSB relative to `received`; it is compensated in the blocks.
    pub residual_delay: f64,
    /// Number of pilots of each block: 127, 60, 151, 60; with the PBCH 127, 240, 223, 240.
    pub pilots: [u16; SYMBOLS],
    /// Noise variance of a resource element, for each antenna.
    pub noise_variance: PerAntenna<f64>,
    /// SS-RSRP, SS-RSRQ and SS-SINR of each antenna.
    pub measurements: PerAntenna<Measurement>,
    /// Payload of the PBCH, if its decoding was requested and its CRC is correct.
    pub payload: Option<BchPayload>,
}
