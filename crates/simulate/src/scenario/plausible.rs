//! Warnings about valid but implausible values of a scenario.

use onboard::geometry::Point;
use onboard::plausible::{
    Usual, Warning, as_degrees, as_milliseconds, as_percent, of_site_and_vehicle_along, of_vehicle,
    rounded, speed_in_mps, unusual,
};
use onboard::road::Road;
use onboard::settings::{Check, SettingsError};

use super::scenario_file::Scenario;

const ROWS: &[Usual] = &[
    Usual {
        key: "ssb_latency_ms",
        within: [0.0, 1000.0],
        why: "a vehicle drives several metres in this time",
        write: |it| format!("write milliseconds: {it} µs are {}", rounded(it / 1000.0)),
    },
    Usual {
        key: "motion.top_speed_kmh",
        within: [0.1, 100.0],
        why: "no plant vehicle reaches this speed",
        write: |it| format!("write km/h: {it} m/min are {:.1}", it * 0.06),
    },
    Usual {
        key: "motion.acceleration_mps2",
        within: [0.02, 9.81],
        why: "tyre friction limits the acceleration to 1 g",
        write: |it| format!("write m/s²: {it} km/h per second are {:.2}", it / 3.6),
    },
    Usual {
        key: "motion.stops[].dwell_s",
        within: [0.0, 3600.0],
        why: "a stop is at most one hour",
        write: |it| format!("write seconds: {it} ms are {}", rounded(it / 1000.0)),
    },
    Usual {
        key: "channel.shadowing_std_db",
        within: [0.0, 15.0],
        why: "shadowing has a standard deviation of 3 to 8 dB (TR 38.901, table 7.4.1-1)",
        write: |_| "write a standard deviation in dB, 3 to 8".to_owned(),
    },
    Usual {
        key: "truth.std_factor",
        within: [0.0, 50.0],
        why: "no quantity deviates by this many standard deviations",
        write: as_percent,
    },
    Usual {
        key: "channel.blockage.duration_s",
        within: [0.02, 3600.0],
        why: "a vehicle or a person passes within seconds",
        write: as_milliseconds,
    },
];
/// Maximum lateral acceleration of rubber on dry ground, about 0.8 g (m/s²).
const MAX_LATERAL_ACCELERATION_MPS2: f64 = 8.0;
/// Maximum unnoticed rotation of an array, 20 degrees (rad).
const MAX_TURNED_RAD: f64 = 0.35;
/// Maximum unnoticed displacement of a mast (m).
const MAX_MOVED_M: f64 = 100.0;
/// Step at which the curvature of the road is evaluated (m).
const STEP_M: f64 = 1.0;

impl Scenario {
    /// Returns warnings about implausible values of the scenario, its site and its vehicle.
    ///
    /// # Errors
    /// [`SettingsError`] only if the scenario was changed by code to an invalid one.
    pub fn warnings(&self) -> Result<Vec<Warning>, SettingsError> {
        let check = Check { file: &self.name };
        let path = self.path(check)?;
        let mut found = of_site_and_vehicle_along(&self.site, &self.vehicle, &path);
        found.extend(unusual(self, ROWS));
        if let Some(speed_kmh) = self.motion.top_speed_kmh {
            found.extend(speed_in_mps("motion.top_speed_kmh", speed_kmh));
        }
        found.extend(self.faster_than_it_is());
        found.extend(self.too_fast_for_bend(&path));
        found.extend(self.far_from_nominal(check)?);
        let duration_s = self.size(check)?.duration_s;
        found.extend(self.after_the_drive(duration_s));
        Ok(found)
    }

