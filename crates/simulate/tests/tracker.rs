//! The tracker on simulated drives, and on input that no drive should bring.
#![allow(clippy::unwrap_used, reason = "this is a test")]

use std::sync::Arc;

use access_av::geometry::Pose;
use access_av::localize::bound::Bound;
use access_av::localize::tracker::{Calibration, InitialPose, OdometryVerdict, TrackerConfig};
use access_av::localize::{AngleMeasurement, Tracker, UpdateReason};
use access_av::observation::OdometrySample;
use access_av::onboard::Custom;
use access_av::platform::Platform;
use access_av::random::Streams;
use access_av::scenario::{LocalizerSettings, Scenario};
use access_av::simulate::{Campaign, CampaignOptions, Consistency, RunRecord, Simulation, Step};
use access_av::world::{ArrayDrift, RadioHead, Vehicle};

fn drives(scenario: Scenario, runs: u64) -> Vec<RunRecord> {
    let platform = Platform::load(&scenario.platform.name).unwrap();
    let simulation = Simulation::new(scenario, platform).unwrap();
    (0..runs)
        .map(|run| simulation.run(11, run, Custom::default()).unwrap())
        .collect()
}

fn campaign(scenario: Scenario, runs: usize) -> Campaign {
    let options = CampaignOptions {
        seed: 11,
        runs,
        ..CampaignOptions::default()
    };
    let simulation = Simulation::on_its_platform(scenario).unwrap();
    simulation.campaign(&options).unwrap()
}

/// Mean normalised squared error of the position, and root mean square error.
fn consistency(records: &[RunRecord]) -> (f64, f64) {
    let (mut nees, mut square_m2, mut count) = (0.0, 0.0, 0.0);
    for step in records
        .iter()
        .flat_map(|record| record.steps.iter().skip(100))
    {
        let (dx, dy) = (
            step.estimate.x_m - step.truth.x_m,
            step.estimate.y_m - step.truth.y_m,
        );
        let [[xx, xy, _], [_, yy, _], _] = step.covariance.unwrap();
        nees += (yy * dx * dx - 2.0 * xy * dx * dy + xx * dy * dy) / (xx * yy - xy * xy);
        square_m2 += dx * dx + dy * dy;
        count += 1.0;
    }
    (nees / count, (square_m2 / count).sqrt())
}

/// Mean and standard deviation of a figure over campaigns.
fn spread(campaigns: &[Consistency], figure: fn(&Consistency) -> f64) -> (f64, f64) {
    let count = campaigns.len() as f64;
    let mean = campaigns.iter().map(figure).sum::<f64>() / count;
    let square: f64 = campaigns.iter().map(|it| (figure(it) - mean).powi(2)).sum();
    (mean, (square / (count - 1.0)).sqrt())
}

#[test]
fn as_wrong_as_it_says_and_as_right_as_can_be() {
    let (runs, campaigns) = (32, 200);
    for (name, target_p90_m) in [
        ("paper-real-odometry", 0.40),
        ("paper-real-odometry-2", 0.26),
        ("paper-real-odometry-4", 0.20),
    ] {
        let scenario = Scenario::load(name).unwrap();
        let bound = Bound::new(&scenario).unwrap();
        let points = bound.along_route();
        let square_m2: f64 = points.iter().map(|p| p.position_rms_m.powi(2)).sum();
        let bound_m = (square_m2 / points.len() as f64).sqrt();

        // What a filter with the tracker's covariances shows in campaigns of this size ...
        let filter = bound.ideal_filter(50);
        let ideal: Vec<Consistency> = (0..campaigns)
            .map(|seed| filter.campaign(seed, runs).consistency(1))
            .collect();
        let (p90_m, p90_spread_m) = spread(&ideal, |it| it.p90_m);
        let (rms_m, rms_spread_m) = spread(&ideal, |it| it.rms_m);
        let (nees, nees_spread) = spread(&ideal, |it| it.mean_nees);
        // ... meets what is asked of it, its mean being known to a √campaigns of the spread ...
        let certain = 4.0 / (campaigns as f64).sqrt();
        assert!(
            p90_m + certain * p90_spread_m < target_p90_m,
            "{name}: {p90_m} m"
        );
        assert!(
            rms_m + certain * rms_spread_m < 1.10 * bound_m,
            "{name}: {rms_m} {bound_m}"
        );

        // ... and the tracker cannot be told from it.
        let found = campaign(scenario, runs as usize).consistency(50);
        for (what, found, expected, spread) in [
            ("p90", found.p90_m, p90_m, p90_spread_m),
            ("rms", found.rms_m, rms_m, rms_spread_m),
            ("nees", found.mean_nees, nees, nees_spread),
        ] {
            assert!(
                (found - expected).abs() < 4.0 * spread,
                "{name}: {what} {found}, expected {expected} ± {spread}"
            );
        }
    }
}

