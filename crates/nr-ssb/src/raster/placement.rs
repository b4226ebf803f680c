//! Which frequency an SSB was placed at, where that is not known beforehand.
//!
//! Cells that are to be searched for lie on the synchronization raster, others anywhere on the
//! global frequency raster (TS 38.104 §5.4.2.1): multiples of 5 kHz below 3 GHz, of 15 kHz above, of
//! 60 kHz from 24.25008 GHz on.
//! Test signals keep to neither, as one at 3500.0 MHz.
//! What is received is that frequency plus the offset of the oscillators, and inside a symbol the
//! two cannot be told apart. Between symbols they can: by TS 38.211 §5.4 symbol `l` carries
//! `exp(−j2π f_SSB t_l)`, whereas an offset turns it by `exp(+j2π Δf t_l)`. A receiver that supposes a
//! wrong frequency therefore finds the right offset between the symbols, but another one inside
//! them, just as much off as its supposition (modulo a turn per symbol, 14 kHz at 15 kHz spacing).
//!
//! So a point is as likely as these two offsets agree there, and as the offset is small:
//! oscillators are good to about a part in a million. That is what decides where points differ by
//! about a turn, as neighbours above 3 GHz do at 15 kHz spacing.

use std::f64::consts::TAU;
use std::ops::RangeInclusive;

use crate::dsp::base_rate::SYMBOL_SAMPLES;
use crate::dsp::cfo::carrier_reset_step;
use crate::numeric::phasors::wrap;
use crate::search::DetectedSsb;
use crate::standard::numerology::{FR2_FROM_HZ, SubcarrierSpacing};

/// Standard deviation of oscillators, relative to the frequency.
const OSCILLATOR: f64 = 1e-6;
/// Standard deviation of the offset seen inside the symbols at 0 dB, in subcarriers, ...
const COARSE_AT_0_DB: f64 = 0.04;
/// ... and however strong the SSB, echoes reaching over the cyclic prefix.
const COARSE_AT_BEST: f64 = 0.01;
/// What must speak against a point of the synchronization raster, against one of the global frequency
/// raster, and again against a multiple of 5 kHz, in squared standard deviations.
const RASTER_PREFERENCE: f64 = 16.0;
/// Transmitters that keep to no raster are set by people, to multiples of this, ...
const SET_BY_HAND_HZ: f64 = 5e3;
/// ... or, less likely again, of this.
const FINEST_HZ: f64 = 1e3;

/// What speaks against a frequency beforehand, in squared standard deviations: nothing if it is one of
/// TS 38.104 Table 5.4.2.1-1.
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

/// Where inside `band_hz` an SSB was placed that a search around `tuned_hz` found there, `on_raster`
/// being whether that is a point of the synchronization raster.
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
    // The phase from symbol to symbol, with the offset inside the symbols taken out.
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
    // As far as multiples of 5 kHz must go for the phases to agree with some of them, whatever the
    // offset: these and a turn per symbol, some 14 times 1 kHz at 15 kHz spacing, have little in common.
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
