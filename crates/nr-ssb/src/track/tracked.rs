//! What tracking says of one SSB.

use num_complex::Complex64;

use crate::one_ssb::measure::Measurement;
use crate::standard::grid::SYMBOLS;
use crate::standard::message::payload::BchPayload;
use crate::standard::pci::Pci;

/// One SSB of a tracked cell, seen by `A` antennas.
#[derive(Debug, Clone, PartialEq)]
pub struct Tracked<const A: usize> {
    /// The cell.
    pub pci: Pci,
    /// The beam: SSB index, by DM-RS; of 64 the three high bits by when it came.
    pub ssb_index: u8,
    /// Second half of the frame: by DM-RS at Lmax 4, else by the PBCH if decoded.
    pub half_frame: Option<bool>,
    /// First sample of the SSB, its cyclic prefix included, at the base rate.
    pub sample_start: f64,
    /// Carrier frequency offset after this SSB, filtered, Hz.
    pub cfo_hz: f64,
    /// SNR of a resource element, mean over the antennas, dB.
    pub snr_db: f64,
    /// Per symbol and antenna: received times conjugated pilots, summed over the subcarriers with
    /// the delay taken out, over the root of the pilots' number: the noise keeps the variance it
    /// has on a resource element. In the scale of an unnormalised transform.
    pub blocks: [[Complex64; A]; SYMBOLS],
    /// Samples by which the SSB came later than `received` has it: the delay that is taken out of
    /// the blocks.
    pub residual_delay: f64,
    /// Pilots behind each block: 127, 60, 151, 60; with the PBCH 127, 240, 223, 240.
    pub pilots: [u16; SYMBOLS],
    /// Variance of the noise on a resource element, per antenna.
    pub noise_variance: [f64; A],
    /// SS-RSRP, SS-RSRQ and SS-SINR per antenna.
    pub measurements: [Measurement; A],
    /// What the PBCH says, if it was asked for and its checksum held.
    pub payload: Option<BchPayload>,
}