#[test]
fn a_start_unknown_by_five_metres_is_found_as_well_as_can_be() {
    let (runs, campaigns, stride) = (48, 100, 50);
    for (map, heading_std_rad) in [(true, 0.0), (false, 0.02)] {
        let scenario = Scenario::load("paper-real-odometry-2")
            .unwrap()
            .with_overrides([
                ("start.position_std_m", toml::Value::from(5.0)),
                ("start.heading_std_rad", heading_std_rad.into()),
                ("localizer.map", map.into()),
            ])
            .unwrap();
        let bound = Bound::new(&scenario).unwrap();
        let points = bound.along_route();
        // Every 50th step from 20 m of travel on.
        let ratios = |campaign: &Campaign, stride: usize| -> Vec<f64> {
            (campaign.steps.iter().step_by(stride))
                .zip(points.iter().step_by(50))
                .filter(|(_, point)| point.along_m >= 20.0)
                .map(|(step, point)| step.rms_error_m / point.position_rms_m)
                .collect()
        };
        let mean = |ratios: &[f64]| ratios.iter().sum::<f64>() / ratios.len() as f64;
        let largest = |ratios: &[f64]| ratios.iter().copied().fold(0.0, f64::max);

        // A filter with the tracker's covariances is within 1.2 of the bound at every step ...
        let filter = bound.ideal_filter(stride);
        let ideal: Vec<Vec<f64>> = (0..campaigns)
            .map(|seed| ratios(&filter.campaign(seed, runs), 1))
            .collect();
        for step in 0..ideal[0].len() {
            let squares = ideal.iter().map(|ratios| ratios[step].powi(2));
            let ratio = (squares.sum::<f64>() / campaigns as f64).sqrt();
            assert!(ratio < 1.2, "step {step}: {ratio}");
        }

        // ... and the tracker, on average and at its worst step, no further than such a filter by
        // four standard deviations of a campaign of this size.
        let found = ratios(&campaign(scenario, runs as usize), stride);
        for (what, of) in [
            ("mean", &mean as &dyn Fn(&[f64]) -> f64),
            ("largest", &largest),
        ] {
            let values: Vec<f64> = ideal.iter().map(|ratios| of(ratios)).collect();
            let centre = mean(&values);
            let squares = values.iter().map(|value| (value - centre).powi(2));
            let spread = (squares.sum::<f64>() / (campaigns as f64 - 1.0)).sqrt();
            assert!(
                of(&found) < centre + 4.0 * spread,
                "map {map}: {what} {}, expected {centre} ± {spread}",
                of(&found)
            );
        }
    }
}

#[test]
fn more_radio_heads_lower_the_bound() {
    let rms_m = [
        "paper-real-odometry",
        "paper-real-odometry-2",
        "paper-real-odometry-4",
    ]
    .map(|name| {
        let bound = Bound::new(&Scenario::load(name).unwrap())
            .unwrap()
            .along_route();
        bound.iter().map(|p| p.position_rms_m).sum::<f64>() / bound.len() as f64
    });
    assert!(
        rms_m[0] > 1.3 * rms_m[1] && rms_m[1] > 1.2 * rms_m[2],
        "{rms_m:?}"
    );
}

