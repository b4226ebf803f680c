//! Observables of a tracked SSB, from the tracker's received elements.

use super::output::TrackerOutput;
use crate::dsp::alignment::Alignment;
use crate::dsp::base_rate::SYMBOL_FFT;
use crate::observables::carrier_phase::{CarrierPhase, CarrierResets, rotation};
use crate::observables::delay::{Delay, Multipath};
use crate::observables::elements::{Elements, offset_by_sync};
use crate::observables::first_path::FirstPath;
use crate::observables::power::Power;
use crate::observables::range_rate::{Instant, RateTracker};
use crate::observables::{ArrayObservables, Observables};
use crate::one_ssb::acquire::Acquirer;
use crate::standard::numerology::SubcarrierSpacing;

/// Number of known elements of a symbol without PSS, SSS and PBCH.
const DMRS_ONLY: u16 = 60;

/// Observables of one beam.
pub(super) struct Observer {
    base_rate_hz: f64,
    resets: CarrierResets,
    first_path: FirstPath,
    rate: RateTracker,
}

impl Observer {
    pub(super) fn new(spacing: SubcarrierSpacing, carrier_hz: f64) -> Self {
        Self {
            base_rate_hz: spacing.base_rate_hz(),
            resets: CarrierResets::new(spacing, carrier_hz),
            first_path: FirstPath::new(),
            rate: RateTracker::new(carrier_hz),
        }
    }

    /// Starts a new sequence of carrier phases.
    pub(super) fn forget(&mut self) {
        self.rate.forget();
    }

    /// Computes the observables of an SSB with its demodulation in a window.
    pub(super) fn observe(
        &mut self,
        ssb: &TrackerOutput,
        acquirer: &Acquirer,
        demodulation: &Alignment,
        window_start: f64,
    ) -> ArrayObservables {
        let elements = Elements::new(
            &ssb.blocks,
            &ssb.noise_variance,
            &acquirer.reference,
            demodulation.phase_step,
        );
        let mut covariance = elements.covariance;

        // Separate the first path from the others.
        let single_variance = covariance[0][0];
        let posterior = self.first_path.follow(
            &acquirer.estimate.rows,
            &ssb.noise_variance,
            ssb.pilots[1] > DMRS_ONLY,
            ssb.residual_delay,
            single_variance,
            self.base_rate_hz,
        );
        let offset = posterior.delay - ssb.residual_delay;
        let delay_variance = single_variance + posterior.multipath_variance;
        let delay = Delay {
            first_path_start: ssb.sample_start + offset,
            offset_s: offset / self.base_rate_hz,
            sigma_s: delay_variance.sqrt() / self.base_rate_hz,
            noise_sigma_s: single_variance.sqrt() / self.base_rate_hz,
            multipath: match (posterior.is_multipath, posterior.is_weak) {
                (_, true) => Multipath::Uncertain,
                (true, false) => Multipath::Separated,
                (false, false) => Multipath::NotDetected,
            },
        };

        // Refer the phase to the centre of the known elements, and remove the carrier resets.
        let turn =
            rotation(demodulation.cfo_cycles, elements.centre) * self.resets.removal(ssb.ssb_index);
        let mut amplitudes = elements.amplitudes;
        amplitudes.iter_mut().for_each(|it| *it *= turn);
        let antennas = amplitudes.len() as f64;
        let reference_start = window_start + demodulation.start as f64 + elements.centre;
        // The quadrature component of the other paths.
        let phase_multipath = 0.5 * posterior.diffuse;
        let first = amplitudes.first().copied().unwrap_or_default();
        let first_variance = elements.variance.first().copied().unwrap_or(0.0);
        let first_noise = 0.5 * first_variance / first.norm_sqr().max(f64::MIN_POSITIVE);
        let phase = CarrierPhase {
            phase_rad: first.arg(),
            sigma_rad: (first_noise + phase_multipath).sqrt(),
            multipath_sigma_rad: phase_multipath.sqrt(),
            reference_start,
        };

        // A channel that varies over the subcarriers turns symbols with different known elements.
        let mut excess = elements.excess_cycles;
        if posterior.is_multipath {
            (excess, covariance[2][2]) = offset_by_sync(
                &acquirer.grids,
                &acquirer.reference,
                &ssb.noise_variance,
                ssb.residual_delay,
                demodulation.phase_step,
                elements.snr,
            );
        }
        let frequency_hz = (demodulation.cfo_cycles + excess) * self.base_rate_hz;
        let frequency_variance = covariance[2][2] * self.base_rate_hz * self.base_rate_hz;
        let range_rate = self.rate.follow(Instant {
            time_s: reference_start / self.base_rate_hz,
            amplitudes: amplitudes.clone(),
            variance: elements.variance.clone(),
            multipath: phase_multipath,
            frequency_hz,
            frequency_variance,
        });

        let full_scale = (SYMBOL_FFT * SYMBOL_FFT) as f64;
        let level: f64 = amplitudes
            .iter()
            .zip(&elements.variance)
            .map(|(h, noise)| (h.norm_sqr() - noise).max(0.0))
            .sum();
        let known: u16 = ssb.pilots.iter().sum();
        let power = Power::new(
            level / antennas / full_scale,
            elements.snr,
            known.into(),
            posterior.share,
            posterior.share_sigma,
        );

        // Convert to seconds, rad and Hz, and add multipath.
        let unit = [1.0 / self.base_rate_hz, 1.0, self.base_rate_hz];
        for (row, a) in covariance.iter_mut().zip(unit) {
            for (value, b) in row.iter_mut().zip(unit) {
                *value *= a * b;
            }
        }
        covariance[0][0] = delay.sigma_s * delay.sigma_s;
        covariance[1][1] = phase.sigma_rad * phase.sigma_rad;
        covariance[2][2] += self.rate.multipath_variance(phase_multipath) / antennas;
        ArrayObservables {
            observables: Observables {
                delay,
                phase,
                range_rate,
                power,
                covariance,
            },
            amplitudes,
            amplitude_variance: elements.variance,
        }
    }
}
