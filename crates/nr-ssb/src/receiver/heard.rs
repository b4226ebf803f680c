//! What a receiver says of one SSB.

use num_complex::{Complex32, Complex64};

use super::window::Seen;
use crate::dsp::channel_covariance::ChannelCovariance;
use crate::one_ssb::measure::Measurement;
use crate::standard::grid::SUBCARRIERS;
use crate::standard::message::payload::BchPayload;
use crate::standard::numerology::Lmax;
use crate::standard::pci::Pci;

/// One SSB that was heard.
#[derive(Debug, Clone, PartialEq)]
pub struct HeardSsb {
    /// The cell.
    pub pci: Pci,
    /// The beam.
    pub ssb_index: u8,
    /// How many of them the cell has, where frequency or PBCH tell.
    pub lmax: Option<Lmax>,
    /// Second half of the frame, where DM-RS or PBCH tell.
    pub half_frame: Option<bool>,
    /// What the PBCH says, if its checksum held.
    pub payload: Option<BchPayload>,
    /// First sample of the SSB, its cyclic prefix included, at the input's rate, from the first one
    /// pushed.
    pub sample_start: f64,
    /// Carrier frequency offset, Hz.
    pub cfo_hz: f64,
    /// SNR of a resource element, mean over the antennas, dB.
    pub snr_db: f64,
    /// Per antenna the channel on the 240 subcarriers, delay and offset taken out, in the scale of an
    /// unnormalised transform of 256: a tone of amplitude one has 256.
    pub channel: Vec<[Complex32; SUBCARRIERS]>,
    /// How its noise hangs together from subcarrier to subcarrier.
    pub channel_covariance: ChannelCovariance,
    /// Per symbol and antenna what the pilots say together, in that scale: the noise has the variance that it
    /// has on a resource element and is independent from block to block, which that of `channel` is not from
    /// subcarrier to subcarrier. What angles are to be estimated from.
    pub blocks: Vec<Vec<Complex64>>,
    /// Variance of the noise on a resource element, per antenna, in that scale squared.
    pub noise_variance: Vec<f64>,
    /// SS-RSRP, SS-RSRQ and SS-SINR per antenna.
    pub measurements: Vec<Measurement>,
    /// Looked at where it was expected; `false` of the first after a search has found its beam.
    pub tracked: bool,
}

impl HeardSsb {
    /// What was seen, places brought to a rate of `ratio` samples for each one at the base rate.
    pub(super) fn new<const A: usize>(seen: &mut Seen<'_, A>, ratio: f64) -> Self {
        let ssb = seen.ssb;
        let mut channel = vec![[Complex32::ZERO; SUBCARRIERS]; A];
        let channel_covariance = seen.tracker.channel(ssb.residual_delay, &mut channel);
        Self {
            pci: ssb.pci,
            ssb_index: ssb.ssb_index,
            lmax: Some(seen.tracker.lmax()),
            half_frame: ssb.half_frame,
            payload: ssb.payload,
            sample_start: ssb.sample_start * ratio,
            cfo_hz: ssb.cfo_hz,
            snr_db: ssb.snr_db,
            channel,
            channel_covariance,
            blocks: ssb.blocks.iter().map(|block| block.to_vec()).collect(),
            noise_variance: ssb.noise_variance.to_vec(),
            measurements: ssb.measurements.to_vec(),
            tracked: seen.is_followed,
        }
    }
}