#[test]
fn the_site_bound_is_blind_along_the_line_through_two_heads() {
    let scenario = Scenario::load("paper-real-odometry-2").unwrap();
    let bound = Bound::new(&scenario).unwrap();
    let between = bound.at([150.0, 10.0].into(), 50.0, 0.01).unwrap();
    // Far out on the line through both heads their angles say the same.
    let beyond = bound.at([785.0, 820.0].into(), 50.0, 0.01);
    assert!(
        beyond.is_none_or(|rms_m| rms_m > 20.0 * between),
        "{between} {beyond:?}"
    );
}

#[test]
fn without_a_map_it_stays_within_its_covariance() {
    let scenario = Scenario::load("paper-real-odometry-4")
        .unwrap()
        .with_overrides([("localizer.map", false.into())])
        .unwrap();
    let runs = 12;
    let (nees, _) = consistency(&drives(scenario, runs));
    assert!(
        (nees / 2.0 - 1.0).abs() < 4.0 / (runs as f64).sqrt(),
        "{nees}"
    );
}

#[test]
fn a_campus_is_driven_from_cell_to_cell() {
    let records = drives(Scenario::load("campus-handover").unwrap(), 1);
    let mut cells: Vec<u16> = records[0]
        .executions
        .iter()
        .filter(|execution| execution.verdict.accepted)
        .map(|execution| execution.ssb.pci)
        .collect();
    cells.sort_unstable();
    cells.dedup();
    assert!(cells.len() >= 6, "{cells:?}");
    let last = records[0].steps.last().unwrap();
    assert!(last.truth.point().distance_m(last.estimate.point()) < 2.0);
}

fn tracker() -> (Tracker, RadioHead) {
    let scenario = Scenario::load("paper-real-odometry").unwrap();
    let LocalizerSettings::Tracker(settings) = scenario.localizer else {
        unreachable!("the scenario uses the tracker");
    };
    let heads: Vec<RadioHead> = scenario.radio_heads.iter().map(RadioHead::from).collect();
    let start = InitialPose {
        pose: Pose::default(),
        position_std_m: 0.5,
        heading_std_rad: 0.01,
    };
    let config = TrackerConfig::new(&scenario, &settings);
    let map = Arc::new(scenario.build_track().unwrap());
    let mut tracker = Tracker::new(config, Some(map), &heads, &start);
    assert_eq!(tracker.odometry(&sample(0.0, 0.0)), OdometryVerdict::First);
    assert_eq!(
        tracker.odometry(&sample(0.1, 0.4)),
        OdometryVerdict::Accepted
    );
    (tracker, heads[0])
}

fn sample(time_s: f64, distance_m: f64) -> OdometrySample {
    OdometrySample {
        time_s,
        distance_m,
        speed_mps: 4.0,
        yaw_rate_radps: None,
    }
}

fn angle(time_s: f64, phase_rad: f64, phase_sigma_rad: f64) -> AngleMeasurement {
    AngleMeasurement {
        time_s,
        phase_rad,
        phase_sigma_rad,
        angle_rad: 0.0,
        snr_db: 20.0,
        resolved: true,
    }
}

