//! The tracker on simulated drives.

use onboard::settings::{ArraySettings, GyroscopeSettings};
use simulate::bound::Bound;
use simulate::random::Streams;
use simulate::truth::World;
use simulate::{Campaign, RunRecord, Simulation, Step};
use toml::Value;

use crate::common::{NONE, campaign, changed, drives, simulation, unguarded, value};
use crate::statistics::{CampaignStatistics, Consistency};

const SEED: u64 = 11;

/// Returns the mean normalised squared error of the position (NEES) and the RMS error.
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

/// Returns the mean and standard deviation of a statistic over campaigns.
fn spread(campaigns: &[Consistency], figure: fn(&Consistency) -> f64) -> (f64, f64) {
    let count = campaigns.len() as f64;
    let mean = campaigns.iter().map(figure).sum::<f64>() / count;
    let square: f64 = campaigns.iter().map(|it| (figure(it) - mean).powi(2)).sum();
    (mean, (square / (count - 1.0)).sqrt())
}

#[test]
fn tracker_is_consistent_and_efficient() {
    let (runs, campaigns) = (32, 200);
    for (name, target_p90_m) in [
        ("paper-real-odometry", 0.40),
        ("paper-real-odometry-2", 0.26),
        ("paper-real-odometry-4", 0.20),
    ] {
        let scenario = unguarded(name);
        let bound = Bound::new(&scenario).unwrap();
        let points = bound.along_route();
        let square_m2: f64 = points.iter().map(|p| p.position_rms_m.powi(2)).sum();
        let bound_m = (square_m2 / points.len() as f64).sqrt();

        // Spread of an ideal filter with the tracker's covariances in campaigns of this size.
        let filter = bound.ideal_filter(50);
        let ideal: Vec<Consistency> = (0..campaigns)
            .map(|seed| filter.campaign(seed, runs).consistency(1))
            .collect();
        let (p90_m, p90_spread_m) = spread(&ideal, |it| it.p90_m);
        let (rms_m, rms_spread_m) = spread(&ideal, |it| it.rms_m);
        let (nees, nees_spread) = spread(&ideal, |it| it.mean_nees);
        // The ideal filter meets the requirement. Its mean has a standard error of
        // spread/√campaigns.
        let certain = 4.0 / (campaigns as f64).sqrt();
        assert!(
            p90_m + certain * p90_spread_m < target_p90_m,
            "{name}: {p90_m} m"
        );
        assert!(
            rms_m + certain * rms_spread_m < 1.10 * bound_m,
            "{name}: {rms_m} {bound_m}"
        );

        // The tracker's statistics are within the spread of the ideal filter.
        let found = campaign(&scenario, SEED, runs as usize).consistency(50);
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
fn a_start_error_of_five_metres_is_corrected_efficiently() {
    let (runs, campaigns, stride) = (48, 100, 50);
    for (map, heading_std_rad) in [(true, 0.0), (false, 0.02)] {
        let scenario = changed(
            "paper-real-odometry-2",
            [
                ("vehicle.start.position_std_m", Value::from(5.0)),
                ("vehicle.start.heading_std_rad", heading_std_rad.into()),
                ("vehicle.localizer.map", map.into()),
            ],
        );
        let bound = Bound::new(&scenario).unwrap();
        let points = bound.along_route();
        // Every 50th step after 20 m of travel.
        let ratios = |campaign: &Campaign, stride: usize| -> Vec<f64> {
            (campaign.steps.iter().step_by(stride))
                .zip(points.iter().step_by(50))
                .filter(|(_, point)| point.along_m >= 20.0)
                .map(|(step, point)| step.rms_error_m / point.position_rms_m)
                .collect()
        };
        let mean = |ratios: &[f64]| ratios.iter().sum::<f64>() / ratios.len() as f64;
        let largest = |ratios: &[f64]| ratios.iter().copied().fold(0.0, f64::max);

        // The RMS error of the ideal filter is within 1.2 times the bound at every step.
        let filter = bound.ideal_filter(stride);
        let ideal: Vec<Vec<f64>> = (0..campaigns)
            .map(|seed| ratios(&filter.campaign(seed, runs), 1))
            .collect();
        for step in 0..ideal[0].len() {
            let squares = ideal.iter().map(|ratios| ratios[step].powi(2));
            let ratio = (squares.sum::<f64>() / campaigns as f64).sqrt();
            assert!(ratio < 1.2, "step {step}: {ratio}");
        }

        // The mean and the largest ratio of the tracker are within four standard deviations of
        // those of the ideal filter.
        let found = ratios(&campaign(&scenario, SEED, runs as usize), stride);
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
        let bound = Bound::new(&unguarded(name)).unwrap().along_route();
        bound.iter().map(|p| p.position_rms_m).sum::<f64>() / bound.len() as f64
    });
    assert!(
        rms_m[0] > 1.3 * rms_m[1] && rms_m[1] > 1.2 * rms_m[2],
        "{rms_m:?}"
    );
}

#[test]
fn the_site_bound_is_large_on_the_line_through_two_heads() {
    let scenario = unguarded("paper-real-odometry-2");
    let bound = Bound::new(&scenario).unwrap();
    let between = bound.at([150.0, 10.0].into(), 50.0, 0.01).unwrap();
    // Far away on the line through both radio heads, their angles carry equal information.
    let beyond = bound.at([785.0, 820.0].into(), 50.0, 0.01);
    assert!(
        beyond.is_none_or(|rms_m| rms_m > 20.0 * between),
        "{between} {beyond:?}"
    );
}

#[test]
fn errors_without_a_map_are_consistent() {
    let no_map = [("vehicle.localizer.map", false.into())];
    let scenario = changed("paper-real-odometry-4", no_map);
    let runs = 12;
    let (nees, _) = consistency(&drives(&scenario, SEED, runs));
    assert!(
        (nees / 2.0 - 1.0).abs() < 4.0 / (runs as f64).sqrt(),
        "{nees}"
    );
}

#[test]
fn a_campus_is_driven_across_several_cells() {
    let records = drives(&unguarded("campus-handover"), SEED, 1);
    let mut cells: Vec<u16> = records[0]
        .aoa_estimates
        .iter()
        .filter(|angle_result| angle_result.verdict.accepted)
        .map(|angle_result| angle_result.ssb.pci)
        .collect();
    cells.sort_unstable();
    cells.dedup();
    assert!(cells.len() >= 6, "{cells:?}");
    let last = records[0].steps.last().unwrap();
    assert!(last.truth.point().distance_m(last.estimate.point()) < 2.0);
}

/// Returns the true array at the end of a run, with the same random numbers.
fn array_at_the_end(simulation: &Simulation, run: u64) -> ArraySettings {
    let world = World::new(simulation.scenario()).unwrap();
    let mut truth = world.draw(Streams::new(SEED, run));
    for number in 0..simulation.steps() {
        let along_m = truth.path.at(simulation.time_s(number)).along_m;
        truth.array.advance(along_m);
    }
    truth.array.settings().clone()
}

#[test]
fn mounting_and_calibration_are_estimated_while_driving() {
    let runs = 16;
    for drifting in [0.0, 1.0] {
        let scenario = changed(
            "paper-real-odometry-2",
            [
                ("vehicle.array.mounting_std_rad", Value::from(0.02)),
                ("vehicle.array.phase_std_rad", 0.1.into()),
                (
                    "vehicle.array.mounting_drift_rad_per_sqrt_m",
                    (5e-4 * drifting).into(),
                ),
                (
                    "vehicle.array.phase_drift_rad_per_sqrt_m",
                    (2e-3 * drifting).into(),
                ),
            ],
        );
        let simulation = simulation(&scenario);
        let mut normalised = [0.0; 2];
        for run in 0..runs {
            let record = simulation.run(SEED, run, NONE).unwrap();
            let truth = array_at_the_end(&simulation, run);
            let found = record.constants.unwrap();
            for (sum, (found, truth)) in normalised.iter_mut().zip([
                (found.mounting_rad, truth.mounting_rad),
                (found.phase_rad, truth.phase_rad),
            ]) {
                let error = (found.departure() - truth) / found.std;
                // The probability that any of 64 values exceeds four standard deviations is 0.4 %.
                assert!(error.abs() < 4.0, "{found:?} {truth}");
                assert!(found.std < 0.5 * found.stated_std, "{found:?}");
                *sum += error * error / runs as f64;
            }
            let holds = !found.array_departs();
            assert!(holds || drifting > 0.0, "{found:?}");
        }
        // The mean of n squared standard normal numbers has a standard deviation of √(2/n).
        for mean in normalised {
            assert!(
                (mean - 1.0).abs() < 4.0 * (2.0 / runs as f64).sqrt(),
                "{mean}"
            );
        }
    }
}

#[test]
fn an_array_that_deviates_from_its_survey_is_reported() {
    // The specified standard deviation of the survey is 0.01 rad; the true deviation is far larger.
    let scenario = changed(
        "paper-real-odometry-2",
        [
            ("vehicle.array.phase_std_rad", Value::from(0.01)),
            ("vehicle.array.phase_drift_rad_per_sqrt_m", 0.01.into()),
            ("truth.vehicle.array.phase_std_rad", 0.3.into()),
            ("truth.vehicle.array.phase_drift_rad_per_sqrt_m", 0.0.into()),
        ],
    );
    let simulation = simulation(&scenario);
    let mut noticed = 0;
    for run in 0..8 {
        let found = simulation.run(SEED, run, NONE).unwrap();
        let off_rad = array_at_the_end(&simulation, run).phase_rad;
        let found = found.constants.unwrap();
        // The warning is for deviations above 3 · (0.01 + σ). The estimate may err by 4 σ.
        let limit_rad = 3.0 * (0.01 + found.phase_rad.std);
        if off_rad.abs() > limit_rad + 4.0 * found.phase_rad.std {
            assert!(found.array_departs(), "{off_rad} {found:?}");
            noticed += 1;
        }
    }
    assert!(noticed >= 4, "{noticed}");
}

/// Returns the mean squared error of each run and its predicted value (m²).
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
fn a_gyroscope_reduces_the_error_as_predicted() {
    for map in [true, false] {
        let map_or_none = [("vehicle.localizer.map", map.into())];
        let without = changed("paper-real-odometry", map_or_none);
        let mut with = without.clone();
        with.vehicle.gyroscope = Some(GyroscopeSettings {
            noise_rad_per_sqrt_s: 1e-3,
            bias_radps: 0.0,
            bias_std_radps: 1e-3,
            bias_walk_radps_per_sqrt_s: 0.0,
        });
        // Equal runs with and without the gyroscope: reduction of the squared error per run.
        let [without, with] = [without, with].map(|scenario| squares(&drives(&scenario, SEED, 32)));
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

#[test]
fn multiplicative_odometer_noise_does_not_override_the_yaw_rate() {
    // The error of each sample is half of the increment. An increment that is too small must not
    // get a smaller variance, and noise must not be mistaken for an offset.
    let scenario = changed(
        "yard",
        [
            ("motion", value("{}")),
            (
                "site.road",
                value("{ segments = [{ length_m = 40.0, turn_rad = -1.33 }] }"),
            ),
            ("vehicle.top_speed_kmh", value("3.0")),
            ("vehicle.lane_keeping.rms_m", value("0.1")),
            ("vehicle.lane_keeping.wavelength_m", value("120.0")),
            (
                "vehicle.odometer",
                value("{ rate_hz = 100.0, scale_std = 0.02, noise_m_per_sqrt_m = 0.05 }"),
            ),
            (
                "vehicle.gyroscope",
                value("{ noise_rad_per_sqrt_s = 1e-4, bias_std_radps = 1e-3 }"),
            ),
            (
                "vehicle.wake_up",
                value("{ policy = \"fixed\", interval_ms = 60000.0 }"),
            ),
        ],
    );
    let runs = 12;
    let squares = drives(&scenario, SEED, runs).into_iter().map(|record| {
        let step = record.steps.last().unwrap();
        let error_m = step.estimate.point().distance_m(step.truth.point());
        let [[xx, ..], [_, yy, _], _] = step.covariance.unwrap();
        error_m * error_m / (xx + yy)
    });
    // Only the position along the road is uncertain, because the bend determines the lateral
    // position. The sum of χ² variables with one degree of freedom each is below its quantile of 1
    // − 1e-4.
    let sum: f64 = squares.sum();
    assert!(sum < 39.1, "{sum} of {runs} runs");
}
