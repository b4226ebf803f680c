//! What a search finds.

use num_complex::Complex32;

use crate::dsp::channel_covariance::ChannelCovariance;
use crate::dsp::received_grid::{MAX_ANTENNAS, ReceivedGrid};
use crate::one_ssb::measure::Measurement;
use crate::standard::grid::{SUBCARRIERS, SsbGrid};
use crate::standard::message::payload::BchPayload;
use crate::standard::numerology::Lmax;
use crate::standard::pci::Pci;

/// One received SSB.
#[derive(Debug, Clone, PartialEq)]
pub struct DetectedSsb {
    /// The cell.
    pub pci: Pci,
    /// ī_SSB of its DM-RS: with `lmax` the low bits of the SSB index.
    pub ibar_ssb: u8,
    /// SSB index; without a decoded PBCH as the DM-RS tells it for the likelier `lmax`, and of Lmax 64
    /// its three low bits only.
    pub ssb_index: u8,
    /// Second half of the frame; unknown without a decoded PBCH at Lmax 8.
    pub half_frame: Option<bool>,
    /// Burst set size: told, by the PBCH of one of the cell's SSBs, or the only one of the bands there
    /// (TS 38.213 §4.1). `None` where that leaves a doubt: of the first four SSBs of a frame, sets of
    /// 4 and 8 send the same.
    pub lmax: Option<Lmax>,
    /// MIB, system frame number and half frame, if the checksum held.
    pub payload: Option<BchPayload>,
    /// First sample of the SSB, its cyclic prefix included, at the base rate, to a fraction of a
    /// sample, from the first sample ever pushed.
    pub sample_start: f64,
    /// Carrier frequency offset, Hz.
    pub cfo_hz: f64,
    /// Phase from symbol to symbol beyond that of the offset (TS 38.211 §5.4), radians.
    pub symbol_phase_step_rad: f64,
    /// SNR of a resource element, mean over the antennas, dB.
    pub snr_db: f64,
    /// PSS, SSS and DM-RS detection statistics together.
    pub statistic: f32,
    /// Carrier frequency offset by the insides of the symbols alone, Hz.
    pub(crate) coarse_cfo_hz: f64,
    pub(super) measurements: [Measurement; MAX_ANTENNAS],
    pub(super) antennas: usize,
}

impl DetectedSsb {
    /// SS-RSRP, SS-RSRQ and SS-SINR of every antenna.
    pub fn measurements(&self) -> &[Measurement] {
        &self.measurements[..self.antennas]
    }
}

/// What was received of one SSB, stronger cells' taken out, delay and frequency offset too.
#[derive(Debug, Clone, Copy)]
pub struct ReceivedSsb<'a> {
    /// The resource elements of every antenna, `[symbol][subcarrier]`.
    pub elements: &'a [ReceivedGrid],
    /// The elements that are known, zero elsewhere: pilots, and the PBCH if it decoded.
    pub known: &'a SsbGrid,
    /// The channel on the 240 subcarriers, per antenna.
    pub channel: &'a [[Complex32; SUBCARRIERS]],
    /// How its noise hangs together from subcarrier to subcarrier.
    pub channel_covariance: &'a ChannelCovariance,
    /// Variance of the noise on a resource element, per antenna.
    pub noise_variance: &'a [f64],
}

/// How far candidates came in the last block.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SearchCounts {
    /// Maxima of the matched filter that were examined.
    pub pss_candidates: usize,
    /// Of these, SSBs likely enough for their PBCH to be decoded.
    pub pbch_tried: usize,
}
