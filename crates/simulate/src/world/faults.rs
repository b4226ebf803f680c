//! Faults, brought into what the sensors deliver.

use std::f64::consts::TAU;

use num_complex::Complex64;

use super::{RadioHead, VehicleState};
use crate::observation::{OdometrySample, Snapshot};
use crate::scenario::{FaultKind, FaultSettings, Scenario};

/// The faults of a scenario.
#[derive(Debug, Clone)]
pub struct Faults {
    all: Vec<FaultSettings>,
    element_rad: f64,
    mounting_angle_rad: f64,
    /// The odometer's own last distance, and what slip has added to it, in metres.
    distance_m: f64,
    slipped_m: f64,
}

impl Faults {
    /// The scenario's.
    pub fn new(scenario: &Scenario) -> Self {
        Self {
            all: scenario.faults.clone(),
            element_rad: TAU * scenario.array.spacing_wavelengths,
            mounting_angle_rad: scenario.array.mounting_angle_rad,
            distance_m: 0.0,
            slipped_m: 0.0,
        }
    }

    fn at(&self, time_s: f64) -> impl Iterator<Item = FaultKind> {
        self.all
            .iter()
            .filter(move |fault| (fault.from_s..fault.until_s).contains(&time_s))
            .map(|fault| fault.what)
    }

    /// Whether anything is wrong at this time.
    pub fn any_at(&self, time_s: f64) -> bool {
        self.at(time_s).next().is_some()
    }

    /// What becomes of the antennas' gains for radio head number `index`.
    pub fn distort(
        &self,
        index: usize,
        head: &RadioHead,
        vehicle: &VehicleState,
        gains: &mut Snapshot,
    ) {
        for fault in self.at(vehicle.time_s) {
            match fault {
                FaultKind::NonLineOfSight {
                    radio_head,
                    bias_rad,
                } if radio_head == index => steer(gains, bias_rad),
                FaultKind::MovedHead { radio_head, by_m } if radio_head == index => {
                    let mut moved = head.position;
                    moved.x_m += by_m[0];
                    moved.y_m += by_m[1];
                    let phase_rad = |place| {
                        let bearing_rad = vehicle.pose.point().bearing_rad(place);
                        let axis_rad = vehicle.pose.heading_rad + self.mounting_angle_rad;
                        self.element_rad * (bearing_rad - axis_rad).cos()
                    };
                    steer(gains, phase_rad(moved) - phase_rad(head.position));
                }
                FaultKind::StuckAntenna { antenna } => {
                    if let Some(gain) = gains.get_mut(antenna) {
                        *gain = Complex64::new(gain.norm(), 0.0);
                    }
                }
                _ => {}
            }
        }
    }

    /// What becomes of an odometry sample.
    pub fn slip(&mut self, mut sample: OdometrySample) -> OdometrySample {
        let moved_m = sample.distance_m - self.distance_m;
        self.distance_m = sample.distance_m;
        let ratio: f64 = (self.at(sample.time_s))
            .map(|fault| match fault {
                FaultKind::OdometerSlip { ratio } => ratio,
                _ => 1.0,
            })
            .product();
        self.slipped_m += (ratio - 1.0) * moved_m;
        sample.distance_m += self.slipped_m;
        sample.speed_mps *= ratio;
        sample
    }
}

/// Turns the wave by `phase_rad` from antenna to antenna.
fn steer(gains: &mut Snapshot, phase_rad: f64) {
    let step = Complex64::cis(phase_rad);
    let mut turn = Complex64::ONE;
    for gain in gains {
        *gain *= turn;
        turn *= step;
    }
}
