//! From the vehicle's true place to what its array receives of one radio head.

use num_complex::Complex64;
use rand::{Rng, RngExt};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use super::{LinkBudget, RicianFading, Shadowing};
use crate::observation::{SensedSsb, Snapshot, SsbObservation};
use crate::random::{Purpose, Streams};
use crate::scenario::{Pilots, Scenario};
use crate::world::{ArrayDrift, RadioHead, VehicleState};
use std::f64::consts::{FRAC_1_SQRT_2, TAU};

/// The channel from one radio head to the vehicle in one run.
#[derive(Debug, Clone)]
pub struct HeadChannel {
    head: RadioHead,
    budget: LinkBudget,
    shadowing: Shadowing,
    fading: RicianFading,
    snr_noise_db: f64,
    snr_noise: ChaCha8Rng,
    snapshot_noise: ChaCha8Rng,
    element_rad: f64,
    array: ArrayDrift,
    snapshots: u16,
    pilots: Pilots,
}

/// One SSB at the array, before noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reception {
    /// True electrical angle of the line of sight, in radians.
    pub phase_rad: f64,
    /// Gains of the antennas, relative to unit noise power.
    pub gains: Snapshot,
    /// What the receiver senses of it without estimating an angle.
    pub ssb: SensedSsb,
}

impl HeadChannel {
    /// The channel of radio head number `index`.
    pub fn new(scenario: &Scenario, head: RadioHead, index: usize, streams: Streams) -> Self {
        Self {
            head,
            budget: LinkBudget::new(scenario),
            shadowing: Shadowing::new(&scenario.channel, streams, index),
            fading: RicianFading::new(scenario, streams, index),
            snr_noise_db: scenario.receiver.snr_noise_db,
            snr_noise: streams.generator(Purpose::SensedSnr, index),
            snapshot_noise: streams.generator(Purpose::Snapshots, index),
            element_rad: TAU * scenario.array.spacing_wavelengths,
            array: ArrayDrift::new(scenario.array, streams),
            snapshots: scenario.array.snapshots,
            pilots: scenario.receiver.pilots,
        }
    }

    /// The radio head.
    pub const fn head(&self) -> &RadioHead {
        &self.head
    }

    /// Mean SNR in dB of the SSB that arrives now: link budget and shadowing. To be called once for
    /// each SSB, in order.
    pub fn next_snr_db(&mut self, vehicle: &VehicleState) -> f64 {
        self.array.advance(vehicle.along_m);
        let distance_m = vehicle.pose.point().distance_m(self.head.position);
        self.budget.snr_db(&self.head, distance_m) + self.shadowing.next_db(vehicle.along_m)
    }

    /// Gains of the antennas at frequencies `step_hz` apart around the carrier, for a mean SNR of
    /// `snr_db`; see [`RicianFading::response`].
    pub fn response(
        &self,
        vehicle: &VehicleState,
        snr_db: f64,
        step_hz: f64,
        into: &mut [Snapshot],
    ) {
        let (phase_rad, distance_m) = self.line_of_sight(vehicle);
        self.fading
            .response(phase_rad, vehicle.along_m, distance_m, step_hz, into);
        let amplitude = 10f64.powf(0.05 * snr_db);
        for gains in into {
            *gains = gains.map(|gain| gain * amplitude);
            self.array.turn(gains);
        }
    }

    /// Electrical angle of the line of sight, and its length in metres.
    fn line_of_sight(&self, vehicle: &VehicleState) -> (f64, f64) {
        let place = vehicle.pose.point();
        let bearing_rad = place.bearing_rad(self.head.position);
        let to_axis_rad = bearing_rad - vehicle.pose.heading_rad - self.array.mounting_rad();
        let phase_rad = self.element_rad * to_axis_rad.cos();
        (phase_rad, place.distance_m(self.head.position))
    }

    /// Electrical angle of the line of sight, and gains of the antennas for a mean SNR of `snr_db`.
    pub fn gains(&self, vehicle: &VehicleState, snr_db: f64) -> (f64, Snapshot) {
        let (phase_rad, distance_m) = self.line_of_sight(vehicle);
        let amplitude = 10f64.powf(0.05 * snr_db);
        let fading = self.fading.gains(phase_rad, vehicle.along_m, distance_m);
        let mut gains = fading.map(|gain| gain * amplitude);
        self.array.turn(&mut gains);
        (phase_rad, gains)
    }

    /// The SSB of mean SNR `snr_db` at the array, with fading.
    pub fn receive(&mut self, vehicle: &VehicleState, snr_db: f64) -> Reception {
        let (phase_rad, gains) = self.gains(vehicle, snr_db);
        let power = gains.iter().map(Complex64::norm_sqr).sum::<f64>() / gains.len() as f64;
        let mut sensed_db = 10.0 * power.log10();
        if self.snr_noise_db > 0.0 {
            let error: f64 = self.snr_noise.sample(StandardNormal);
            sensed_db += self.snr_noise_db * error;
        }
        let ssb = SensedSsb {
            pci: self.head.pci,
            ssb_index: self.head.ssb_index,
            time_s: vehicle.time_s,
            snr_db: sensed_db,
        };
        Reception {
            phase_rad,
            gains,
            ssb,
        }
    }

    /// The array's output for SSB number `number`, noise of unit power included.
    ///
    /// Blind, each snapshot carries one unknown QPSK symbol, as a resource element of the broadcast
    /// channel does (TS 38.211, 7.3.3.1). With pilots there
    /// is one despread block per OFDM symbol: N known resource elements add up to an N-fold SNR,
    /// their common phase unknown from symbol to symbol.
    pub fn observe(&mut self, number: u64, reception: &Reception, into: &mut SsbObservation) {
        into.restart(reception.ssb);
        // Each SSB has its own nonce: it sounds the same whether or not earlier ones were heard.
        self.snapshot_noise.set_stream(number);
        self.snapshot_noise.set_word_pos(0);
        match self.pilots.per_symbol() {
            None => {
                for _ in 0..self.snapshots {
                    let signal = self.qpsk();
                    self.push(reception.gains, signal, into);
                }
            }
            Some(symbols) => {
                into.noise_variance = Some(1.0);
                for &resource_elements in symbols {
                    let signal = self.qpsk() * f64::from(resource_elements).sqrt();
                    self.push(reception.gains, signal, into);
                }
            }
        }
    }

    fn push(&mut self, gains: Snapshot, signal: Complex64, into: &mut SsbObservation) {
        into.push(gains.map(|gain| gain * signal + self.complex_normal()));
    }

    /// A random QPSK symbol.
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

    /// A circular Gaussian of unit power.
    fn complex_normal(&mut self) -> Complex64 {
        let re: f64 = self.snapshot_noise.sample(StandardNormal);
        let im: f64 = self.snapshot_noise.sample(StandardNormal);
        Complex64::new(re, im) * FRAC_1_SQRT_2
    }
}
