//! Results of a search.

use num_complex::Complex32;

use crate::dsp::channel_covariance::ChannelCovariance;
use crate::dsp::received_grid::{MAX_ANTENNAS, ReceivedGrid};
use crate::one_ssb::measure::Measurement;
use crate::standard::grid::{SUBCARRIERS, SsbGrid};
use crate::standard::message::payload::BchPayload;
use crate::standard::numerology::Lmax;
use crate::standard::pci::Pci;

/// Detected SSB.
#[derive(Debug, Clone, PartialEq)]
pub struct DetectedSsb {
    /// Physical cell identity.
    pub pci: Pci,
    /// ī_SSB of the DM-RS, which determines the low bits of the SSB index for a given `lmax`.
    pub ibar_ssb: u8,
    /// SSB index. Without a decoded PBCH it is derived from the DM-RS for the more probable `lmax`;
    /// for Lmax 64 it contains the three low bits only.
    pub ssb_index: u8,
    /// Whether the SSB is in the second half of the frame; unknown without a decoded PBCH for Lmax
    /// 8.
    pub half_frame: Option<bool>,
    /// Burst set size: decoded from the PBCH of one of the cell's SSBs, or the only one of the
    /// bands at this frequency (TS 38.213 §4.1). `None` if it is ambiguous: the first four SSBs of
    /// a frame are identical in sets of 4 and 8.
    pub lmax: Option<Lmax>,
    /// MIB, system frame number and half frame, if the CRC is correct.
    pub payload: Option<BchPayload>,
    /// First sample of the SSB including its cyclic prefix, at the base rate, with its fraction,
    /// relative to the first sample of the stream.
    pub sample_start: f64,
    /// Carrier frequency offset in Hz.
    pub cfo_hz: f64,
    /// Phase step between symbols (TS 38.211 §5.4) minus the step caused by the frequency offset,
    /// in radians.
    pub symbol_phase_step_rad: f64,
    /// SNR of a resource element, mean over the antennas, in dB.
    pub snr_db: f64,
    /// Sum of the PSS, SSS and DM-RS detection statistics.
    pub statistic: f32,
    /// Carrier frequency offset estimated within the symbols, in Hz.
    pub(crate) coarse_cfo_hz: f64,
    pub(super) measurements: [Measurement; MAX_ANTENNAS],
    pub(super) antennas: usize,
}

impl DetectedSsb {
    /// Returns SS-RSRP, SS-RSRQ and SS-SINR of every antenna.
    pub fn measurements(&self) -> &[Measurement] {
        &self.measurements[..self.antennas]
    }
}

/// Received resource elements of one SSB. Stronger cells, delay and frequency offset are removed.
#[derive(Debug, Clone, Copy)]
pub struct ReceivedElements<'a> {
    /// Resource elements of every antenna, `[symbol][subcarrier]`.
    pub elements: &'a [ReceivedGrid],
    /// Known elements, zero elsewhere: pilots, and the PBCH if it was decoded.
    pub known: &'a SsbGrid,
    /// Channel on the 240 subcarriers, for each antenna.
    pub channel: &'a [[Complex32; SUBCARRIERS]],
    /// Covariance of the channel estimate's noise over the subcarriers.
    pub channel_covariance: &'a ChannelCovariance,
    /// Noise variance of a resource element, for each antenna.
    pub noise_variance: &'a [f64],
}

/// Number of candidates at each stage in the last block.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SearchCounts {
    /// Number of examined maxima of the matched filter.
    pub pss_candidates: usize,
    /// Number of examined maxima that were probable SSBs, so that their PBCH was decoded.
    pub pbch_tried: usize,
}
