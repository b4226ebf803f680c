//! Estimation of an unknown SSB frequency.
//!
//! The SSBs of cells that UEs search for are on the synchronization raster. Other SSBs may be at
//! any point of the global frequency raster (TS 38.104 §5.4.2.1): multiples of 5 kHz below 3 GHz,
//! of 15 kHz above 3 GHz, and of 60 kHz from 24.25008 GHz on. Test signals may be on neither
//! raster, for example at 3500.0 MHz.
//!
//! The received frequency is the SSB frequency plus the oscillator offset Δf. One symbol determines
//! only their sum. The phase steps between symbols separate them: according to TS 38.211 §5.4, the
//! transmitter multiplies symbol `l` by `exp(−j2π f_SSB t_l)`, whereas the offset adds the phase
//! `exp(+j2π Δf t_l)`. Assume that a receiver uses a wrong SSB frequency. Its offset between symbols
//! is correct. Its offset within symbols is wrong by the error of the SSB frequency, modulo the
//! symbol rate (14 kHz at 15 kHz spacing).
//!
//! The likelihood of a raster point therefore has two factors: the agreement of both offsets, and
//! the size of the offset, because oscillators are accurate to about 1 ppm. The second factor
//! decides between points that are about one symbol rate apart, such as neighbouring points above
//! 3 GHz at 15 kHz spacing.

use std::f64::consts::TAU;
use std::ops::RangeInclusive;

use crate::dsp::base_rate::SYMBOL_SAMPLES;
use crate::dsp::cfo::carrier_reset_step;
use crate::numeric::phasors::wrap;
use crate::search::DetectedSsb;
use crate::standard::numerology::{FR2_FROM_HZ, SubcarrierSpacing};

/// Relative standard deviation of oscillator frequencies.
const OSCILLATOR: f64 = 1e-6;
/// Standard deviation of the offset estimated within symbols at an SNR of 0 dB, in subcarriers.
const COARSE_AT_0_DB: f64 = 0.04;
/// Minimum standard deviation of the offset estimated within symbols (high SNR), in subcarriers. Its
/// cause is echoes beyond the cyclic prefix.
const COARSE_AT_BEST: f64 = 0.01;
/// Prior penalty in squared standard deviations. It applies once to a frequency off the
/// synchronization raster, once off the global frequency raster, and once if the frequency is not a
/// multiple of 5 kHz.
const RASTER_PREFERENCE: f64 = 16.0;
/// Frequencies of transmitters off the rasters are usually multiples of this frequency.
const SET_BY_HAND_HZ: f64 = 5e3;
/// Spacing of all searched frequencies, in Hz. Few transmitters off the rasters need it.
const FINEST_HZ: f64 = 1e3;

/// Returns the prior penalty of a frequency in squared standard deviations: zero on the global
/// frequency raster (TS 38.104 Table 5.4.2.1-1).
fn oddness(frequency_hz: f64) -> f64 {
    let is_whole = |units: f64| (units - units.round()).abs() < 1e-3;
    let on_global_raster = is_whole(match frequency_hz {
        ..3e9 => frequency_hz / 5e3,
        ..FR2_FROM_HZ => frequency_hz / 15e3,
        _ => (frequency_hz - 24.25008e9) / 60e3,
    });
    match frequency_hz {
        _ if on_global_raster => 0.0,
        _ if is_whole(frequency_hz / SET_BY_HAND_HZ) => RASTER_PREFERENCE,
        _ => 2.0 * RASTER_PREFERENCE,
    }
}

/// Returns the most likely frequency, within `band_hz`, of an SSB that a search at `tuned_hz` has
/// detected. `on_raster`: whether `tuned_hz` is a point of the synchronization raster.
pub(crate) fn placed_at(
    tuned_hz: f64,
    on_raster: bool,
    ssb: &DetectedSsb,
    spacing: SubcarrierSpacing,
    band_hz: RangeInclusive<f64>,
) -> f64 {
    let received_hz = tuned_hz + ssb.coarse_cfo_hz;
    let symbol_s = SYMBOL_SAMPLES as f64 / spacing.base_rate_hz();
    let strength = 10f64.powf(-0.05 * ssb.snr_db);
    let coarse_hz = spacing.hz() * (COARSE_AT_0_DB * strength).max(COARSE_AT_BEST);
    // Phase step between symbols, minus the part caused by the offset within symbols.
    let step = ssb.symbol_phase_step_rad + TAU * symbol_s * (ssb.cfo_hz - ssb.coarse_cfo_hz);
    let cost = |frequency_hz: f64| {
        let carrier_step = carrier_reset_step(frequency_hz, spacing.base_rate_hz());
        let disagreement_hz = wrap(step - carrier_step) / (TAU * symbol_s);
        let offset_hz = received_hz + disagreement_hz - frequency_hz;
        (disagreement_hz / coarse_hz).powi(2)
            + (offset_hz / (OSCILLATOR * frequency_hz)).powi(2)
            + oddness(frequency_hz)
    };
    let nearest = (received_hz / FINEST_HZ).round();
    // Half-width of the search in kHz: 2.5 subcarriers. The phase step per symbol determines the
    // frequency up to multiples of the symbol rate (about 14 kHz at 15 kHz spacing). The range spans
    // five symbol rates. Therefore it contains a multiple of 5 kHz whose phases agree, for any
    // offset.
    let reach = (2.5e-3 * spacing.hz()).floor();
    let best = (0..=2 * reach as usize)
        .map(|i| (nearest - reach + i as f64) * FINEST_HZ)
        .filter(|hz| band_hz.contains(hz))
        .min_by(|a, b| cost(*a).total_cmp(&cost(*b)));
    match best {
        Some(best) if !on_raster || cost(best) + RASTER_PREFERENCE < cost(tuned_hz) => best,
        _ => tuned_hz,
    }
}
