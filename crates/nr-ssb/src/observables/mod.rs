//! Observables of one SSB in addition to angles: delay of the first path, carrier phase, range rate
//! and power, with their covariance.
//!
//! | quantity | module | information |
//! |---|---|---|
//! | delay | [`delay`] | phase slope over the subcarriers; multipath from its shape and the antennas |
//! | carrier phase | [`carrier_phase`] | phase of all known elements, free of the carrier resets |
//! | range rate | [`range_rate`] | phase difference to the previous SSB, or phase slope within one SSB |
//! | power | [`power`] | amplitude of all known elements |
//!
//! Delay and carrier phase are two measurements of one quantity, the pseudorange: reception time of
//! the receiver's clock minus transmission time of the cell's clock. It contains the propagation
//! delay and both clocks. One cell cannot separate them; a common oscillator of several cells, or a
//! clock state of the user, can.
//!
//! The errors of the delay, the phase and the frequency offset of *one* SSB are independent of those
//! of other SSBs in noise. In multipath, they are correlated over a few wavelengths of travel. A
//! range rate from a phase difference shares its information with the two carrier phases: a filter
//! uses one of them.

pub mod carrier_phase;
pub mod delay;
pub(crate) mod elements;
pub(crate) mod first_path;
pub mod power;
pub mod range_rate;

use num_complex::Complex64;

use crate::dsp::received_grid::PerAntenna;

use carrier_phase::CarrierPhase;
use delay::Delay;
use power::Power;
use range_rate::RangeRate;

/// Observables of one SSB.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Observables {
    /// Delay of the first path.
    pub delay: Delay,
    /// Carrier phase of the first antenna.
    pub phase: CarrierPhase,
    /// Rate of the pseudorange.
    pub range_rate: RangeRate,
    /// Received power, and power of the first path.
    pub power: Power,
    /// Covariance of delay (s), carrier phase (rad) and the frequency offset of this SSB alone
    /// (Hz): noise and multipath.
    pub covariance: [[f64; 3]; 3],
}

/// Observables with the amplitude of every antenna.
#[derive(Debug, Clone, PartialEq)]
pub struct ArrayObservables {
    /// Observables.
    pub observables: Observables,
    /// Complex amplitude of a resource element at every antenna, with the phase of
    /// [`CarrierPhase`], in the scale of an unnormalised DFT.
    pub amplitudes: PerAntenna<Complex64>,
    /// Noise variance of every amplitude.
    pub amplitude_variance: PerAntenna<f64>,
}

impl ArrayObservables {
    /// Returns the carrier phase at the reference point of an array, for the response of every
    /// antenna to the direction of the first path, and its standard deviation, both in rad. The
    /// standard deviation includes multipath.
    pub fn phase_for_response(&self, response: &[Complex64]) -> (f64, f64) {
        let (mut sum, mut variance, mut power) = (Complex64::ZERO, 0.0, 0.0);
        for ((y, noise), weight) in self
            .amplitudes
            .iter()
            .zip(&self.amplitude_variance)
            .zip(response)
        {
            // Maximum-ratio combining with the given response.
            let scaled = weight.conj() / noise.max(f64::MIN_POSITIVE);
            sum += scaled * y;
            variance += scaled.norm_sqr() * noise;
            power += weight.norm_sqr();
        }
        // Antennas of nearly no response do not average multipath.
        let largest = response.iter().map(Complex64::norm_sqr).fold(0.0, f64::max);
        let antennas = (power / largest.max(f64::MIN_POSITIVE)).max(1.0);
        let noise = 0.5 * variance / sum.norm_sqr().max(f64::MIN_POSITIVE);
        let multipath = self.observables.phase.multipath_sigma_rad.powi(2) / antennas;
        (sum.arg(), (noise + multipath).sqrt())
    }
}
