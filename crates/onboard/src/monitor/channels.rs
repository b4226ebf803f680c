//! Monitor of the receive channels, by the power of each channel and by the fit of the array
//! response to the received signal.
//!
//! The best steering vector explains a fraction of the received power. Exchanged or inverted
//! channels leave a larger residual than the corrected channels. Cumulative sums (Page 1954) over
//! SSBs compare the residual with that of each hypothesis: one pair of channels exchanged, or one
//! channel inverted. The scatter of each radio head is measured as the residual of the best
//! hypothesis, which a fault does not increase. A dead channel has a small fraction of the power.
//!
//! Only SSBs with independent fading count: of another radio head, or after a motion of
//! [`FADING_M`].

use std::f64::consts::TAU;

use num_complex::Complex64;

use super::fault::Fault;
use crate::observation::{MAX_ELEMENTS, SsbObservation};
use crate::settings::{Site, Vehicle};

/// Motion after which the fading of a radio head is independent (m). It exceeds one wavelength.
const FADING_M: f64 = 0.1;
/// Time after which the fading of a radio head is independent (s).
const FADING_S: f64 = 1.0;
/// Minimum SNR of an SSB with all its snapshots, in dB.
const MIN_SNR_DB: f64 = 10.0;
/// Number of steering vectors to which the signal is fitted. Between two of them, the loss of power
/// is at most 0.3 % with 4 antennas.
const DIRECTIONS: usize = 64;
/// Maximum number of antennas for which hypotheses are compared; 8 antennas have 36 hypotheses.
const MAX_ANTENNAS: usize = 8;
/// Maximum number of hypotheses.
const MAX_HYPOTHESES: usize = MAX_ANTENNAS * (MAX_ANTENNAS - 1) / 2 + MAX_ANTENNAS;
/// Fraction of the power in the residual due to calibration errors, in addition to that of the
/// site's scatter.
const CALIBRATION: f64 = 0.02;
/// Weight of the newest SSB in the measured scatter of a radio head: a memory of 32 SSBs with
/// independent fading, at least 3 m of motion.
const SCATTER_WEIGHT: f64 = 1.0 / 32.0;
/// Maximum evidence of one SSB for or against a hypothesis, in units of log-likelihood.
const MAX_EVIDENCE_PER_SSB: f64 = 4.0;
/// Drift of the sums per SSB, so that hypotheses with the same fit as the nominal channels gain no
/// evidence.
const DRIFT: f64 = 0.3;
/// Threshold of the sums: false-alarm rate 1e-6 for each excursion from zero (Wald).
const EVIDENCE: f64 = 13.8;
/// Drift of the sum for a dead channel. Each SSB adds `ln(1/share)`, which has an exponential
/// distribution in Rayleigh fading. The false-alarm rate is exp(−0.8 · threshold) for each
/// excursion from zero.
const DEAD_DRIFT: f64 = 2.0;
const DEAD_EVIDENCE: f64 = 18.0;
/// Maximum evidence of one SSB for a dead channel, so that at least five SSBs are needed.
const DEAD_MOST: f64 = 4.0;

/// Fault of the channels: a transformation of the received signals.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Hypothesis {
    Exchanged(u8, u8),
    Inverted(u8),
}

impl Hypothesis {
    const fn fault(self) -> Fault {
        match self {
            Self::Exchanged(first, second) => Fault::ExchangedChannels {
                channels: [first, second],
            },
            Self::Inverted(channel) => Fault::InvertedChannel { channel },
        }
    }

    /// Whether a linear array distinguishes the fault from the nominal channels and from a fault
    /// with lower channel numbers. Inverting every second channel is equivalent to a change of the
    /// electrical angle by π, and reversing the row to a change of its sign. In short rows, a fault
    /// combined with one of these changes equals another single fault.
    const fn is_distinct(self, elements: u8) -> bool {
        match (self, elements) {
            (Self::Inverted(channel), 3) => channel == 0,
            (Self::Inverted(channel), 4) => channel < 2,
            (Self::Exchanged(first, second), 3..=5) => {
                first + second != elements - 1 || (first == 0 && elements > 3)
            }
            _ => true,
        }
    }