#[test]
fn bad_angles_are_named_and_leave_the_state() {
    let (mut tracker, head) = tracker();
    let before = tracker.clone();
    let stranger = RadioHead { pci: 999, ..head };
    let here = RadioHead {
        position: tracker.pose(0.1).pose.point(),
        ..head
    };
    let good = angle(0.12, 2.8, 0.01);
    for (head, measured, reason) in [
        (head, angle(0.12, f64::NAN, 0.01), UpdateReason::Unusable),
        (head, angle(f64::NAN, 2.8, 0.01), UpdateReason::Unusable),
        (head, angle(0.12, 2.8, f64::NAN), UpdateReason::Unusable),
        (head, angle(0.12, 2.8, -0.01), UpdateReason::Unusable),
        (head, angle(0.12, 2.8, 0.0), UpdateReason::Unusable),
        (head, angle(0.05, 2.8, 0.01), UpdateReason::TimeReversed),
        (head, angle(0.12, -1.0, 0.01), UpdateReason::Outlier),
        (stranger, good, UpdateReason::UnknownRadioHead),
    ] {
        let verdict = tracker.update(&head, &measured);
        assert_eq!(verdict.reason, reason);
        assert!(!verdict.accepted && verdict.threshold.is_some());
        assert_eq!(tracker, before);
    }
    tracker.set_excluded(&head, true);
    assert_eq!(tracker.update(&head, &good).reason, UpdateReason::Excluded);
    tracker.set_excluded(&head, false);
    assert!(
        tracker.update(&here, &good).accepted,
        "the survey counts, not the caller's place"
    );
    assert_ne!(tracker, before);
}

#[test]
fn an_angle_nobody_vouches_for_counts_as_far_as_it_is_likely() {
    let sure = angle(0.12, 0.0, 0.01);
    let after = |off_rad: f64, resolved: bool| {
        let (mut tracker, head) = tracker();
        // Where the tracker sees the head, and a little off.
        let residual_rad = tracker.innovation(&head, &sure).unwrap().residual;
        let measured = AngleMeasurement {
            phase_rad: off_rad - residual_rad,
            resolved,
            ..sure
        };
        let before = tracker.pose(0.12);
        let verdict = tracker.update(&head, &measured);
        assert_eq!(verdict.accepted, resolved || off_rad < 0.2);
        let moved_m = tracker
            .pose(0.12)
            .pose
            .point()
            .distance_m(before.pose.point());
        (moved_m, tracker.pose(0.12).principal_variances()[0])
    };
    // Close to where it is expected it is most likely right ...
    let ((sure_m, sure_m2), (unsure_m, unsure_m2)) = (after(0.1, true), after(0.1, false));
    assert!(
        unsure_m < sure_m && unsure_m > 0.8 * sure_m,
        "{unsure_m} {sure_m}"
    );
    assert!(unsure_m2 > sure_m2);
    // ... and far off, if within the gate, it says nothing.
    let ((sure_m, _), (unsure_m, _)) = (after(0.33, true), after(0.33, false));
    assert!(sure_m > 0.0);
    assert_eq!(unsure_m, 0.0);
}

#[test]
fn bad_odometry_is_named_and_leaves_the_state() {
    let (mut tracker, _) = tracker();
    let before = tracker.clone();
    for (sample, verdict) in [
        (sample(0.1, 0.4), OdometryVerdict::Duplicate),
        (sample(0.05, 0.3), OdometryVerdict::TimeBackwards),
        (sample(f64::NAN, 0.5), OdometryVerdict::NotFinite),
        (sample(0.2, f64::INFINITY), OdometryVerdict::NotFinite),
    ] {
        assert_eq!(tracker.odometry(&sample), verdict);
        assert_eq!(tracker, before);
    }
}

