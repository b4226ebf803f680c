//! Delays, range rates and carrier phases in one filter: efficiency and consistency, cycle slips,
//! jumps of clocks, and kinds that are not configured.

use std::ops::Range;

use onboard::geometry::Pose;
use onboard::localize::ekf::{Ekf, EkfConfig};
use onboard::localize::{InitialPose, UpdateReason};
use onboard::observation::OdometrySample;
use onboard::range::{METRES_PER_NS, RangeMeasurement};

use crate::range_drive::{DELAYS, Fault, Model, PHASES, RATES, STEPS, Sums, drive, setup};

/// The filter reaches the bound with every kind, and its covariance is that of its errors.
fn reaches_the_bound(name: &str, model: &Model, runs: u64, consistent: Range<f64>) {
    let mut failed = Vec::new();
    for heads in [1, 2, 4] {
        let mut sums = Sums::default();
        for seed in 0..runs {
            drive(seed, heads, model, Fault::default(), &mut sums);
        }
        let [rms_m, ratio, nees] = sums.figures(runs);
        println!(
            "{heads} heads, {name}: RMS {rms_m:.3} m, bound {:.3} m, ratio {ratio:.3}, NEES/2 {nees:.3}, phases \
             continued {:.3}",
            rms_m / ratio,
            sums.continued()
        );
        if ratio > 1.1 || !consistent.contains(&nees) {
            failed.push((heads, ratio, nees));
        }
    }
    assert!(failed.is_empty(), "{failed:?}");
}

#[test]
fn delays_reach_the_bound() {
    reaches_the_bound("delays", &DELAYS, 500, 0.9..1.1);
}

/// Successive delays share their multipath over 20 m. As independent noise, it would be averaged over the delays of this
/// distance, and NEES/2 would be far above 1.
#[test]
fn multipath_that_successive_delays_share_is_not_averaged_as_noise() {
    const RUNS: u64 = 100;
    let model = Model {
        sigma_m: 0.2,
        scatter_m: 1.0,
        ..DELAYS
    };
    let mut sums = Sums::default();
    for seed in 0..RUNS {
        drive(seed, 4, &model, Fault::default(), &mut sums);
    }
    let [rms_m, _, nees] = sums.figures(RUNS);
    println!("RMS {rms_m:.3} m, NEES/2 {nees:.3}");
    assert!((0.5..1.5).contains(&nees), "{nees}");
}

/// The mean of 100 runs has a standard deviation of at most 0.1.
#[test]
fn range_rates_reach_the_bound() {
    reaches_the_bound("delays and rates", &RATES, 100, 0.85..1.15);
}

/// Phases of two radio heads have a NEES/2 of 1.33, because they are far more accurate than the
/// linearised distance.
#[test]
fn carrier_phases_reach_the_bound() {
    reaches_the_bound("delays, rates and phases", &PHASES, 100, 0.85..1.3);
}

const fn start() -> InitialPose {
    InitialPose {
        pose: Pose {
            x_m: 0.0,
            y_m: 0.0,
            heading_rad: 0.0,
        },
        position_std_m: 1.0,
        heading_std_rad: 0.1,
    }
}

/// Returns RMS error with a fault in the middle of the drive, relative to that without.
fn with_fault(model: &Model, fault: Fault) -> [f64; 2] {
    let mut sums = [Sums::default(), Sums::default()];
    for seed in 0..40 {
        drive(seed, 4, model, Fault::default(), &mut sums[0]);
        drive(seed, 4, model, fault, &mut sums[1]);
    }
    sums.map(|it| it.figures(40)[0])
}

const FAULT_STEP: i32 = STEPS / 2;

#[test]
fn a_clock_step_and_a_blocked_path_do_not_bias_the_position() {
    // 100 ns at the vehicle, and a first path that is blocked: 20 m longer.
    let step = Fault {
        at_step: FAULT_STEP,
        clock_m: 100.0 * METRES_PER_NS,
        ..Fault::default()
    };
    let blocked = Fault {
        at_step: FAULT_STEP,
        offset_m: 20.0,
        ..Fault::default()
    };
    for fault in [step, blocked] {
        let [usual_m, faulty_m] = with_fault(&RATES, fault);
        println!("usual {usual_m:.3} m, faulty {faulty_m:.3} m");
        assert!(faulty_m < 1.2 * usual_m, "{usual_m} {faulty_m}");
    }
}

#[test]
fn cycle_slip_begins_a_new_sequence() {
    // Half a cycle is the hardest slip of a receiver; a quarter results from a wrong symbol.
    for cycles in [0.5, 0.25] {
        let fault = Fault {
            at_step: FAULT_STEP,
            cycles,
            ..Fault::default()
        };
        let [usual_m, faulty_m] = with_fault(&PHASES, fault);
        println!("{cycles} cycles: usual {usual_m:.3} m, faulty {faulty_m:.3} m");
        assert!(faulty_m < 1.2 * usual_m, "{usual_m} {faulty_m}");
    }
}

#[test]
fn ranges_without_their_settings_are_unusable() {
    let (config, known) = setup(2, &DELAYS);
    let without = EkfConfig {
        ranging: None,
        ..config
    };
    let measured = RangeMeasurement::range(0.0, 30.0, Some(1.0));
    let mut ekf = Ekf::new(without, None, &known, &start());
    let before = *ekf.belief();
    let verdict = ekf.update_range(&known[0], &measured);
    assert_eq!(verdict.reason, UpdateReason::Unusable);
    assert_eq!(*ekf.belief(), before);

    let mut ekf = Ekf::new(config, None, &known, &start());
    let seconds = RangeMeasurement {
        sigma: Some(-1.0),
        ..measured
    };
    assert_eq!(
        ekf.update_range(&known[0], &seconds).reason,
        UpdateReason::Unusable
    );
    // 300 km off the prediction.
    let far = RangeMeasurement {
        value: 3e5,
        ..measured
    };
    assert_eq!(
        ekf.update_range(&known[0], &far).reason,
        UpdateReason::Outlier
    );
    assert!(ekf.update_range(&known[0], &measured).accepted);
    ekf.set_excluded(&known[1], true);
    assert_eq!(
        ekf.update_range(&known[1], &measured).reason,
        UpdateReason::Excluded
    );
}

#[test]
fn kinds_that_are_not_configured_are_unusable() {
    let (config, known) = setup(2, &DELAYS);
    let mut ekf = Ekf::new(config, None, &known, &start());
    ekf.odometry(&OdometrySample::of_speed(0.0, 0.0, None));
    for measured in [
        RangeMeasurement::range_rate(0.0, 0.1, 0.01, 0.02),
        RangeMeasurement::carrier_phase(0.0, 0.1, 0.01, 0.0857),
    ] {
        let verdict = ekf.update_range(&known[0], &measured);
        assert_eq!(verdict.reason, UpdateReason::Unusable);
    }
}