    /// Corrects a snapshot for the fault.
    fn correct(self, snapshot: &mut [Complex64]) {
        match self {
            Self::Exchanged(first, second) => snapshot.swap(first.into(), second.into()),
            Self::Inverted(channel) => {
                if let Some(value) = snapshot.get_mut(usize::from(channel)) {
                    *value = -*value;
                }
            }
        }
    }
}

/// Last SSB of a radio head that was used.
#[derive(Debug, Clone, Copy)]
struct Counted {
    pci: u16,
    ssb_index: u8,
    time_s: f64,
    distance_m: f64,
    /// Measured fraction of the power in the residual of the best hypothesis.
    scatter: f64,
}

/// Monitor of an array's channels.
#[derive(Debug)]
pub struct ChannelMonitor {
    elements: usize,
    gains: [Complex64; MAX_ELEMENTS],
    /// Expected fraction of the power in the residual of one direction at the site.
    scatter: f64,
    /// Phase factors between neighbouring antennas for each direction; empty for a non-linear
    /// array.
    steps: Vec<Complex64>,
    hypotheses: Vec<(Hypothesis, f64)>,
    /// Evidence that each channel is dead.
    dead: [f64; MAX_ELEMENTS],
    is_dead: [bool; MAX_ELEMENTS],
    /// Accepted fault hypothesis, with the evidence that the fault has ended.
    accepted: Option<(Hypothesis, f64)>,
    counted: Vec<Counted>,
}

impl ChannelMonitor {
    /// Creates the monitor for the array of a vehicle at a site with this number of radio heads.
    pub fn new(site: &Site, vehicle: &Vehicle, heads: usize) -> Self {
        let elements = usize::from(vehicle.array.elements);
        let mut gains = [Complex64::ONE; MAX_ELEMENTS];
        for (gain, known) in gains.iter_mut().zip(vehicle.array.calibration()) {
            *gain = known;
        }
        let is_compared = vehicle.array.shape.is_row() && (3..=MAX_ANTENNAS).contains(&elements);
        let mut hypotheses = Vec::with_capacity(MAX_HYPOTHESES);
        let mut steps = Vec::new();
        if is_compared {
            let channels = 0..vehicle.array.elements;
            for first in channels.clone() {
                let inverted = Hypothesis::Inverted(first);
                if inverted.is_distinct(vehicle.array.elements) {
                    hypotheses.push((inverted, 0.0));
                }
                for second in channels.clone().skip(usize::from(first) + 1) {
                    let exchanged = Hypothesis::Exchanged(first, second);
                    if exchanged.is_distinct(vehicle.array.elements) {
                        hypotheses.push((exchanged, 0.0));
                    }
                }
            }
            let turn = |number: usize| TAU * number as f64 / DIRECTIONS as f64;
            steps.extend((0..DIRECTIONS).map(|number| Complex64::cis(-turn(number))));
        }
        Self {
            elements,
            gains,
            scatter: CALIBRATION + 1.0 / (1.0 + 10f64.powf(0.1 * site.rician_k_db)),
            steps,
            hypotheses,
            dead: [0.0; MAX_ELEMENTS],
            is_dead: [false; MAX_ELEMENTS],
            accepted: None,
            counted: Vec::with_capacity(heads),
        }
    }

    /// Processes an SSB that was received at the driven distance `distance_m`. Calls `change` for
    /// each fault that begins or ends.
    pub fn ssb(
        &mut self,
        observation: &SsbObservation,
        distance_m: f64,
        change: &mut dyn FnMut(Fault, bool),
    ) {
        let values = observation.values();
        let (elements, count) = (self.elements, observation.count());
        if observation.elements() != elements || count == 0 {
            return;
        }
        let total: f64 = values.iter().map(Complex64::norm_sqr).sum();
        let noise = (observation.noise_variance).map(|it| it * (elements * count) as f64);
        let snr_db = noise.map_or(observation.ssb.snr_db, |noise| {
            10.0 * (total / noise).log10()
        });
        if !(total.is_finite() && snr_db >= MIN_SNR_DB) {
            return;
        }
        let Some(place) = self.independent(observation, distance_m) else {
            return;
        };
        self.power(values, total, change);
        if !self.steps.is_empty() && !self.is_dead.contains(&true) {
            self.fit(place, values, total, change);
        }
    }

