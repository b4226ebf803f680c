//! Delay, range rate, carrier phase and power of an SSB by the clock of the receiver.

use nr_ssb::band::likely_case;
use nr_ssb::observables::Observables;
use nr_ssb::observables::delay::Multipath;
use nr_ssb::observables::range_rate::RateSource;
use nr_ssb::{Case, Numerology, SubcarrierSpacing};

use crate::observation::SsbRanging;

/// Duration of an SSB over which its own frequency offset is measured, in symbols.
const SSB_SYMBOLS: f64 = 4.0;

/// Converter of observables to delays relative to the first SSB.
///
/// The transmission time of a cell is known only through its SSBs. Delays are therefore relative to
/// the first SSB, after subtraction of the SSB's position in its burst, and modulo the burst
/// period. The multiple of the period is chosen so that the delay is nearest to the previous one.
pub(super) struct RangingClock {
    numerology: Numerology,
    case: Case,
    base_rate_hz: f64,
    period_s: f64,
    /// Reception time of the first SSB minus its position in the burst (s).
    origin_s: Option<f64>,
    /// Last delay (s).
    last_s: f64,
}

impl RangingClock {
    /// Creates the converter; `None` for a numerology without SSBs at the base rate.
    pub fn new(spacing: SubcarrierSpacing, ssb_freq_hz: f64, period_s: f64) -> Option<Self> {
        Some(Self {
            numerology: Numerology::new(spacing, 256).ok()?,
            case: likely_case(spacing, ssb_freq_hz),
            base_rate_hz: spacing.base_rate_hz(),
            period_s,
            origin_s: None,
            last_s: 0.0,
        })
    }

    /// Returns the ranging of an SSB with these observables; `unreported_gap_s` is the duration of
    /// missing samples before it.
    pub fn ranging(
        &mut self,
        ssb_index: u8,
        observables: &Observables,
        unreported_gap_s: f64,
    ) -> Option<SsbRanging> {
        let Observables {
            delay,
            phase,
            range_rate,
            power,
            ..
        } = observables;
        let symbol = self.case.start_symbol(ssb_index).ok()?;
        let sent_s = self.numerology.symbol_start(symbol) as f64 / self.base_rate_hz;
        let received_s = delay.first_path_start / self.base_rate_hz + unreported_gap_s - sent_s;
        let since_s = received_s - *self.origin_s.get_or_insert(received_s);
        let periods = ((since_s - self.last_s) / self.period_s).round();
        self.last_s = since_s - periods * self.period_s;
        let is_difference = range_rate.source == RateSource::PhaseDifference;
        let own_s = SSB_SYMBOLS * self.numerology.ssb_symbol_len() as f64 / self.base_rate_hz;
        Some(SsbRanging {
            delay_s: self.last_s,
            delay_sigma_s: delay.sigma_s,
            delay_noise_sigma_s: delay.noise_sigma_s,
            is_first_path_uncertain: delay.multipath == Multipath::Uncertain,
            rate_mps: range_rate.rate_m_s,
            rate_sigma_mps: range_rate.sigma_m_s,
            rate_interval_s: if is_difference {
                range_rate.interval_s
            } else {
                own_s
            },
            is_rate_of_phases: is_difference,
            phase_rad: phase.phase_rad,
            phase_sigma_rad: phase.sigma_rad,
            ss_rsrp_dbfs: power.ss_rsrp_dbfs,
            first_path_dbfs: power.first_path_dbfs,
        })
    }

    /// Removes the origin, for a stream that restarts.
    pub const fn reset(&mut self) {
        self.origin_s = None;
        self.last_s = 0.0;
    }
}
