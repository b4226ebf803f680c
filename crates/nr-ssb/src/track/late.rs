//! Delay of an SSB before its beam is known: from PSS and SSS, whose 127 subcarriers are added in
//! groups.

use num_complex::Complex32;

use crate::dsp::base_rate::SYMBOL_FFT;
use crate::numeric::phasors::fill_phasors;
use crate::numeric::sums::{complex_product, energy};
use crate::standard::grid::pss_indices;
use crate::standard::sequence::pss::SYNC_LEN;

/// Maximum delay on either side after one demodulation, in samples: while the FFT window is within
/// the cyclic prefix.
pub(super) const REACH: usize = 6;
/// Number of delays in the search, one sample apart.
const DELAYS: usize = 2 * REACH + 1;
/// Subcarriers of a group: the maximum delay changes the phase within it by 1.2 rad, a loss of 0.5
/// dB.
const GROUP: usize = 8;
const GROUPS: usize = SYNC_LEN.div_ceil(GROUP);

/// Number of independent delays of the search: the correlation length of the PSS is two samples.
pub(super) const INDEPENDENT: f64 = DELAYS as f64 / 2.0;

/// Sums over the groups for one antenna.
pub(super) type Groups = [Complex32; GROUPS];

/// Delay search.
pub(super) struct DelaySearch {
    /// `exp(j2πk'τ/256)` at the centres of the groups, for each delay.
    steering: [Groups; DELAYS],
}

impl DelaySearch {
    pub(super) fn new() -> Self {
        let delay = |step: usize| step as f64 - REACH as f64;
        Self {
            steering: std::array::from_fn(|step| ramp(delay(step))),
        }
    }

    /// Returns the delay in samples that maximises Σ |Σ z exp(j2πk'τ/256)|² over the antennas.
    pub(super) fn run(&self, antennas: &[Groups]) -> f64 {
        let power = |step: usize| -> f32 {
            let products = antennas
                .iter()
                .map(|z| complex_product(z, &self.steering[step]));
            products.map(|sum| sum.norm_sqr()).sum()
        };
        // At the expected delay, the value usually exceeds half of the possible maximum, so that no
        // other delay can be larger.
        let most = GROUPS as f32 * antennas.iter().map(energy).sum::<f32>();
        let near = [power(REACH - 1), power(REACH), power(REACH + 1)];
        if near[1] > 0.5 * most && near[1] > near[0].max(near[2]) {
            return parabola(near);
        }
        let powers: [f32; DELAYS] = std::array::from_fn(power);
        let best = powers.iter().zip(0..).max_by(|a, b| a.0.total_cmp(b.0));
        let best = best.map_or(REACH, |(_, step)| step);
        let around = best.checked_sub(1).and_then(|it| powers.get(it..it + 3));
        let offset = around
            .and_then(<[f32]>::first_chunk::<3>)
            .map_or(0.0, |it| parabola(*it));
        best as f64 - REACH as f64 + offset
    }
}

/// Returns the position of the maximum of a parabola through three values one apart, relative to
/// the middle one.
fn parabola([before, here, after]: [f32; 3]) -> f64 {
    let bend = 2.0 * here - before - after;
    let offset = 0.5 * (after - before) / bend.max(f32::MIN_POSITIVE);
    f64::from(offset.clamp(-0.5, 0.5))
}

/// Returns `exp(j2πk'τ/256)` at the centres of the groups, which removes a delay of τ samples.
pub(super) fn ramp(delay: f64) -> Groups {
    let mut ramp = [Complex32::ZERO; GROUPS];
    let cycles = delay / SYMBOL_FFT as f64;
    let centre = pss_indices().start as f64 + 0.5 * (GROUP - 1) as f64 - 120.0;
    fill_phasors(&mut ramp, centre * cycles, GROUP as f64 * cycles);
    ramp
}

/// Returns the received elements times the transmitted chips, summed over the groups.
pub(super) fn grouped(received: &[Complex32; SYNC_LEN], chips: &[f32; SYNC_LEN]) -> Groups {
    let mut groups = [Complex32::ZERO; GROUPS];
    let (received, received_rest) = received.as_chunks::<GROUP>();
    let (chips, chips_rest) = chips.as_chunks::<GROUP>();
    let whole = groups.iter_mut().zip(received.iter().zip(chips));
    for (sum, (received, chips)) in whole {
        *sum = received.iter().zip(chips).map(|(y, chip)| y * chip).sum();
    }
    let rest = received_rest.iter().zip(chips_rest);
    groups[GROUPS - 1] = rest.map(|(y, chip)| y * chip).sum();
    groups
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    #[test]
    fn a_delay_within_the_search_range_is_estimated_to_a_tenth_of_a_sample() {
        let search = DelaySearch::new();
        for step in -55..=55 {
            let truth = 0.1 * f64::from(step);
            let sequence: [Complex32; SYNC_LEN] = std::array::from_fn(|n| {
                let k = (pss_indices().start + n) as f64 - 120.0;
                let turn = -TAU * k * truth / SYMBOL_FFT as f64;
                Complex32::new(turn.cos() as f32, turn.sin() as f32)
            });
            let groups = grouped(&sequence, &[1.0; SYNC_LEN]);
            let delay = search.run(&[groups, groups.map(|z| z * Complex32::I)]);
            assert!((delay - truth).abs() < 0.1, "{truth}: {delay}");
            let loss = complex_product(&groups, &ramp(delay)).norm() / SYNC_LEN as f32;
            assert!(loss > 0.93, "{truth}: {loss}");
        }
    }
}
