//! Carrier phase of one SSB, referenced to the time of the SSB and continuous across gaps.
//!
//! The transmitter resets its carrier phase at every symbol (TS 38.211 §5.4), so that the useful
//! part of every symbol begins with carrier phase zero. A receiver's mixer is continuous and counts
//! `f·T` cycles until the reception time `T`. The received phase of the symbol transmitted at `t` in
//! its subframe is `−2πf(T − t) − 2πft`, modulo 2π. The last term is known and is removed for every
//! symbol. The result is `−2πf` times the pseudorange in seconds at
//! [`reference_start`](CarrierPhase::reference_start), modulo 2π. It can be subtracted from that of
//! any other SSB of the beam, across any gap, if the frequency is an integer number of kilohertz and
//! the mixer has not been retuned or restarted in between.
//!
//! The phase is that of the information-weighted centre of the known elements, where its error is
//! independent of that of the frequency offset. The bound in noise is `1/√(2 N SNR)`.

use std::f64::consts::TAU;

use crate::standard::band::likely_case;
use crate::standard::numerology::{Case, Numerology, SubcarrierSpacing};
use crate::transmit::ofdm::symbol_phase;

use num_complex::Complex64;

/// Carrier phase of the first antenna.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CarrierPhase {
    /// Phase in rad, within ±π: −2π times the pseudorange in wavelengths, plus a constant of the
    /// oscillators.
    pub phase_rad: f64,
    /// Standard deviation in rad: noise and multipath. The phase of an array that combines its
    /// antennas, [`ArrayObservables::phase_for_response`](super::ArrayObservables::phase_for_response), is more precise.
    pub sigma_rad: f64,
    /// Standard deviation due to multipath at one antenna, in rad.
    pub multipath_sigma_rad: f64,
    /// Time to which phase and frequency offset refer, in samples, relative to the first sample of
    /// the stream: at the base rate from a tracker, at the input's rate from a receiver.
    pub reference_start: f64,
}

/// Factors that remove the carrier phase resets of the transmitter.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CarrierResets {
    case: Case,
    numerology: Option<Numerology>,
    ssb_freq_hz: f64,
}

impl CarrierResets {
    /// Creates the removal for an SSB frequency. The pattern in time is that of the first band that
    /// contains the frequency; a wrong one of the two patterns at 30 kHz adds a constant to the phase
    /// of every beam.
    pub(crate) fn new(spacing: SubcarrierSpacing, ssb_freq_hz: f64) -> Self {
        Self {
            case: likely_case(spacing, ssb_freq_hz),
            numerology: Numerology::new(spacing, 256).ok(),
            ssb_freq_hz,
        }
    }

    /// Returns the factor that removes the phase of the first symbol of an SSB.
    pub(crate) fn removal(&self, ssb_index: u8) -> Complex64 {
        let symbol = self.case.start_symbol(ssb_index).ok();
        let phase = self
            .numerology
            .zip(symbol)
            .map(|(numerology, symbol)| symbol_phase(numerology, symbol, self.ssb_freq_hz).conj());
        phase.map_or(Complex64::ONE, |it| {
            let it = Complex64::new(f64::from(it.re), f64::from(it.im));
            it / it.norm()
        })
    }
}

/// Returns the rotation of a frequency offset during a time in samples.
pub(crate) fn rotation(cfo_cycles: f64, samples: f64) -> Complex64 {
    Complex64::cis(TAU * (cfo_cycles * samples).fract())
}
