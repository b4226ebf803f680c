//! SSBs that arrive after newer odometry, which is the normal case on a vehicle.

use crate::common;
use onboard::geometry::Pose;
use onboard::localize::{PoseEstimate, UpdateReason};
use onboard::observation::{OdometrySample, SsbDetection};
use onboard::settings::WakeUpSettings;
use onboard::wake_up::{Situation, WakeUpPolicy};
use onboard::{BoxError, Custom, Pipeline};
use recording::LoggedAngle;
use simulate::scenario::Scenario;
use simulate::{RunRecord, Step};
use toml::Value;

use crate::common::{Burst, changed, shipped, simulation, unguarded, value};
use crate::counting::allocations;

/// Time from the last SSB to the end of a drive in seconds.
const SILENCE_S: f64 = 1.0;

/// Beginning of a drive with an angle to every radio head in every burst.
struct Drive {
    scenario: Scenario,
    until_s: f64,
    start: Pose,
    odometry: Vec<OdometrySample>,
    bursts: Vec<Vec<LoggedAngle>>,
}

impl Drive {
    fn new(mut scenario: Scenario, until_s: f64) -> Self {
        scenario.vehicle.wake_up = Some(WakeUpSettings::EVERY_SSB);
        let (odometry, angles, record) = common::logs_until(&scenario, 6, until_s);
        let same_burst = |a: &LoggedAngle, b: &LoggedAngle| a.ssb.time_s == b.ssb.time_s;
        let bursts = angles.angles.chunk_by(same_burst).map(<[_]>::to_vec);
        let mut odometry = odometry.samples;
        odometry.retain(|sample| sample.time_s <= until_s);
        Self {
            bursts: bursts
                .filter(|burst| burst[0].ssb.time_s < until_s - SILENCE_S)
                .collect(),
            start: record.steps[0].truth,
            odometry,
            until_s,
            scenario,
        }
    }

    fn onboard(&self) -> Pipeline {
        let simulation = simulation(&self.scenario);
        let (site, vehicle) = (&self.scenario.site, &self.scenario.vehicle);
        let platform = simulation.platform();
        Pipeline::new(site, vehicle, platform, self.start, Custom::default()).unwrap()
    }

    /// Returns the inputs in order of arrival. At equal times, odometry precedes bursts.
    fn arrivals(&self, delay_s: impl Fn(usize) -> f64) -> Vec<Arrival<'_>> {
        let odometry = self.odometry.iter();
        let odometry = odometry.map(|it| (it.time_s, Arrival::Odometry(it)));
        let bursts = self.bursts.iter().enumerate().map(|(number, burst)| {
            let arrives_s = burst[0].ssb.time_s + delay_s(number);
            (arrives_s, Arrival::Burst(burst))
        });
        let mut all: Vec<_> = odometry.chain(bursts).collect();
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        all.into_iter().map(|(_, arrival)| arrival).collect()
    }

    /// Returns the poses at all odometry samples after the arrival of the last SSB.
    fn poses(&self, delay_s: impl Fn(usize) -> f64) -> Vec<PoseEstimate> {
        let mut onboard = self.onboard();
        let mut poses = Vec::new();
        for arrival in self.arrivals(delay_s) {
            take(&mut onboard, &arrival);
            if let Arrival::Odometry(sample) = arrival
                && sample.time_s > self.until_s - SILENCE_S + 0.5
            {
                poses.push(onboard.pose(sample.time_s).unwrap());
            }
        }
        assert!(poses.len() > 3 && onboard.searching().is_none());
        poses
    }
}