#[test]
fn beyond_the_end_of_the_map_it_drives_on_and_comes_back() {
    let scenario = Scenario::load("paper-real-odometry").unwrap();
    let length_m = scenario.build_track().unwrap().length_m();
    let (mut tracker, _) = tracker();
    let (mut beyond, mut before) = (0, [0.0; 2]);
    let across = |tracker: &Tracker, time_s: f64| tracker.pose(time_s).principal_variances();
    // Out to 60 m beyond the end and back again, backwards.
    let turn_s = (length_m + 60.0) / 4.0;
    for number in 6..(2.0 * turn_s / 0.02) as u32 {
        let time_s = 0.02 * f64::from(number);
        let place_m = 4.0 * (turn_s - (time_s - turn_s).abs());
        let verdict = tracker.odometry(&sample(time_s, place_m));
        assert!(verdict.accepted(), "{verdict:?}");
        if let OdometryVerdict::BeyondMap { by_m } = verdict {
            beyond += 1;
            assert!(
                (by_m - (place_m - length_m)).abs() < 1.0,
                "{by_m} {place_m}"
            );
            if beyond > 1 && time_s < turn_s {
                let now = across(&tracker, time_s);
                assert!(
                    now[0] >= before[0] && now[1] >= before[1],
                    "{now:?} {before:?}"
                );
            }
            before = across(&tracker, time_s);
        }
    }
    // Beyond the end from three deviations of the place (0.9 m of scale, 0.5 m of start) on.
    assert!(beyond > 2 * 50 * 13 && beyond < 2 * 50 * 15, "{beyond}");
    // Sixty metres without a lane, and the lane is kept again.
    let lane_m2 = across(&tracker, 2.0 * turn_s)[1];
    assert!(
        before[1] > 2.0 * lane_m2 && lane_m2 < 0.1_f64.powi(2),
        "{before:?} {lane_m2}"
    );
}

#[test]
fn a_gap_loses_time_and_a_jump_loses_certainty() {
    let (mut gap, _) = tracker();
    assert!(matches!(
        gap.odometry(&sample(2.1, 8.4)),
        OdometryVerdict::AfterGap { .. }
    ));
    let at_m = gap.pose(2.1).pose.x_m;
    assert!((at_m - 8.4).abs() < 0.05, "{at_m}");

    let (mut jump, _) = tracker();
    assert!(matches!(
        jump.odometry(&sample(2.1, 5000.0)),
        OdometryVerdict::DistanceJump { .. }
    ));
    // The counter is worthless, the speed is not: 2 s at 4 m/s.
    assert!((jump.pose(2.1).pose.x_m - 8.4).abs() < 0.05);
    let variance = |tracker: &Tracker| tracker.pose(2.1).principal_variances()[0];
    assert!(variance(&jump) > variance(&gap) + 1.0);
}

/// The array of a run at its end, by the same draws.
fn array_at_the_end(simulation: &Simulation, run: u64) -> ArrayDrift {
    let scenario = simulation.scenario();
    let streams = Streams::new(11, run);
    let track = scenario.build_track().unwrap();
    let vehicle = Vehicle::new(track, &scenario.motion, streams);
    let mut array = ArrayDrift::new(scenario.array, streams);
    for number in 0..simulation.steps() {
        array.advance(vehicle.at(simulation.time_s(number)).along_m);
    }
    array
}

#[test]
fn mounting_and_calibration_are_found_while_driving() {
    let runs = 16;
    for drifting in [0.0, 1.0] {
        let scenario = Scenario::load("paper-real-odometry-2")
            .unwrap()
            .with_overrides([
                ("array.mounting_error_std_rad", toml::Value::from(0.02)),
                ("array.phase_error_std_rad", 0.1.into()),
                (
                    "array.mounting_drift_rad_per_sqrt_m",
                    (5e-4 * drifting).into(),
                ),
                ("array.phase_drift_rad_per_sqrt_m", (2e-3 * drifting).into()),
            ])
            .unwrap();
        let simulation = Simulation::on_its_platform(scenario).unwrap();
        let mut normalised = [0.0; 2];
        for run in 0..runs {
            let record = simulation.run(11, run, Custom::default()).unwrap();
            let truth = array_at_the_end(&simulation, run);
            let Calibration { mounting, phase } = record.calibration.unwrap();
            for (sum, (found, truth)) in normalised.iter_mut().zip([
                (mounting, truth.mounting_rad()),
                (phase, truth.phase_error_rad()),
            ]) {
                let error = (found.by_rad - truth) / found.std_rad;
                // 64 draws are beyond four standard deviations with a probability of 0.4 %.
                assert!(error.abs() < 4.0, "{found:?} {truth}");
                assert!(found.std_rad < 0.5 * found.surveyed_std_rad, "{found:?}");
                *sum += error * error / runs as f64;
            }
            let holds = !record.calibration.unwrap().alarms();
            assert!(holds || drifting > 0.0, "{:?}", record.calibration);
        }
        // The mean of squared standard normals deviates by √(2/n).
        for mean in normalised {
            assert!(
                (mean - 1.0).abs() < 4.0 * (2.0 / runs as f64).sqrt(),
                "{mean}"
            );
        }
    }
}

