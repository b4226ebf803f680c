//! Result of the reception of one SSB.

use num_complex::{Complex32, Complex64};

use super::window::ReceivedBeam;
use crate::dsp::channel_covariance::ChannelCovariance;
use crate::observables::Observables;
use crate::one_ssb::measure::Measurement;
use crate::standard::grid::SUBCARRIERS;
use crate::standard::message::payload::BchPayload;
use crate::standard::numerology::Lmax;
use crate::standard::pci::Pci;

/// Received SSB.
#[derive(Debug, Clone, PartialEq)]
pub struct TrackedSsb {
    /// Physical cell identity.
    pub pci: Pci,
    /// SSB index (beam).
    pub ssb_index: u8,
    /// Burst set size, if the frequency or the PBCH determines it.
    pub lmax: Option<Lmax>,
    /// Whether the SSB is in the second half of the frame, if DM-RS or PBCH determine it.
    pub half_frame: Option<bool>,
    /// Payload of the PBCH, if its CRC is correct.
    pub payload: Option<BchPayload>,
    /// First sample of the SSB including its cyclic prefix, at the input's rate, relative to the
    /// first sample of the stream.
    pub sample_start: f64,
    /// Carrier frequency offset in Hz.
    pub cfo_hz: f64,
    /// SNR of a resource element, mean over the antennas, in dB.
    pub snr_db: f64,
    /// Channel on the 240 subcarriers for each antenna, with delay and offset compensated, in the
    /// scale of an unnormalised DFT of 256: a tone of amplitude one has 256.
    pub channel: Vec<[Complex32; SUBCARRIERS]>,
    /// Covariance of the channel's noise over the subcarriers.
    pub channel_covariance: ChannelCovariance,
    /// Despread pilots for each symbol and antenna, in the scale of `channel`. The noise has the
    /// variance of a resource element and is independent between blocks, in contrast to the noise
    /// of `channel` between subcarriers. Angles are estimated from these blocks.
    pub blocks: Vec<Vec<Complex64>>,
    /// Noise variance of a resource element for each antenna, in that scale squared.
    pub noise_variance: Vec<f64>,
    /// SS-RSRP, SS-RSRQ and SS-SINR for each antenna.
    pub measurements: Vec<Measurement>,
    /// Delay, carrier phase, range rate and power. Sample positions are at the input's rate.
    pub observables: Option<Observables>,
    /// Amplitude of a resource element for each antenna, with the phase of the carrier phase, in the
    /// scale of `channel`. Empty without `observables`.
    pub amplitudes: Vec<Complex64>,
    /// Noise variance of `amplitudes`.
    pub amplitude_variance: Vec<f64>,
    /// Whether the SSB was received at its expected time; `false` for the first one after a search.
    pub tracked: bool,
}

impl ReceivedBeam<'_> {
    /// Computes channel and observables of the SSB. Sample positions are at the input's rate.
    pub fn tracked_ssb(&mut self) -> TrackedSsb {
        let (ssb, ratio) = (self.ssb, self.input_per_output);
        let observed = self.tracker.observe(ssb);
        let observables = observed.as_ref().map(|it| {
            let mut at_input = it.observables;
            at_input.delay.first_path_start *= ratio;
            at_input.phase.reference_start *= ratio;
            at_input
        });
        let mut channel = vec![[Complex32::ZERO; SUBCARRIERS]; ssb.noise_variance.len()];
        let channel_covariance = self.tracker.channel(ssb.residual_delay, &mut channel);
        TrackedSsb {
            pci: ssb.pci,
            ssb_index: ssb.ssb_index,
            lmax: Some(self.tracker.lmax()),
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
            observables,
            amplitudes: (observed.as_ref()).map_or_else(Vec::new, |it| it.amplitudes.to_vec()),
            amplitude_variance: observed.map_or_else(Vec::new, |it| it.amplitude_variance.to_vec()),
            tracked: self.is_followed,
        }
    }
}