    /// Returns the index of an SSB's radio head; `None` if the fading is not independent of that of
    /// its previous SSBs.
    fn independent(&mut self, observation: &SsbObservation, distance_m: f64) -> Option<usize> {
        let ssb = observation.ssb;
        let is_same = |it: &Counted| (it.pci, it.ssb_index) == (ssb.pci, ssb.ssb_index);
        let Some(place) = self.counted.iter().position(is_same) else {
            if self.counted.len() == self.counted.capacity() {
                return None;
            }
            self.counted.push(Counted {
                pci: ssb.pci,
                ssb_index: ssb.ssb_index,
                time_s: ssb.time_s,
                distance_m,
                scatter: self.scatter,
            });
            return Some(self.counted.len() - 1);
        };
        let last = self.counted.get_mut(place)?;
        let moved_m = (distance_m - last.distance_m).abs();
        let passed_s = (ssb.time_s - last.time_s).abs();
        let is_independent = moved_m >= FADING_M || passed_s >= FADING_S;
        if is_independent {
            (last.time_s, last.distance_m) = (ssb.time_s, distance_m);
        }
        is_independent.then_some(place)
    }

    /// Compares the power of each channel with the mean of the others.
    fn power(&mut self, values: &[Complex64], total: f64, change: &mut dyn FnMut(Fault, bool)) {
        let others = (self.elements - 1).max(1) as f64;
        for channel in 0..self.elements {
            let of_channel = values.iter().skip(channel).step_by(self.elements);
            let power: f64 = of_channel.map(Complex64::norm_sqr).sum();
            let share = power * others / (total - power).max(f64::MIN_POSITIVE);
            let (Some(evidence), Some(is_dead)) =
                (self.dead.get_mut(channel), self.is_dead.get_mut(channel))
            else {
                continue;
            };
            let one = (-share.max(1e-12).ln() - DEAD_DRIFT).clamp(-DEAD_MOST, DEAD_MOST);
            *evidence = (*evidence + one).clamp(0.0, DEAD_EVIDENCE + DEAD_MOST);
            let now_dead = if *is_dead {
                *evidence > 0.0
            } else {
                *evidence >= DEAD_EVIDENCE
            };
            if now_dead != *is_dead {
                *is_dead = now_dead;
                let channel = channel as u8;
                change(Fault::DeadChannel { channel }, now_dead);
            }
        }
    }

    /// Compares the fit of the array response with the fit after the correction of each hypothesis,
    /// for an SSB of the radio head `place`.
    fn fit(
        &mut self,
        place: usize,
        values: &[Complex64],
        total: f64,
        change: &mut dyn FnMut(Fault, bool),
    ) {
        let measured = self.counted.get(place).map_or(0.0, |it| it.scatter);
        let scatter = self.scatter.max(measured);
        let nominal = self.residual(values, total, None);
        let mut least = nominal;
        if let Some((hypothesis, evidence)) = self.accepted {
            let corrected = self.residual(values, total, Some(hypothesis));
            least = least.min(corrected);
            let evidence = cumulated(evidence, (corrected - nominal) / scatter);
            self.accepted = Some((hypothesis, evidence));
            if evidence >= EVIDENCE {
                self.accepted = None;
                change(hypothesis.fault(), false);
            }
        } else {
            let mut best: Option<(Hypothesis, f64)> = None;
            for number in 0..self.hypotheses.len() {
                let Some(&(hypothesis, evidence)) = self.hypotheses.get(number) else {
                    continue;
                };
                let corrected = self.residual(values, total, Some(hypothesis));
                least = least.min(corrected);
                let evidence = cumulated(evidence, (nominal - corrected) / scatter);
                if let Some((_, slot)) = self.hypotheses.get_mut(number) {
                    *slot = evidence;
                }
                if best.is_none_or(|(_, most)| evidence > most) {
                    best = Some((hypothesis, evidence));
                }
            }
            if let Some((hypothesis, _)) = best.filter(|(_, evidence)| *evidence >= EVIDENCE) {
                self.accepted = Some((hypothesis, 0.0));
                self.hypotheses
                    .iter_mut()
                    .for_each(|(_, evidence)| *evidence = 0.0);
                change(hypothesis.fault(), true);
            }
        }
        if let Some(head) = self.counted.get_mut(place) {
            head.scatter += SCATTER_WEIGHT * (least - head.scatter);
        }
    }