#[test]
fn an_array_that_has_left_its_survey_is_noticed() {
    // Nobody is told: the survey is said to be good to 0.01 rad, and the array is far off it.
    let scenario = Scenario::load("paper-real-odometry-2")
        .unwrap()
        .with_overrides([
            ("array.phase_error_std_rad", toml::Value::from(0.3)),
            ("localizer.phase_std_rad", 0.01.into()),
            ("localizer.phase_walk_rad_per_sqrt_m", 0.01.into()),
        ])
        .unwrap();
    let simulation = Simulation::on_its_platform(scenario).unwrap();
    let mut noticed = 0;
    for run in 0..8 {
        let found = simulation.run(11, run, Custom::default()).unwrap();
        let off_rad = array_at_the_end(&simulation, run).phase_error_rad();
        let found = found.calibration.unwrap();
        // The alarm is for departures beyond 3 · (0.01 + σ); σ may err by four of itself.
        let limit_rad = 3.0 * (0.01 + found.phase.std_rad);
        if off_rad.abs() > limit_rad + 4.0 * found.phase.std_rad {
            assert!(found.alarms(), "{off_rad} {found:?}");
            noticed += 1;
        }
    }
    assert!(noticed >= 4, "{noticed}");
}

/// Mean squared error of each run, beside what its covariances predict (m²).
fn squares(records: &[RunRecord]) -> Vec<[f64; 2]> {
    let of_run = |record: &RunRecord| {
        let count = record.steps.len() as f64;
        let found: f64 = record.steps.iter().map(|step| step.error_m().powi(2)).sum();
        let predicted: f64 = record.steps.iter().filter_map(Step::predicted_m2).sum();
        [found / count, predicted / count]
    };
    records.iter().map(of_run).collect()
}

#[test]
fn a_gyroscope_helps_as_much_as_it_says() {
    for map in [true, false] {
        let without = Scenario::load("paper-real-odometry")
            .unwrap()
            .with_overrides([("localizer.map", map.into())])
            .unwrap();
        let mut with = without.clone();
        with.odometer.gyro = Some(access_av::scenario::GyroSettings {
            noise_rad_per_sqrt_s: 1e-3,
            bias_std_radps: 1e-3,
        });
        // The same drives, but for the gyroscope: what it takes from the squared error of a run.
        let [without, with] = [without, with].map(|scenario| squares(&drives(scenario, 32)));
        let gains = || {
            without
                .iter()
                .zip(&with)
                .map(|(a, b)| [a[0] - b[0], a[1] - b[1]])
        };
        let count = with.len() as f64;
        let found = gains().map(|gain| gain[0]).sum::<f64>() / count;
        let predicted = gains().map(|gain| gain[1]).sum::<f64>() / count;
        assert!(predicted > 0.0, "map {map}: {predicted}");
        let scatter = gains().map(|gain| (gain[0] - found).powi(2)).sum::<f64>();
        let deviation = (scatter / (count - 1.0) / count).sqrt();
        assert!(
            (found - predicted).abs() < 4.0 * deviation,
            "map {map}: {found} of {predicted} ± {deviation}"
        );
    }
}
