//! Observables of an SSB in addition to its angle.

use nr_ssb::receiver::TrackedSsb;
use num_complex::Complex64;
use pyo3::prelude::*;

use super::channel::Values;

/// Delay, carrier phase, range rate and power of one SSB.
///
/// Delay and carrier phase measure the pseudorange: reception time of the receiver's clock minus
/// transmission time of the cell's clock. It contains the distance and both clocks, which one cell
/// cannot separate. Standard deviations include noise and multipath.
///
/// Attributes
/// ----------
/// first_path_start : float
///     First sample of the SSB, including its cyclic prefix, on the first path, at the rate of the
///     input.
/// delay_offset_s : float
///     Delay of the first path relative to `Cell.sample_start`, the start according to all paths, in
///     seconds.
/// delay_sigma_s, delay_noise_sigma_s : float
///     Standard deviation of `first_path_start` in seconds, and its part due to noise.
/// multipath : str
///     `not detected`, `separated`, or `uncertain`: the first path may be weaker than the others or
///     blocked.
/// carrier_phase_rad, carrier_phase_sigma_rad : float
///     Carrier phase of antenna 0 at `reference_start` in rad, and its standard deviation: minus 2 pi
///     times the pseudorange in wavelengths, plus a constant of the oscillators. The phase resets of
///     TS 38.211, 5.4, are removed. Phases of one beam can be subtracted across gaps of a stream.
/// carrier_phase_multipath_sigma_rad : float
///     Standard deviation of the phase of one antenna due to multipath, in rad.
/// reference_start : float
///     Sample to which phase, amplitudes and frequency refer, at the rate of the input.
/// frequency_hz, frequency_sigma_hz : float
///     Carrier frequency offset from `rate_source` in Hz, and its standard deviation.
/// range_rate_m_s, range_rate_sigma_m_s : float
///     Rate of the pseudorange in m/s, including the frequency offset of both oscillators, and its
///     standard deviation.
/// rate_source : str
///     `phase difference` for the mean rate since the previous SSB, or `within SSB` if the number of
///     cycles since the previous SSB is ambiguous.
/// interval_s : float
///     Time since the previous SSB of the beam in seconds; 0 without one.
/// phase_change_rad, phase_change_sigma_rad : float
///     Carrier phase minus that of the previous SSB within pi, in rad, and its standard deviation,
///     which is infinite without a previous SSB.
/// ambiguity_m_s : float
///     Change of the range rate for one cycle of `phase_change_rad`, in m/s.
/// wrong_cycles_probability : float
///     Probability of a wrong number of cycles in a rate from a phase difference.
/// rsrp_dbfs, rsrp_sigma_db : float
///     Power of a resource element of all paths, mean over the antennas, in dBFS, and its standard
///     deviation in dB.
/// first_path_dbfs, first_path_sigma_db : float
///     Power of a resource element of the first path in dBFS, and its standard deviation in dB.
/// amplitudes : ndarray
///     complex128, `(antennas,)`: amplitude of a resource element of every antenna with the phase of
///     `carrier_phase_rad`, in the scale of `Cell.channel`.
/// amplitude_variance : ndarray
///     float64, `(antennas,)`: noise variance of `amplitudes`.
/// covariance : ndarray
///     float64, `(3, 3)`: covariance of delay (s), carrier phase (rad) and the frequency offset
///     within this SSB (Hz).
#[derive(Clone)]
#[pyclass(frozen, get_all, module = "access_av._core.nr")]
pub struct Observables {
    first_path_start: f64,
    delay_offset_s: f64,
    delay_sigma_s: f64,
    delay_noise_sigma_s: f64,
    multipath: &'static str,
    carrier_phase_rad: f64,
    carrier_phase_sigma_rad: f64,
    carrier_phase_multipath_sigma_rad: f64,
    reference_start: f64,
    frequency_hz: f64,
    frequency_sigma_hz: f64,
    range_rate_m_s: f64,
    range_rate_sigma_m_s: f64,
    rate_source: &'static str,
    interval_s: f64,
    phase_change_rad: f64,
    phase_change_sigma_rad: f64,
    ambiguity_m_s: f64,
    wrong_cycles_probability: f64,
    rsrp_dbfs: f64,
    rsrp_sigma_db: f64,
    first_path_dbfs: f64,
    first_path_sigma_db: f64,
    amplitudes: Values<Complex64>,
    amplitude_variance: Values<f64>,
    covariance: Values<f64>,
}

impl Observables {
    /// Returns the observables of a received SSB, if its carrier frequency is known.
    pub fn of(ssb: &TrackedSsb) -> Option<Self> {
        let seen = ssb.observables?;
        Some(Self {
            first_path_start: seen.delay.first_path_start,
            delay_offset_s: seen.delay.offset_s,
            delay_sigma_s: seen.delay.sigma_s,
            delay_noise_sigma_s: seen.delay.noise_sigma_s,
            multipath: seen.delay.multipath.name(),
            carrier_phase_rad: seen.phase.phase_rad,
            carrier_phase_sigma_rad: seen.phase.sigma_rad,
            carrier_phase_multipath_sigma_rad: seen.phase.multipath_sigma_rad,
            reference_start: seen.phase.reference_start,
            frequency_hz: seen.range_rate.frequency_hz,
            frequency_sigma_hz: seen.range_rate.sigma_hz,
            range_rate_m_s: seen.range_rate.rate_m_s,
            range_rate_sigma_m_s: seen.range_rate.sigma_m_s,
            rate_source: seen.range_rate.source.name(),
            interval_s: seen.range_rate.interval_s,
            phase_change_rad: seen.range_rate.phase_change_rad,
            phase_change_sigma_rad: seen.range_rate.phase_change_sigma_rad,
            ambiguity_m_s: seen.range_rate.ambiguity_m_s,
            wrong_cycles_probability: seen.range_rate.wrong_cycles_probability,
            rsrp_dbfs: seen.power.ss_rsrp_dbfs,
            rsrp_sigma_db: seen.power.ss_rsrp_sigma_db,
            first_path_dbfs: seen.power.first_path_dbfs,
            first_path_sigma_db: seen.power.first_path_sigma_db,
            amplitudes: Values::new(ssb.amplitudes.clone(), &[ssb.amplitudes.len()]),
            amplitude_variance: Values::new(
                ssb.amplitude_variance.clone(),
                &[ssb.amplitude_variance.len()],
            ),
            covariance: Values::new(seen.covariance.into_iter().flatten(), &[3, 3]),
        })
    }
}

#[pymethods]
impl Observables {
    fn __repr__(&self) -> String {
        format!(
            "Observables(first_path_start={:.3}, delay_sigma_s={:.1e}, multipath='{}', \
             range_rate_m_s={:.3}, rate_source='{}')",
            self.first_path_start,
            self.delay_sigma_s,
            self.multipath,
            self.range_rate_m_s,
            self.rate_source,
        )
    }
}