    /// Warns of true values that are probably in another unit than the nominal values.
    fn far_from_nominal(&self, check: Check<'_>) -> Result<Vec<Warning>, SettingsError> {
        let (site, vehicle, _) = self.actual(check)?;
        let nominal = of_vehicle(&self.vehicle);
        let mut found = of_vehicle(&vehicle);
        found.retain(|it| !nominal.contains(it));
        let turned_rad = vehicle.array.mounting_rad - self.vehicle.array.mounting_rad;
        if turned_rad.abs() > MAX_TURNED_RAD {
            found.push(Warning {
                key: "array.mounting_rad".to_owned(),
                value: vehicle.array.mounting_rad.to_string(),
                why: format!(
                    "that is {:.0} degrees from the nominal value",
                    turned_rad.to_degrees()
                ),
                write: as_degrees(vehicle.array.mounting_rad),
            });
        }
        let heads = site
            .radio_heads
            .iter()
            .zip(&self.site.radio_heads)
            .enumerate();
        found = found
            .into_iter()
            .map(|it| it.with_path_prefix("vehicle"))
            .collect();
        found.extend(heads.filter_map(|(index, (head, nominal))| {
            let [at, plan] =
                [head, nominal].map(|it| Point::new(it.position_m[0], it.position_m[1]));
            let moved_m = at.distance_m(plan);
            (moved_m > MAX_MOVED_M).then(|| Warning {
                key: format!("site.radio_heads[{index}].position_m"),
                value: format!("{:?}", head.position_m),
                why: format!("that is {moved_m:.0} m from the nominal position"),
                write:
                    "write the position in metres in the frame of the site, not the deviation from \
                        the nominal position"
                        .to_owned(),
            })
        }));
        Ok(found
            .into_iter()
            .map(|it| it.with_path_prefix("truth"))
            .collect())
    }

    fn faster_than_it_is(&self) -> Option<Warning> {
        let (speed_kmh, top_kmh) = (self.motion.top_speed_kmh?, self.vehicle.top_speed_kmh);
        // A controller overshoots the speed by up to 10 %.
        (speed_kmh > 1.1 * top_kmh).then(|| Warning {
            key: "motion.top_speed_kmh".to_owned(),
            value: speed_kmh.to_string(),
            why: format!("the maximum speed of the vehicle is {top_kmh} km/h"),
            write: format!(
                "write vehicle.top_speed_kmh = {speed_kmh}, if the vehicle reaches this speed"
            ),
        })
    }

    /// Warns of a bend that cannot be driven at the speed because of a wrong radius or a wrong
    /// unit.
    fn too_fast_for_bend(&self, path: &Road) -> Option<Warning> {
        let key = match self.motion.top_speed_kmh {
            Some(_) => "motion.top_speed_kmh",
            None => "vehicle.top_speed_kmh",
        };
        let speed_kmh = self
            .motion
            .top_speed_kmh
            .unwrap_or(self.vehicle.top_speed_kmh);
        let steps = (path.length_m() / STEP_M) as usize;
        let bends = (0..=steps).map(|step| {
            let along_m = step as f64 * STEP_M;
            (path.curvature_per_m(along_m).abs(), along_m)
        });
        let (curvature_per_m, along_m) = bends.max_by(|a, b| a.0.total_cmp(&b.0))?;
        let across_mps2 = (speed_kmh / 3.6).powi(2) * curvature_per_m;
        (across_mps2 > MAX_LATERAL_ACCELERATION_MPS2).then(|| {
            let max_kmh = 3.6 * (0.25 * MAX_LATERAL_ACCELERATION_MPS2 / curvature_per_m).sqrt();
            Warning {
                key: key.to_owned(),
                value: speed_kmh.to_string(),
                why: format!(
                    "in the bend of {:.1} m radius at {along_m:.0} m, the lateral acceleration is \
                     {across_mps2:.0} m/s², and tyres permit {MAX_LATERAL_ACCELERATION_MPS2}",
                    1.0 / curvature_per_m
                ),
                write: format!("write at most {max_kmh:.0} km/h, or a larger radius"),
            }
        })
    }

    fn after_the_drive(&self, duration_s: f64) -> Vec<Warning> {
        let faults = self.faults.iter().enumerate();
        let late = faults.filter(|(_, fault)| fault.from_s > duration_s);
        late.map(|(index, fault)| Warning {
            key: format!("faults[{index}].from_s"),
            value: fault.from_s.to_string(),
            why: format!("the duration of the drive is at most {duration_s:.0} s"),
            write: format!(
                "write seconds from the start of the drive: {} ms are {}",
                fault.from_s,
                rounded(fault.from_s / 1000.0)
            ),
        })
        .collect()
    }
}
