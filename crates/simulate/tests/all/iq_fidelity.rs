//! `fidelity = "iq"` agrees with `fidelity = "snapshots"`, and its receiver tracks the cells.

use crate::common;
use std::f64::consts::TAU;

use onboard::AngleResult;
use onboard::geometry::{Point, wrap_angle};
use onboard::settings::{Shipped, TomlFile};
use simulate::RunRecord;
use simulate::scenario::Scenario;
use toml::Value;

use crate::common::{changed, shipped, value};

/// Returns the first 80 m of the paper's drive with known pilots and an angle at every SSB.
fn scenario(fidelity: &str, k_db: f64, more: &[(&'static str, Value)]) -> Scenario {
    let mut overrides = vec![
        ("fidelity", Value::from(fidelity)),
        ("vehicle.receiver.pilots", Value::from("ssb")),
        (
            "vehicle.estimator.method",
            Value::from("maximum-likelihood"),
        ),
        ("vehicle.wake_up.policy", Value::from("fixed")),
        ("vehicle.wake_up.interval_ms", Value::from(1.0)),
        ("site.rician_k_db", Value::from(k_db)),
        ("channel.shadowing_std_db", Value::from(0.0)),
        (
            "site.road.segments",
            value("[{ length_m = 80.0, turn_rad = 0.1 }]"),
        ),
    ];
    overrides.extend(more.iter().cloned());
    changed("paper", overrides)
}

fn drive(scenario: &Scenario, run: u64) -> RunRecord {
    common::run(scenario, 3, run)
}

/// Error of the electrical angle of one SSB, and the standard deviation reported by the receiver.
#[derive(Debug, Clone, Copy)]
struct AngleError {
    driven_m: f64,
    error_rad: f64,
    sigma_rad: f64,
}

impl AngleError {
    fn normalised(&self) -> f64 {
        self.error_rad / self.sigma_rad
    }
}

/// Returns one error per SSB.
fn errors(scenario: &Scenario, record: &RunRecord) -> Vec<AngleError> {
    let [x_m, y_m, _] = scenario.site.radio_heads[0].position_m;
    let head = Point::new(x_m, y_m);
    let mut driven_m = vec![0.0];
    for pair in record.steps.windows(2) {
        let [from, to] = [&pair[0], &pair[1]].map(|step| step.truth.point());
        driven_m.push(driven_m[driven_m.len() - 1] + from.distance_m(to));
    }
    let of = |angle_result: &AngleResult| {
        let measured = angle_result.measured.unwrap();
        let step = (measured.time_s / scenario.site.ssb.period_s() + 1e-6).floor() as usize;
        let truth = record.steps[step].truth;
        let angle_rad = truth.point().bearing_rad(head) - truth.heading_rad;
        let phase_rad = TAU * scenario.vehicle.array.spacing_wavelengths * angle_rad.cos();
        AngleError {
            driven_m: driven_m[step],
            error_rad: wrap_angle(measured.phase_rad - phase_rad),
            sigma_rad: measured.phase_sigma_rad,
        }
    };
    record.aoa_estimates.iter().map(of).collect()
}

fn mean_square(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len() as f64;
    values.map(|value| value * value).sum::<f64>() / count
}

#[test]
fn noise_gives_equal_angle_errors_with_samples_and_snapshots() {
    // With noise only, the errors of different SSBs are independent.
    for pilots in ["ssb", "pss+sss", "pss"] {
        let by = |fidelity| {
            let more = [("vehicle.receiver.pilots", Value::from(pilots))];
            let scenario = scenario(fidelity, 60.0, &more);
            let record = drive(&scenario, 1);
            assert_eq!(record.aoa_estimates.len(), record.steps.len(), "{fidelity}");
            errors(&scenario, &record)
        };
        let (snapshots, iq) = (by("snapshots"), by("iq"));
        let relative =
            |errors: &[AngleError]| mean_square(errors.iter().map(AngleError::normalised));
        let sigma = |errors: &[AngleError]| mean_square(errors.iter().map(|it| it.sigma_rad));
        let square = |errors: &[AngleError]| mean_square(errors.iter().map(|it| it.error_rad));
        let ratio = square(&iq) / square(&snapshots);
        // The variance of n Gaussian errors has a relative standard deviation of √(2/n). The limit
        // is four standard deviations of the ratio.
        let bound = 4.0 * (4.0 / iq.len() as f64).sqrt();
        let sigmas = (sigma(&iq) / sigma(&snapshots)).sqrt();
        println!(
            "{pilots}: {} SSBs, variance ratio {ratio:.3} ± {bound:.3}, σ ratio {sigmas:.4}",
            iq.len()
        );
        assert!((ratio - 1.0).abs() < bound, "{pilots}: {ratio}");
        // Each variance matches the reported one, and both reported ones are equal, because the
        // converter and the timing change them by less than 2 %.
        for squares in [relative(&snapshots), relative(&iq)] {
            assert!((squares - 1.0).abs() < 0.05 + bound, "{pilots}: {squares}");
        }
        assert!((sigmas - 1.0).abs() < 0.02, "{pilots}: {sigmas}");
    }
}

#[test]
fn scatter_gives_equal_angle_errors_with_samples_and_snapshots() {
    // Rician K of 10 dB. Both fidelities use the same random streams, so that the errors of each
    // SSB are similar.
    let strong = [("site.radio_heads[0].eirp_dbm", Value::from(20.0))];
    let of = |fidelity| {
        let scenario = scenario(fidelity, 10.0, &strong);
        let errors = errors(&scenario, &drive(&scenario, 2));
        errors.iter().map(|it| it.error_rad).collect::<Vec<f64>>()
    };
    let (snapshots, iq) = (of("snapshots"), of("iq"));
    let pairs = snapshots.iter().zip(&iq);
    let difference = mean_square(pairs.map(|(a, b)| wrap_angle(a - b)));
    let expected = mean_square(snapshots.iter().copied());
    let ratio = mean_square(iq.iter().copied()) / expected;
    println!(
        "variance ratio {ratio:.3}, difference {:.4}",
        difference.sqrt()
    );
    assert!((ratio - 1.0).abs() < 0.1, "{ratio}");
    // The vehicle moves by a hundredth of a wavelength during an SSB.
    assert!(difference < 0.02 * expected);
}

#[test]
fn scatter_with_a_delay_spread_is_averaged_over_the_band_and_included_in_sigma() {
    let (k_db, spread_s, bandwidth_hz) = (5.0, 300e-9, 240.0 * 30e3);
    let of = |spread_ns: f64| {
        let more = [
            ("site.radio_heads[0].eirp_dbm", Value::from(0.0)),
            ("site.ssb.subcarrier_spacing_khz", Value::from(30.0)),
            ("channel.delay_spread_ns", Value::from(spread_ns)),
            ("channel.rays", Value::from(64)),
            // Every second SSB: successive ones are less than a wavelength apart.
            ("vehicle.wake_up.interval_ms", Value::from(40.0)),
        ];
        let scenario = scenario("iq", k_db, &more);
        let mut all = errors(&scenario, &drive(&scenario, 1));
        // Scatter is independent at a distance of one wavelength.
        let mut last_m = f64::NEG_INFINITY;
        all.retain(|error| {
            let far = error.driven_m >= last_m + scenario.site.wavelength_m();
            last_m = if far { error.driven_m } else { last_m };
            far
        });
        all
    };
    let (flat, spread) = (of(0.0), of(1e9 * spread_s));
    let square = |errors: &[AngleError]| mean_square(errors.iter().map(|it| it.error_rad));
    // Error variance due to scatter in a flat channel: 1/(2 K A) with A = N(N² − 1)/12. For a plain
    // sum over the band, it is multiplied by the mean of 1/(1 + j2πfτ) over all frequency
    // differences f.
    let once = 1.0 / (2.0 * 10f64.powf(0.1 * k_db) * 5.0);
    let x = TAU * bandwidth_hz * spread_s;
    let plain = once * (2.0 * x.atan() / x - (1.0 + x * x).ln() / (x * x));
    let normalised = mean_square(spread.iter().map(AngleError::normalised));
    println!(
        "{} SSBs: RMSE {:.4} rad flat, {:.4} at 300 ns, plain sum {:.4}; normalised {normalised:.3}",
        spread.len(),
        square(&flat).sqrt(),
        square(&spread).sqrt(),
        plain.sqrt(),
    );
    // The mean square of n Gaussian errors has a relative standard deviation of √(2/n). The limit
    // is four of them.
    let bound = 4.0 * (2.0 / spread.len() as f64).sqrt();
    assert!(square(&flat) > once * (1.0 - bound));
    assert!(square(&spread) < plain);
    assert!((normalised - 1.0).abs() < bound, "{normalised}");
}

#[test]
fn faults_have_equal_effects_on_samples_and_snapshots() {
    let fault = |what: &str| {
        value(&format!(
            "[{{ from_s = 0.0, until_s = 1e3, what = {what} }}]"
        ))
    };
    for what in [
        "{ kind = \"non-line-of-sight\", radio_head = 0, bias_rad = 0.6 }",
        "{ kind = \"moved-head\", radio_head = 0, by_m = [25.0, 0.0] }",
        "{ kind = \"stuck-antenna\", antennas = [2] }",
    ] {
        let of = |fidelity| {
            // A fault displaces every angle, so that half of the road suffices.
            let more = [
                ("faults", fault(what)),
                ("site.radio_heads[0].eirp_dbm", Value::from(20.0)),
                (
                    "site.road.segments",
                    value("[{ length_m = 40.0, turn_rad = 0.05 }]"),
                ),
            ];
            let scenario = scenario(fidelity, 60.0, &more);
            let errors = errors(&scenario, &drive(&scenario, 1));
            errors.iter().map(|it| it.error_rad).collect::<Vec<f64>>()
        };
        let (snapshots, iq) = (of("snapshots"), of("iq"));
        assert!(
            iq.len() * 100 > snapshots.len() * 95,
            "{what}: {}",
            iq.len()
        );
        let rms = |errors: &[f64]| mean_square(errors.iter().copied()).sqrt();
        println!("{what}: RMS {:.3} and {:.3} rad", rms(&snapshots), rms(&iq));
        // Without the fault, the noise alone gives some thousandths.
        assert!(rms(&iq) > 0.05, "{what}");
        assert!((rms(&iq) / rms(&snapshots) - 1.0).abs() < 0.05, "{what}");
    }
}

#[test]
fn several_cells_with_blind_snapshots_and_poor_hardware_are_located() {
    let two = value(
        "[{ position_m = [205.0, 100.0, 0.0], pci = 1, eirp_dbm = 10.0 }, \
         { position_m = [40.0, -60.0, 0.0], pci = 400, ssb_index = 3, eirp_dbm = 10.0 }]",
    );
    let more = [
        ("site.radio_heads", two),
        ("vehicle.receiver.pilots", Value::from("blind")),
        ("vehicle.estimator.method", Value::from("root-music")),
        ("site.ssb.subcarrier_spacing_khz", Value::from(30.0)),
        ("iq.oscillator_ppm", Value::from(1.0)),
        ("iq.adc_bits", Value::from(4)),
    ];
    let scenario = scenario("iq", 30.0, &more);
    let record = drive(&scenario, 4);
    for pci in [1, 400] {
        let received = record
            .aoa_estimates
            .iter()
            .filter(|it| it.ssb.pci == pci)
            .count();
        assert!(
            received * 100 > record.steps.len() * 99,
            "{pci}: {received} of {}",
            record.steps.len()
        );
    }
}

#[test]
fn samples_are_reproducible_and_differ_between_runs() {
    let short = value("[{ length_m = 10.0 }]");
    let scenario = scenario("iq", 20.0, &[("site.road.segments", short)]);
    let (a, b, c) = (
        drive(&scenario, 1),
        drive(&scenario, 1),
        drive(&scenario, 2),
    );
    assert_eq!(a, b);
    assert_ne!(a.aoa_estimates, c.aoa_estimates);
}

#[test]
fn unsupported_samples_are_rejected() {
    let scenario = shipped("paper");
    for (key, value) in [
        ("site.ssb.subcarrier_spacing_khz", Value::from(120.0)),
        ("site.radio_heads[0].ssb_index", Value::from(8)),
        ("iq.adc_bits", Value::from(0)),
        ("iq.oscillator_ppm", Value::from(1000.0)),
        // The delay spread exceeds a quarter of the cyclic prefix.
        ("channel.delay_spread_ns", Value::from(1200.0)),
    ] {
        let overrides = [("fidelity", Value::from("iq")), (key, value)];
        let error = scenario.with_overrides(overrides, &Shipped).unwrap_err();
        assert!(error.to_string().contains(key), "{error}");
    }
    let delays = [("channel.delay_spread_ns", Value::from(300.0))];
    let error = scenario.with_overrides(delays, &Shipped).unwrap_err();
    assert!(error.to_string().contains("fidelity"), "{error}");
}
