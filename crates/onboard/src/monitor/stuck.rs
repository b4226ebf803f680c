//! Angles that repeat exactly although the vehicle moves: the receiver or the source of the angles is stuck.

use super::repetition::Repetitions;
use crate::localize::AngleUpdate;

/// Minimum distance between two angles that are compared, in metres. At standstill, a coarse resolution repeats them.
const MOVED_M: f64 = 0.02;

/// Last compared angle of a radio head.
#[derive(Debug, Clone, Copy)]
struct Last {
    pci: u16,
    ssb_index: u8,
    phase_rad: f64,
    distance_m: f64,
}

/// Counts repeated angles of all radio heads.
#[derive(Debug)]
pub struct StuckAngles {
    last: Vec<Last>,
    repetitions: Repetitions,
}

impl StuckAngles {
    /// Creates the monitor for this number of radio heads.
    pub fn new(heads: usize) -> Self {
        Self {
            last: Vec::with_capacity(heads),
            repetitions: Repetitions::default(),
        }
    }

    /// Processes the angles of a burst, received at the driven distance `distance_m`. Returns whether the angles are
    /// stuck.
    pub fn angles(&mut self, updates: &[AngleUpdate], distance_m: f64) -> bool {
        for AngleUpdate { head, measured, .. } in updates {
            let new = Last {
                pci: head.pci,
                ssb_index: head.ssb_index,
                phase_rad: measured.phase_rad,
                distance_m,
            };
            let is_same = |it: &&mut Last| (it.pci, it.ssb_index) == (new.pci, new.ssb_index);
            let Some(last) = self.last.iter_mut().find(is_same) else {
                if self.last.len() < self.last.capacity() {
                    self.last.push(new);
                }
                continue;
            };
            let is_repeated = last.phase_rad.to_bits() == new.phase_rad.to_bits();
            if !is_repeated {
                self.repetitions.change();
            } else if (distance_m - last.distance_m).abs() >= MOVED_M {
                self.repetitions.repeat();
            } else {
                continue;
            }
            *last = new;
        }
        let is_stuck = self.repetitions.is_suspicious();
        if is_stuck {
            self.repetitions.mark_fault();
        }
        is_stuck
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::localize::{AngleMeasurement, UpdateReason, UpdateResult};
    use crate::observation::MeasurementKind;
    use crate::radio_head::RadioHead;
    use crate::settings::{Shipped, Site, TomlFile, Vehicle};

    /// Returns the times (s) at which the monitor reports stuck angles within 20 s at 25 Hz and 2 m/s, for the phase of a
    /// radio head (rad) as a function of the time (s).
    fn reports(phase_rad: impl Fn(f64, usize) -> f64) -> Vec<f64> {
        let site = Site::from_library("yard", &Shipped).unwrap();
        let heads =
            RadioHead::received_by(&site, &Vehicle::from_library("tugger", &Shipped).unwrap());
        let mut monitor = StuckAngles::new(heads.len());
        let mut found = Vec::new();
        for burst in 0..500 {
            let time_s = 0.04 * f64::from(burst);
            let updates: Vec<AngleUpdate> = (heads.iter().enumerate())
                .map(|(number, &head)| AngleUpdate {
                    number,
                    head,
                    measured: AngleMeasurement {
                        kind: MeasurementKind::Angle,
                        time_s,
                        phase_rad: phase_rad(time_s, number),
                        phase_sigma_rad: 0.02,
                        angle_rad: f64::NAN,
                        snr_db: 20.0,
                        resolved: true,
                    },
                    verdict: UpdateResult::unused(UpdateReason::Unusable),
                })
                .collect();
            if monitor.angles(&updates, 2.0 * time_s) {
                found.push(time_s);
            }
        }
        found
    }

    #[test]
    fn repeated_angles_are_reported_within_three_bursts_until_they_change() {
        let of = |time_s: f64, number: usize| (0.1 * time_s + number as f64).sin();
        let found = reports(|time_s, number| {
            let held_s = if (10.0..15.0).contains(&time_s) {
                10.0
            } else {
                time_s
            };
            of(held_s, number)
        });
        let (first_s, last_s) = (found[0], found[found.len() - 1]);
        assert!(first_s > 10.0 && first_s <= 10.12, "{first_s}");
        assert!(last_s > 14.9 && last_s < 15.0, "{last_s}");
    }

    #[test]
    fn angles_with_a_coarse_resolution_are_not_stuck() {
        for resolution_rad in [1e-3, 0.02, 0.1] {
            let found = reports(|time_s, number| {
                let exact_rad = 3.0 * (0.1 * time_s + number as f64).sin();
                (exact_rad / resolution_rad).round() * resolution_rad
            });
            assert!(found.is_empty(), "{resolution_rad}: {found:?}");
        }
    }
}
