//! Channel from one radio head to the array of the vehicle.

use std::f64::consts::FRAC_1_SQRT_2;

use num_complex::Complex64;
use onboard::link_budget::LinkBudget;
use onboard::observation::{MAX_ELEMENTS, SsbDetection, SsbObservation};
use onboard::radio_head::RadioHead;
use onboard::settings::ReceiverSettings;
use rand::{Rng, RngExt};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use super::propagation::Propagation;
use crate::random::{Purpose, Streams};
use crate::truth::Truth;
use crate::world::{TrueArray, VehicleState};

/// Channel from one radio head to the vehicle in one run.
pub struct HeadChannel {
    head: RadioHead,
    budget: LinkBudget,
    propagation: Box<dyn Propagation>,
    array: TrueArray,
    receiver: ReceiverSettings,
    snr_noise: ChaCha8Rng,
    snapshot_noise: ChaCha8Rng,
}

/// One SSB at the array before noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reception {
    /// Quantities that the receiver measures without an angle estimate.
    pub ssb: SsbDetection,
    gains: [Complex64; MAX_ELEMENTS],
    elements: usize,
}

impl Reception {
    /// Whether the SSB has power. Without a traced path there is no signal to detect.
    pub fn is_received(&self) -> bool {
        self.ssb.snr_db > f64::NEG_INFINITY
    }

    /// Returns the complex antenna gains relative to unit noise power.
    pub fn gains(&self) -> &[Complex64] {
        self.gains.get(..self.elements).unwrap_or_default()
    }

    /// Returns mutable complex antenna gains relative to unit noise power.
    pub fn gains_mut(&mut self) -> &mut [Complex64] {
        self.gains.get_mut(..self.elements).unwrap_or_default()
    }
}

impl HeadChannel {
    /// Creates the channels of a run, one per radio head in the order of the site. The propagation
    /// objects are moved out of `truth`.
    pub fn all(truth: &mut Truth, streams: Streams) -> Vec<Self> {
        let budget = LinkBudget::new(&truth.site, &truth.vehicle);
        let propagation = std::mem::take(&mut truth.propagation).into_iter();
        let heads = truth.heads.iter().zip(propagation).enumerate();
        heads
            .map(|(index, (&head, propagation))| Self {
                head,
                budget,
                propagation,
                array: truth.array.clone(),
                receiver: truth.vehicle.receiver.clone(),
                snr_noise: streams.generator(Purpose::SensedSnr, index),
                snapshot_noise: streams.generator(Purpose::Snapshots, index),
            })
            .collect()
    }

    /// Returns the radio head at its true position.
    pub const fn head(&self) -> &RadioHead {
        &self.head
    }

    /// Returns the array in its current state.
    pub const fn array(&self) -> &TrueArray {
        &self.array
    }

    /// Returns the mean SNR in dB of the current SSB from link budget, shadowing and additional
    /// path loss. Call this function once per SSB, in order.
    pub fn next_snr_db(&mut self, vehicle: &VehicleState) -> f64 {
        self.array.advance(vehicle.along_m);
        let sight = self.array.line_of_sight(vehicle, &self.head);
        self.budget.snr_db(&self.head, sight.distance_m) + self.propagation.next_gain_db(&sight)
    }

    /// Computes the antenna gains at frequencies `step_hz` apart around the carrier for the mean
    /// SNR `snr_db`; see [`Propagation::response`].
    pub fn response(
        &self,
        vehicle: &VehicleState,
        snr_db: f64,
        step_hz: f64,
        into: &mut [Complex64],
    ) {
        let antennas = self.array.antennas();
        let sight = self.array.line_of_sight(vehicle, &self.head);
        (self.propagation).response(&sight, antennas, step_hz, into);
        let amplitude = 10f64.powf(0.05 * snr_db);
        for gains in into.chunks_exact_mut(antennas.elements()) {
            for gain in gains.iter_mut() {
                *gain *= amplitude;
            }
            self.array.distort(gains);
        }
    }

    /// Returns the SSB with the mean SNR `snr_db` at the array, including fading.
    pub fn receive(&mut self, vehicle: &VehicleState, snr_db: f64) -> Reception {
        let mut reception = Reception {
            ssb: SsbDetection {
                pci: self.head.pci,
                ssb_index: self.head.ssb_index,
                time_s: vehicle.time_s,
                snr_db: 0.0,
            },
            gains: [Complex64::ZERO; MAX_ELEMENTS],
            elements: self.array.antennas().elements(),
        };
        self.response(vehicle, snr_db, 0.0, reception.gains_mut());
        let gains = reception.gains();
        let power = gains.iter().map(Complex64::norm_sqr).sum::<f64>() / gains.len() as f64;
        let mut sensed_db = 10.0 * power.log10();
        if self.receiver.snr_noise_db > 0.0 {
            let error: f64 = self.snr_noise.sample(StandardNormal);
            sensed_db += self.receiver.snr_noise_db * error;
        }
        reception.ssb.snr_db = sensed_db;
        reception
    }

    /// Writes the snapshots of SSB number `number`, with noise of unit power, to `into`.
    ///
    /// Without pilots, each snapshot carries one unknown QPSK symbol, like a resource element of
    /// the PBCH (TS 38.211, 7.3.3.1). With pilots, there is one despread block per OFDM symbol: N
    /// known resource elements give an N-fold SNR, and their common phase is unknown in each
    /// symbol.
    pub fn observe(&mut self, number: u64, reception: &Reception, into: &mut SsbObservation) {
        into.restart(reception.ssb);
        // Each SSB has its own stream position, so that its noise does not depend on which SSBs
        // were received before.
        self.snapshot_noise.set_stream(number);
        self.snapshot_noise.set_word_pos(0);
        match self.receiver.pilots.per_symbol() {
            None => {
                for _ in 0..self.receiver.snapshots {
                    let signal = self.qpsk();
                    self.push(reception, signal, into);
                }
            }
            Some(symbols) => {
                into.noise_variance = Some(1.0);
                for &resource_elements in symbols {
                    let signal = self.qpsk() * f64::from(resource_elements).sqrt();
                    self.push(reception, signal, into);
                }
            }
        }
    }

    fn push(&mut self, reception: &Reception, signal: Complex64, into: &mut SsbObservation) {
        let mut snapshot = [Complex64::ZERO; MAX_ELEMENTS];
        let gains = reception.gains();
        for (value, gain) in snapshot.iter_mut().zip(gains) {
            *value = gain * signal + self.complex_normal();
        }
        into.push(snapshot.get(..gains.len()).unwrap_or_default());
    }

    /// Draws a random QPSK symbol.
    fn qpsk(&mut self) -> Complex64 {
        let bits = self.snapshot_noise.next_u32();
        let level = |bit: u32| {
            if bits >> bit & 1 == 0 {
                FRAC_1_SQRT_2
            } else {
                -FRAC_1_SQRT_2
            }
        };
        Complex64::new(level(0), level(1))
    }

    /// Draws a circular complex Gaussian number of unit power.
    fn complex_normal(&mut self) -> Complex64 {
        let re: f64 = self.snapshot_noise.sample(StandardNormal);
        let im: f64 = self.snapshot_noise.sample(StandardNormal);
        Complex64::new(re, im) * FRAC_1_SQRT_2
    }
}
