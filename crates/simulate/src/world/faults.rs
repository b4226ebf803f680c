//! Faults of the sensors.

use num_complex::Complex64;
use onboard::observation::OdometrySample;
use onboard::radio_head::RadioHead;

use super::array::TrueArray;
use super::path::VehicleState;
use crate::scenario::{FaultKind, FaultSettings};

/// Faults of a run.
#[derive(Debug, Clone)]
pub struct Faults {
    all: Vec<FaultSettings>,
    /// Last measured distance of the odometer in metres.
    distance_m: f64,
    /// Distance added by slip in metres.
    slipped_m: f64,
    /// Last delivered sample.
    delivered: Option<OdometrySample>,
}

impl Faults {
    /// Creates the faults of a run.
    pub fn new(all: &[FaultSettings]) -> Self {
        Self {
            all: all.to_vec(),
            distance_m: 0.0,
            slipped_m: 0.0,
            delivered: None,
        }
    }

    fn at(&self, time_s: f64) -> impl Iterator<Item = FaultKind> {
        self.all
            .iter()
            .filter(move |fault| (fault.from_s..fault.until_s).contains(&time_s))
            .map(|fault| fault.what)
    }

    /// Whether any fault is active at this time.
    pub fn any_at(&self, time_s: f64) -> bool {
        self.at(time_s).next().is_some()
    }

    /// Returns the additional delay of the signals of radio head `index` in seconds.
    pub fn delay_s(&self, index: usize, time_s: f64) -> f64 {
        let delay_ns = |fault| match fault {
            FaultKind::LateArrival { radio_head, by_ns }
                if radio_head.is_none_or(|it| it == index) =>
            {
                by_ns
            }
            _ => 0.0,
        };
        1e-9 * self.at(time_s).map(delay_ns).sum::<f64>()
    }

    /// Applies the faults to the antenna gains of the radio head with index `index`.
    pub fn distort(
        &self,
        index: usize,
        head: &RadioHead,
        array: &TrueArray,
        vehicle: &VehicleState,
        gains: &mut [Complex64],
    ) {
        for fault in self.at(vehicle.time_s) {
            match fault {
                FaultKind::NonLineOfSight {
                    radio_head,
                    bias_rad,
                } if radio_head == index => {
                    let towards = array.line_of_sight(vehicle, head).towards;
                    array.antennas().displace(towards, bias_rad, gains);
                }
                FaultKind::MovedHead { radio_head, by_m } if radio_head == index => {
                    let mut moved = *head;
                    moved.position.x_m += by_m[0];
                    moved.position.y_m += by_m[1];
                    let towards = |head| array.line_of_sight(vehicle, head).towards;
                    (array.antennas()).redirect(towards(head), towards(&moved), gains);
                }
                FaultKind::StuckAntenna {
                    antennas: [antenna],
                } => {
                    if let Some(gain) = gains.get_mut(antenna) {
                        *gain = Complex64::new(gain.norm(), 0.0);
                    }
                }
                FaultKind::DeadAntenna {
                    antennas: [antenna],
                } => {
                    if let Some(gain) = gains.get_mut(antenna) {
                        *gain = Complex64::ZERO;
                    }
                }
                FaultKind::InvertedAntenna {
                    antennas: [antenna],
                } => {
                    if let Some(gain) = gains.get_mut(antenna) {
                        *gain = -*gain;
                    }
                }
                FaultKind::ExchangedAntennas {
                    antennas: [first, second],
                } if first.max(second) < gains.len() => gains.swap(first, second),
                FaultKind::DuplicateHead { radio_head, by_m } if radio_head == index => {
                    let mut other = *head;
                    other.position.x_m += by_m[0];
                    other.position.y_m += by_m[1];
                    let towards = |head| array.line_of_sight(vehicle, head).towards;
                    let mut received = gains.to_vec();
                    (array.antennas()).redirect(towards(head), towards(&other), &mut received);
                    // The carrier phase of the other transmitter is independent of the radio
                    // head's.
                    let turn = Complex64::cis(6000.0 * vehicle.time_s);
                    for (gain, other) in gains.iter_mut().zip(received) {
                        *gain += turn * other;
                    }
                }
                _ => {}
            }
        }
    }

    /// Applies the faults to an odometry sample.
    pub fn slip(&mut self, sample: OdometrySample) -> OdometrySample {
        let mut sample = self.slipped(sample);
        let last = self.delivered.unwrap_or(sample);
        let time_s = sample.time_s;
        let is = |kind| self.at(time_s).any(|it| it == kind);
        if is(FaultKind::OdometerFrozen) {
            sample = OdometrySample {
                time_s: sample.time_s,
                ..last
            };
        }
        if is(FaultKind::OdometerHeld) {
            sample = OdometrySample {
                time_s,
                distance_m: last.distance_m + last.speed_mps * (time_s - last.time_s),
                ..last
            };
        }
        if is(FaultKind::OdometerStopped) {
            sample.distance_m = last.distance_m;
            sample.speed_mps = 0.0;
            sample.yaw_rate_radps = sample.yaw_rate_radps.map(|_| 0.0);
        }
        self.delivered = Some(sample);
        sample
    }

    fn slipped(&mut self, mut sample: OdometrySample) -> OdometrySample {
        let moved_m = sample.distance_m - self.distance_m;
        self.distance_m = sample.distance_m;
        let scale: f64 = (self.at(sample.time_s))
            .map(|fault| match fault {
                FaultKind::OdometerSlip { scale } => scale,
                FaultKind::OdometerReversed => -1.0,
                _ => 1.0,
            })
            .product();
        self.slipped_m += (scale - 1.0) * moved_m;
        sample.distance_m += self.slipped_m;
        sample.speed_mps *= scale;
        sample
    }
}