    /// Returns the fraction of the power that the best direction does not explain, after the
    /// correction of a hypothesis.
    fn residual(&self, values: &[Complex64], total: f64, hypothesis: Option<Hypothesis>) -> f64 {
        let mut powers = [0.0; DIRECTIONS];
        for snapshot in values.chunks_exact(self.elements) {
            let mut corrected = [Complex64::ZERO; MAX_ELEMENTS];
            let Some(corrected) = corrected.get_mut(..self.elements) else {
                return 1.0;
            };
            // The snapshots are calibrated. The fault affects the channels before calibration, so
            // that the gains are applied, and removed again after the correction.
            for ((value, received), gain) in corrected.iter_mut().zip(snapshot).zip(self.gains) {
                *value = received * gain;
            }
            if let Some(hypothesis) = hypothesis {
                hypothesis.correct(corrected);
            }
            for (value, gain) in corrected.iter_mut().zip(self.gains) {
                *value /= gain;
            }
            for (power, step) in powers.iter_mut().zip(&self.steps) {
                // Horner's rule for Σ x_k s^k.
                let mut sum = Complex64::ZERO;
                for value in corrected.iter().rev() {
                    sum = sum * step + value;
                }
                *power += sum.norm_sqr();
            }
        }
        let most = powers.iter().copied().fold(0.0, f64::max);
        (1.0 - most / (self.elements as f64 * total)).max(0.0)
    }
}

/// Returns a cumulative sum after an SSB. `difference` is a difference of residuals relative to the
/// expected residual.
fn cumulated(evidence: f64, difference: f64) -> f64 {
    let one = difference.clamp(-MAX_EVIDENCE_PER_SSB, MAX_EVIDENCE_PER_SSB);
    (evidence + one - DRIFT).max(0.0)
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    use super::*;
    use crate::settings::{Shipped, TomlFile};

    /// Receives a radio head over 200 m with a Rician factor `k`, and channel 1 inverted from 100 m
    /// on if `is_inverted`. Returns the distances (m) of the reports.
    fn reports(seed: u64, k: f64, is_inverted: bool) -> Vec<f64> {
        let site = Site::from_library("yard", &Shipped).unwrap();
        let vehicle = Vehicle::from_library("tugger", &Shipped).unwrap();
        let elements = usize::from(vehicle.array.elements);
        let mut monitor = ChannelMonitor::new(&site, &vehicle, 1);
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut reports = Vec::new();
        for step in 0..2000 {
            let distance_m = 0.1 * f64::from(step);
            let mut observation = SsbObservation::new(elements);
            observation.ssb.snr_db = 30.0;
            let std = (0.5 / (1.0 + k)).sqrt();
            let snapshot: Vec<Complex64> = (0..elements)
                .map(|antenna| {
                    let [re, im]: [f64; 2] =
                        std::array::from_fn(|_| std * rng.sample::<f64, _>(StandardNormal));
                    let line_of_sight = Complex64::cis(0.01 * distance_m * antenna as f64);
                    let sign = if is_inverted && distance_m > 100.0 && antenna == 1 {
                        -1.0
                    } else {
                        1.0
                    };
                    sign * ((k / (1.0 + k)).sqrt() * line_of_sight + Complex64::new(re, im))
                })
                .collect();
            assert!(observation.push(&snapshot));
            let change = &mut |_, begins: bool| {
                if begins {
                    reports.push(distance_m);
                }
            };
            monitor.ssb(&observation, distance_m, change);
        }
        reports
    }

    #[test]
    fn scatter_stronger_than_that_of_the_site_is_no_fault_and_hides_none() {
        for seed in 0..10 {
            // The site specifies 10 dB.
            assert!(reports(seed, 1.0, false).is_empty(), "{seed}");
            let found = reports(seed, 10.0, true);
            assert!(
                found.len() == 1 && (100.0..102.0).contains(&found[0]),
                "{found:?}"
            );
        }
    }
}