enum Arrival<'a> {
    Odometry(&'a OdometrySample),
    Burst(&'a [LoggedAngle]),
}

/// Processes an input and returns the number of accepted angles.
fn take(onboard: &mut Pipeline, arrival: &Arrival<'_>) -> usize {
    match arrival {
        Arrival::Odometry(sample) => {
            onboard.odometry(sample).unwrap().unwrap();
            0
        }
        Arrival::Burst(burst) => {
            let time_s = burst[0].ssb.time_s;
            let result = onboard.process_burst(time_s, &mut Burst(burst)).unwrap();
            let aoa_estimates = result.aoa_estimates.iter();
            aoa_estimates.filter(|it| it.verdict.accepted).count()
        }
    }
}

fn assert_same(found: &[PoseEstimate], expected: &[PoseEstimate], what: &str) {
    assert_eq!(found.len(), expected.len());
    for (found, expected) in found.iter().zip(expected) {
        let numbers = |it: &PoseEstimate| {
            let Pose {
                x_m,
                y_m,
                heading_rad,
            } = it.pose;
            let level_m = it.integrity.map_or(0.0, |it| it.protection_level_m);
            let covariance = it.covariance.unwrap_or_default();
            let mut all = vec![x_m, y_m, heading_rad, level_m];
            all.extend(covariance.as_flattened());
            all
        };
        for (found, expected) in numbers(found).iter().zip(numbers(expected)) {
            assert!(
                (found - expected).abs() < 1e-9,
                "{what}: {found} {expected}"
            );
        }
        let state = |it: &PoseEstimate| it.integrity.map(|it| (it.state, it.faulty));
        assert_eq!(state(found), state(expected), "{what}");
    }
}

fn drives() -> Vec<Drive> {
    let mut guarded = changed("yard", [("vehicle.integrity", value("{}"))]);
    // A radio head that is found faulty and later valid again.
    guarded.faults = shipped("nlos-and-faults").faults;
    guarded.faults.truncate(1);
    guarded.faults[0].from_s = 3.0;
    guarded.faults[0].until_s = 6.0;
    let no_map = [("vehicle.localizer.map", false.into())];
    let searching = [("vehicle.start.known", false.into())];
    vec![
        Drive::new(unguarded("paper-real-odometry-2"), 10.0),
        Drive::new(changed("paper-real-odometry-2", no_map), 10.0),
        Drive::new(changed("paper-real-odometry-2", searching), 20.0),
        Drive::new(guarded, 10.0),
        Drive::new(shipped("paper"), 10.0),
    ]
}

#[test]
fn late_and_timely_ssbs_give_equal_final_poses() {
    for mut drive in drives() {
        let name = drive.scenario.name.clone();
        for odometry_every in [1, 5] {
            // Odometry at 50 Hz, the rate of the SSBs, and at 10 Hz.
            let mut number = 0;
            drive.odometry.retain(|_| {
                number += 1;
                (number - 1) % odometry_every == 0
            });
            let in_time = drive.poses(|_| 0.0);
            for late_s in [0.03, 0.4] {
                let every = drive.poses(|_| late_s);
                assert_same(&every, &in_time, &format!("{name}, all {late_s} s late"));
                let some = drive.poses(|number| if number % 10 == 0 { late_s } else { 0.0 });
                assert_same(&some, &in_time, &format!("{name}, some {late_s} s late"));
            }
            let mixed = drive.poses(|number| [0.0, 0.03, 0.1, 0.4][7 * number % 4]);
            assert_same(&mixed, &in_time, &format!("{name}, in any order"));
        }
    }
}

#[test]
fn ssbs_older_than_the_buffer_are_too_late_and_change_nothing() {
    for drive in drives() {
        let mut onboard = drive.onboard();
        let mut late = Vec::new();
        for arrival in drive.arrivals(|number| if number == 400 { 1.0 } else { 0.0 }) {
            match arrival {
                Arrival::Burst(burst) if burst[0] == drive.bursts[400][0] => {
                    let now_s = burst[0].ssb.time_s + 1.0;
                    let before = onboard.pose(now_s).unwrap();
                    let result = onboard.process_burst(burst[0].ssb.time_s, &mut Burst(burst));
                    let aoa_estimates = result.unwrap().aoa_estimates.iter();
                    late.extend(aoa_estimates.map(|it| (it.verdict.accepted, it.verdict.reason)));
                    assert_eq!(onboard.pose(now_s).unwrap(), before);
                }
                other => {
                    take(&mut onboard, &other);
                }
            }
        }
        let expected = vec![(false, UpdateReason::TooLate); drive.bursts[400].len()];
        assert_eq!(late, expected, "{}", drive.scenario.name);
    }
}

#[test]
fn late_ssbs_allocate_nothing_after_initialisation() {
    for drive in drives() {
        let mut onboard = drive.onboard();
        let arrivals = drive.arrivals(|number| [0.03, 0.1, 0.4][number % 3]);
        let (warming, warm) = arrivals.split_at(arrivals.len() / 2);
        for arrival in warming {
            take(&mut onboard, arrival);
        }
        let mut accepted = 0;
        let count = allocations(|| {
            for arrival in warm {
                accepted += take(&mut onboard, arrival);
            }
        });
        assert_eq!(count, 0, "{}", drive.scenario.name);
        assert!(accepted > 150, "{}: {accepted}", drive.scenario.name);
    }
}

/// Policy that estimates every angle of the bursts sent up to a given time.
struct Until(f64);

impl WakeUpPolicy for Until {
    fn listens(&mut self, now: &Situation<'_>) -> Result<bool, BoxError> {
        Ok(now.time_s < self.0)
    }

    fn decide(
        &mut self,
        _: &Situation<'_>,
        _: &[SsbDetection],
        chosen: &mut [bool],
    ) -> Result<f64, BoxError> {
        chosen.fill(true);
        Ok(0.02)
    }
}

#[test]
fn a_drive_with_only_late_ssbs_ends_at_the_same_pose() {
    for name in ["paper-real-odometry-2", "paper"] {
        let drive = |latency_ms: f64| -> RunRecord {
            let scenario = changed(name, [("ssb_latency_ms", Value::from(latency_ms))]);
            let until = |_| {
                Ok(Custom {
                    policy: Some(Box::new(Until(30.0))),
                    ..Custom::default()
                })
            };
            simulation(&scenario).run(4, 0, &until).unwrap()
        };
        let in_time = drive(0.0);
        for latency_ms in [100.0, 400.0] {
            let late = drive(latency_ms);
            assert_eq!(late.aoa_estimates.len(), in_time.aoa_estimates.len());
            let arrived_s = 30.0 + 1e-3 * latency_ms;
            let estimates = |record: &RunRecord| -> Vec<PoseEstimate> {
                let after = |step: &&Step| step.time_s > arrived_s;
                let estimate = |step: &Step| PoseEstimate {
                    time_s: step.time_s,
                    pose: step.estimate,
                    covariance: step.covariance,
                    integrity: step.integrity,
                };
                record.steps.iter().filter(after).map(estimate).collect()
            };
            let what = format!("{name}, {latency_ms} ms");
            assert_same(&estimates(&late), &estimates(&in_time), &what);
            // Before the SSBs arrive, the estimate differs.
            assert_ne!(late.steps[1000].estimate, in_time.steps[1000].estimate);
        }
    }
}
