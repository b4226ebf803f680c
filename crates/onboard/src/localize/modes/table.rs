//! Table of fault modes: possible faults, their prior probabilities, the difference of their
//! filters from the nominal one, and the transitions of their hypotheses. A mode is a row; an
//! additional mode needs a row and its test.

use crate::localize::ekf::{Ekf, EkfConfig, MAX_SLIP};
use crate::localize::output::SelectedHypothesis;
use crate::settings::{DriveKind, FaultProbability};

/// Part of a hypothesis that is retained when another filter becomes the nominal one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::localize) enum Carry {
    /// Filter and likelihood ratio.
    All,
    /// Filter and likelihood ratio, without the excluded radio head.
    AllButHead,
    /// Filter and likelihood ratio unless the angles contradict the mode; otherwise nothing.
    IfNotAgainst,
    /// Nothing: the hypothesis restarts from the nominal filter.
    Nothing,
}

/// Row of the table.
#[derive(Debug)]
pub(in crate::localize) struct Mode {
    pub id: SelectedHypothesis,
    /// Whether the mode is monitored, for a given nominal filter.
    pub applies: fn(&Ekf, &FaultProbability) -> bool,
    /// Prior probability.
    pub prior: fn(&EkfConfig, &FaultProbability) -> f64,
    /// Changes that turn a copy of the nominal filter into the filter of the mode.
    pub alter: fn(&mut Ekf),
    /// Adaptation of the filter to the measured variance of the angles, as a multiple of the
    /// specified one.
    pub adapt: fn(&mut Ekf, f64),
    /// Whether the mode is a fault; radio heads are then monitored for a second fault with the
    /// probability that no fault mode holds.
    pub is_fault: bool,
    /// Whether the mode is one of the odometry: it restarts when the odometry was at fault.
    pub is_of_odometry: bool,
    /// Restarts the filter at a possible onset of the fault: when the vehicle starts to move, or
    /// when its speed jumps by the given fraction.
    pub onset: Option<fn(&mut Ekf, f64)>,
    /// Part that is retained when a radio head is excluded.
    pub on_exclude: Carry,
    /// Part that is retained when another mode becomes the nominal one.
    pub on_rebase: Carry,
    /// Odds above which the mode becomes the nominal mode.
    pub becomes_nominal_at: Option<f64>,
    /// Whether the mode explains contradicting angles, so that they do not imply a lost vehicle.
    pub explains_contradictions: bool,
}

/// Default row.
const ROW: Mode = Mode {
    id: SelectedHypothesis::WheelSlip,
    applies: |_, _| true,
    prior: |_, _| 0.0,
    alter: |_| (),
    adapt: |_, _| (),
    is_fault: false,
    is_of_odometry: false,
    onset: None,
    on_exclude: Carry::Nothing,
    on_rebase: Carry::All,
    becomes_nominal_at: None,
    explains_contradictions: false,
};

const SLIP: Mode = Mode {
    id: SelectedHypothesis::WheelSlip,
    prior: |_, faults| faults.odometer,
    alter: |ekf| ekf.expect_slip(MAX_SLIP),
    is_fault: true,
    is_of_odometry: true,
    onset: Some(|ekf, jump| ekf.expect_slip(if jump > 0.0 { jump } else { MAX_SLIP })),
    on_exclude: Carry::AllButHead,
    on_rebase: Carry::IfNotAgainst,
    ..ROW
};

/// Modes, in the order of their filter updates.
pub(in crate::localize) static TABLE: [Mode; 6] = [
    SLIP,
    // If biases are estimated, a bias can also explain the effect of slip. The likelihood ratio
    // dominates this prior, and that of noisier angles, after a few angles.
    Mode {
        id: SelectedHypothesis::UncalibratedArray,
        applies: |nominal, _| {
            let config = nominal.config();
            config.unstated_array_std_rad != [0.0; 2]
        },
        prior: |_, _| 0.1,
        alter: Ekf::uncalibrate_array,
        becomes_nominal_at: Some(100.0),
        ..ROW
    },
    // Not for a differential drive, whose nominal noise includes slip over every metre.
    Mode {
        id: SelectedHypothesis::NoisyOdometer,
        applies: |nominal, _| {
            let config = nominal.config();
            config.drive == DriveKind::Road
        },
        // 90 times the probability of slip, at most 0.5.
        prior: |_, faults| (90.0 * faults.odometer).min(0.5),
        alter: |ekf| ekf.scale_odometer_noise(3.0),
        is_of_odometry: true,
        on_rebase: Carry::Nothing,
        ..ROW
    },
    // Without a map, the radio heads define the frame.
    Mode {
        id: SelectedHypothesis::DisplacedSite,
        applies: |nominal, faults| faults.site_frame_offset > 0.0 && nominal.has_map(),
        prior: |_, faults| faults.site_frame_offset,
        alter: |ekf| {
            ekf.uncalibrate_array();
            ekf.displace_site(1.5);
        },
        is_fault: true,
        on_exclude: Carry::All,
        ..ROW
    },
    // Any number of radio heads that are displaced or received by a reflection. Without estimated
    // biases, filters without one or two radio heads represent this fault.
    Mode {
        id: SelectedHypothesis::BiasedRadioHeads,
        applies: |nominal, _| nominal.is_with_bias(),
        prior: |_, faults| faults.of_radio_head(true),
        alter: Ekf::expect_persistent_biases,
        is_fault: true,
        on_exclude: Carry::AllButHead,
        ..ROW
    },
    Mode {
        id: SelectedHypothesis::NoisyAngles,
        applies: |nominal, _| !nominal.config().estimates_bias(),
        prior: |_, _| 0.02,
        alter: |ekf| ekf.set_noise_scale(Some(1.0)),
        adapt: |ekf, ratio| {
            let most = ekf.config().max_noise_scale();
            ekf.set_noise_scale(Some(ratio.min(most)));
        },
        on_rebase: Carry::Nothing,
        explains_contradictions: true,
        ..ROW
    },
];

/// Trip past four radio heads at 4 m/s, for tests.
#[cfg(test)]
pub(in crate::localize) mod trip {
    use std::sync::Arc;

    use crate::localize::ekf::{Ekf, EkfConfig};
    use crate::localize::output::InitialPose;
    use crate::observation::{AngleMeasurement, MeasurementKind};
    use crate::radio_head::RadioHead;
    use crate::road::Road;
    use crate::settings::{Shipped, Site, TomlFile, Vehicle};

    /// Standard deviation of the angles (rad).
    pub(in crate::localize) const SIGMA_RAD: f64 = 0.05;

    /// Returns the radio heads, the road, and the filter at the start, without bias estimation.
    pub(in crate::localize) fn trip() -> (Vec<RadioHead>, Road, Ekf) {
        trip_with_bias(0.0)
    }

    /// Returns the trip with a prior probability of a time-correlated bias.
    pub(in crate::localize) fn trip_with_bias(probability: f64) -> (Vec<RadioHead>, Road, Ekf) {
        let site = Site::from_library("trip-4", &Shipped).unwrap();
        let vehicle = Vehicle::from_library("paper-carrier", &Shipped).unwrap();
        let heads = RadioHead::received_by(&site, &vehicle);
        let road = site.build_road().unwrap().unwrap();
        let start = InitialPose {
            pose: road.pose(0.0),
            position_std_m: 0.1,
            heading_std_rad: 0.01,
        };
        let mut config = EkfConfig::new(&site, &vehicle);
        config.multipath_bias_probability = probability;
        let ekf = Ekf::new(config, Some(Arc::new(road.clone())), &heads, &start);
        (heads, road, ekf)
    }

    /// Returns an angle.
    pub(in crate::localize) const fn angle(time_s: f64, phase_rad: f64) -> AngleMeasurement {
        AngleMeasurement {
            kind: MeasurementKind::Angle,
            time_s,
            phase_rad,
            phase_sigma_rad: SIGMA_RAD,
            angle_rad: f64::NAN,
            snr_db: 20.0,
            resolved: true,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;
    use std::sync::Arc;

    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    use super::super::bank::Bank;
    use super::trip::{SIGMA_RAD, angle, trip, trip_with_bias};
    use super::*;
    use crate::localize::ekf::state::{ALONG, DATUM};
    use crate::localize::output::InitialPose;
    use crate::observation::{AngleMeasurement, OdometrySample};
    use crate::radio_head::RadioHead;
    use crate::settings::{IntegritySettings, Shipped, Site, TomlFile, Vehicle};

    /// Deviation of the simulated environment from the nominal model.
    #[derive(Default)]
    struct World {
        /// Rotation of the array (rad).
        turned_rad: f64,
        /// Displacement of all radio heads (m).
        moved_m: [f64; 2],
        /// Relative scale error of the odometer, and the time of its onset (s).
        scale: (f64, f64),
        /// Error of the yaw rate (rad/s), and the time of its onset (s); without an error, the yaw rate
        /// is not measured.
        yaw_rate: (f64, f64),
        /// Variance of the additional angle noise, relative to the specified variance.
        noise: f64,
        /// End of reception (s); 0 for none.
        received_until_s: f64,
        /// Prior probability of a bias.
        multipath_bias_probability: f64,
    }

    /// Final error of a filter (m).
    type Distance = Box<dyn Fn(&Ekf) -> f64>;

    /// Drives past four radio heads until `until_s`, with the additional angle error `off_rad` as a
    /// function of radio head and distance. Returns the bank, and the functions that yield the
    /// position errors of its selected filter and of a mode's filter.
    fn drive(world: &World, until_s: f64, off_rad: impl Fn(usize, f64) -> f64) -> (Bank, Distance) {
        let (heads, road, ekf) = trip_with_bias(world.multipath_bias_probability);
        let mut bank = Bank::new(&ekf, &heads, &IntegritySettings::default(), 0.0);
        let mut noise = ChaCha8Rng::seed_from_u64(1);
        let mut distance_m = 0.0;
        for step in 1..(10.0 * until_s) as u32 {
            let time_s = f64::from(step) * 0.1;
            let (scale, from_s) = world.scale;
            let reads = if time_s > from_s { 1.0 + scale } else { 1.0 };
            distance_m += 0.4 * reads;
            // The road is straight.
            let (error_radps, from_s) = world.yaw_rate;
            let yaw_rate_radps = if time_s > from_s { error_radps } else { 0.0 };
            bank.odometry(&OdometrySample {
                time_s,
                distance_m,
                speed_mps: 4.0 * reads,
                yaw_rate_radps: (error_radps != 0.0).then_some(yaw_rate_radps),
            });
            if world.received_until_s > 0.0 && time_s > world.received_until_s {
                continue;
            }
            let along_m = 4.0 * time_s;
            let truth = road.pose(along_m);
            for (number, head) in heads.iter().enumerate() {
                let place = head.position.moved(world.moved_m);
                let bearing_rad = truth.point().bearing_rad(place) - truth.heading_rad;
                let phase_rad = PI * (bearing_rad - world.turned_rad).cos();
                let predicted =
                    (bank.nominal()).predict_measurement(head, &angle(time_s, phase_rad));
                let seen = predicted.map(|it| bank.nominal().first_variance(&it));
                let variance = SIGMA_RAD * SIGMA_RAD + world.noise * seen.unwrap_or(0.0);
                let own_rad = variance.sqrt() * noise.sample::<f64, _>(StandardNormal);
                let phase_rad = phase_rad + off_rad(number, along_m) + own_rad;
                bank.update(head, &angle(time_s, phase_rad));
            }
        }
        let last_s = until_s - 0.1;
        let off_m = move |ekf: &Ekf| {
            let truth = road.pose(4.0 * last_s).point();
            ekf.pose(last_s).pose.point().distance_m(truth)
        };
        (bank, Box::new(off_m))
    }

    const EXACT: fn(usize, f64) -> f64 = |_, _| 0.0;

    #[test]
    fn the_nominal_mode_is_selected_without_a_fault() {
        let (bank, off_m) = drive(&World::default(), 60.0, EXACT);
        assert!(bank.selected() == SelectedHypothesis::Nominal && off_m(bank.leader()) < 0.3);
        let modes = TABLE.iter().filter_map(|it| bank.mode(it.id));
        assert!(modes.into_iter().all(|(odds, _)| odds < 0.1));
        assert!(!bank.nominal().odometer_departs());
    }

    #[test]
    fn an_uncalibrated_array_is_selected_and_not_a_fault() {
        let turned_rad = 0.02;
        let world = World {
            turned_rad,
            ..World::default()
        };
        let (bank, off_m) = drive(&world, 60.0, EXACT);
        assert_eq!(bank.selected(), SelectedHypothesis::UncalibratedArray);
        assert!(off_m(bank.leader()) < 0.3);
        // When its filter becomes the nominal one, there is no fault any more, but the hypothesis
        // is still reported.
        let bank = bank.about_leading().unwrap();
        assert!(
            bank.leading().is_none() && bank.mode(SelectedHypothesis::UncalibratedArray).is_none()
        );
        assert_eq!(bank.selected(), SelectedHypothesis::UncalibratedArray);
    }

    #[test]
    fn a_displaced_site_is_selected_and_is_a_fault() {
        let moved_m = [1.2, -1.6];
        let world = World {
            moved_m,
            ..World::default()
        };
        let (mut bank, off_m) = drive(&world, 60.0, EXACT);
        assert_eq!(bank.selected(), SelectedHypothesis::DisplacedSite);
        let [[xx, ..], [_, yy, _], _] = bank.leader().pose(59.9).covariance.unwrap();
        assert!(off_m(bank.leader()) < 3.0 * (xx + yy).sqrt());
        let found = *bank.leader().belief();
        for (state, moved_m) in DATUM.into_iter().zip(moved_m) {
            let by_m = found.mean[state] - moved_m;
            let std_m = found.covariance[state][state].sqrt();
            assert!(std_m < 0.3 && by_m.abs() < 4.0 * std_m, "{by_m} of {std_m}");
        }
        // The mode does not cause the exclusion of a radio head, and remains after an exclusion.
        bank.exclude(0);
        assert!(
            bank.selected() == SelectedHypothesis::DisplacedSite
                && *bank.leader().belief() == found
        );
    }

    #[test]
    fn noisier_angles_are_selected_and_not_a_fault() {
        let noise = 3.0;
        let world = World {
            noise,
            ..World::default()
        };
        let (bank, off_m) = drive(&world, 60.0, EXACT);
        assert_eq!(bank.selected(), SelectedHypothesis::NoisyAngles);
        let variance = |ekf: &Ekf| ekf.belief().covariance[ALONG][ALONG];
        assert!(variance(bank.leader()) > 2.0 * variance(bank.nominal()));
        assert!(off_m(bank.leader()) < 4.0 * variance(bank.leader()).sqrt());
    }

    #[test]
    fn angles_noisier_than_scatter_about_a_line_of_sight_are_not_averaged_as_noise() {
        let noise = 100.0;
        let world = World {
            noise,
            ..World::default()
        };
        let (bank, _) = drive(&world, 30.0, EXACT);
        assert!(bank.noise_scale() > 20.0);
        let (_, noisy) = bank.mode(SelectedHypothesis::NoisyAngles).unwrap();
        // Relative to the specified K of 10 dB.
        assert!((noisy.config().noise_scale() - 10.0).abs() < 1e-9);
    }

    #[test]
    fn the_hypothesis_of_a_noisy_odometer_has_nine_times_the_variance() {
        let world = World {
            received_until_s: 1e-3,
            ..World::default()
        };
        let (bank, _) = drive(&world, 10.2, EXACT);
        let driven_m = bank.nominal().driven_m();
        let own_variance = driven_m * bank.nominal().config().noise.odometer_m_per_sqrt_m.powi(2);
        let variance = |ekf: &Ekf| ekf.belief().covariance[ALONG][ALONG];
        let (_, noisier) = bank.mode(SelectedHypothesis::NoisyOdometer).unwrap();
        let more = variance(noisier) - variance(bank.nominal());
        assert!((more / (8.0 * own_variance) - 1.0).abs() < 0.01, "{more}");
    }

    #[test]
    fn a_scale_error_of_20_standard_deviations_is_reported() {
        let (_, _, ekf) = trip();
        for (deviations, departs) in [(1.0, false), (20.0, true)] {
            let scale = (deviations * ekf.config().odometer_scale_std, 0.0);
            let (bank, _) = drive(
                &World {
                    scale,
                    ..World::default()
                },
                60.0,
                EXACT,
            );
            assert_eq!(bank.nominal().odometer_departs(), departs, "{deviations}");
        }
    }

    #[test]
    fn slip_since_the_start_is_detected_and_a_sound_odometer_is_not() {
        let odds = |scale| {
            let scale = (scale, 0.0);
            let (bank, _) = drive(
                &World {
                    scale,
                    ..World::default()
                },
                30.0,
                EXACT,
            );
            bank.mode(SelectedHypothesis::WheelSlip).unwrap().0
        };
        assert!(odds(0.0) < 1e-3);
        assert!(odds(0.2) > 100.0);
        assert!(odds(-0.2) > 100.0);
    }

    #[test]
    fn a_wrong_yaw_rate_is_a_fault_of_the_odometry() {
        for error_radps in [-0.1, 0.1, 0.3] {
            let world = World {
                yaw_rate: (error_radps, 20.0),
                ..World::default()
            };
            let (bank, off_m) = drive(&world, 24.0, EXACT);
            let (odds, faulty) = bank.mode(SelectedHypothesis::WheelSlip).unwrap();
            assert!(odds > 1.0, "{error_radps}: {odds}");
            let [[xx, ..], [_, yy, _], _] = faulty.pose(23.9).covariance.unwrap();
            let off_m = off_m(faulty);
            assert!(off_m < 4.0 * (xx + yy).sqrt(), "{error_radps}: {off_m}");
        }
    }

    #[test]
    fn a_restarted_bank_uses_the_specified_values_for_any_selected_hypothesis() {
        let world = World {
            scale: (0.2, 0.0),
            ..World::default()
        };
        let (bank, _) = drive(&world, 30.0, EXACT);
        assert_eq!(bank.selected(), SelectedHypothesis::WheelSlip);
        let again = bank.restarted(1.0, 30.0).restarted(1.0, 30.0);
        assert_eq!(again.nominal().config(), trip().2.config());
    }

    #[test]
    fn a_speed_jump_is_treated_as_slip_before_the_next_angle() {
        for scale in [-0.1, 0.1] {
            let world = World {
                scale: (scale, 20.0),
                received_until_s: 20.0,
                ..World::default()
            };
            let (bank, off_m) = drive(&world, 30.0, EXACT);
            let (odds, slip) = bank.mode(SelectedHypothesis::WheelSlip).unwrap();
            assert!(odds > 0.1, "{odds}");
            let covariance = slip.pose(29.9).covariance.unwrap();
            let std_m = (covariance[0][0] + covariance[1][1]).sqrt();
            // The standard deviation of the slip equals the size of the jump.
            assert!(
                (off_m(slip) / std_m - 1.0).abs() < 0.3,
                "{} of {std_m}",
                off_m(slip)
            );
        }
    }

    /// Prior probability of multipath as a nominal condition.
    const MULTIPATH: f64 = 0.9;

    /// Drives with a bias of each radio head that changes after a distance, as with reflections. Returns the bank, and the
    /// error of its selected filter in metres and as a multiple of the standard deviation.
    fn drive_with_reflections(distance_m: f64, seed: u64) -> (Bank, f64, f64) {
        let bias_rad = |head: usize, along_m: f64| {
            let number = (along_m / distance_m).floor() as u64 * 4 + head as u64;
            let mut random = ChaCha8Rng::seed_from_u64(1_000_000 * seed + number);
            0.3 * random.sample::<f64, _>(StandardNormal)
        };
        let world = World {
            multipath_bias_probability: MULTIPATH,
            ..World::default()
        };
        let (bank, off_m) = drive(&world, 60.0, bias_rad);
        let [[xx, ..], [_, yy, _], _] = bank.leader().pose(59.9).covariance.unwrap();
        let error_m = off_m(bank.leader());
        (bank, error_m, error_m / (xx + yy).sqrt())
    }

    #[test]
    fn a_bias_that_changes_every_metre_is_not_a_fault() {
        for seed in 0..5 {
            let (bank, _, error) = drive_with_reflections(1.0, seed);
            assert_eq!(bank.selected(), SelectedHypothesis::Nominal, "{seed}");
            assert!(error < 4.0 && !bank.is_lost(), "{seed}: {error}");
        }
    }

    /// A bias that is constant over three metres is between the multipath bias and the persistent bias.
    #[test]
    fn a_bias_that_changes_every_three_metres_does_not_lose_the_vehicle() {
        let (bank, error_m, error) = drive_with_reflections(3.0, 0);
        assert!(error < 4.0 && error_m < 1.0, "{error_m} m, {error}");
        assert!(!bank.is_lost());
    }

    /// The biases of all radio heads could also explain a displaced site plan.
    #[test]
    fn a_displaced_site_is_selected_although_biases_are_estimated() {
        let moved_m = [1.2, -1.6];
        let world = World {
            moved_m,
            multipath_bias_probability: MULTIPATH,
            ..World::default()
        };
        let (bank, off_m) = drive(&world, 60.0, EXACT);
        assert_eq!(bank.selected(), SelectedHypothesis::DisplacedSite);
        let [[xx, ..], [_, yy, _], _] = bank.leader().pose(59.9).covariance.unwrap();
        assert!(off_m(bank.leader()) < 4.0 * (xx + yy).sqrt());
        assert!(off_m(bank.leader()) < off_m(bank.nominal()));
    }

    /// One or three of four radio heads are received by a reflection from half-way on. The jump process alone averages
    /// such a bias like noise.
    #[test]
    fn persistent_biases_of_radio_heads_are_selected_and_are_a_fault() {
        for biased in [1, 3] {
            let bias_rad = |head: usize, along_m: f64| {
                let is_biased = head < biased && along_m > 120.0;
                if is_biased { 0.3 } else { 0.0 }
            };
            let world = World {
                multipath_bias_probability: MULTIPATH,
                ..World::default()
            };
            let (bank, off_m) = drive(&world, 60.0, bias_rad);
            assert_eq!(
                bank.selected(),
                SelectedHypothesis::BiasedRadioHeads,
                "{biased}"
            );
            let [[xx, ..], [_, yy, _], _] = bank.leader().pose(59.9).covariance.unwrap();
            assert!(off_m(bank.leader()) < 4.0 * (xx + yy).sqrt());
        }
    }

    /// Angles with independent errors at 50 Hz, on a straight road far from the radio heads,
    /// contain almost no information about slip. Correct odds exceed four times the prior in at
    /// most a quarter of the runs (Ville's inequality). Odds that count dependent angles exceeded
    /// it by a factor of 260.
    #[test]
    fn frequent_angles_of_a_sound_odometer_are_no_evidence_for_slip() {
        const SCATTER_RAD: f64 = 0.03;
        const ACCELERATION_MPS2: f64 = 0.5;
        let mut site = Site::from_library("yard", &Shipped).unwrap();
        site.rician_k_db = 20.0;
        let vehicle = Vehicle::from_library("carrier", &Shipped).unwrap();
        let heads = RadioHead::received_by(&site, &vehicle);
        let road = site.build_road().unwrap().unwrap();
        let start = InitialPose {
            pose: road.pose(0.0),
            position_std_m: 0.3,
            heading_std_rad: 0.03,
        };
        let config = EkfConfig::new(&site, &vehicle);
        let settings = IntegritySettings::default();
        let prior = settings.fault_probability.odometer;
        for seed in 1..=3 {
            let ekf = Ekf::new(config, Some(Arc::new(road.clone())), &heads, &start);
            let mut bank = Bank::new(&ekf, &heads, &settings, 0.0);
            let mut noise = ChaCha8Rng::seed_from_u64(seed);
            let mut most: f64 = 0.0;
            for step in 0..500 {
                let time_s = 0.02 * f64::from(step);
                let speed_mps = (ACCELERATION_MPS2 * time_s).min(4.0);
                let distance_m = speed_mps * (time_s - 0.5 * speed_mps / ACCELERATION_MPS2);
                bank.odometry(&OdometrySample {
                    time_s,
                    distance_m,
                    speed_mps,
                    yaw_rate_radps: None,
                });
                let truth = road.pose(distance_m);
                for head in &heads {
                    let bearing_rad = truth.point().bearing_rad(head.position) - truth.heading_rad;
                    let ahead = bearing_rad.cos() * truth.point().distance_m(head.position)
                        / head.distance_m(truth.point(), config.array.position_m[2]);
                    let scatter_rad = SCATTER_RAD * noise.sample::<f64, _>(StandardNormal);
                    let measured = AngleMeasurement {
                        phase_sigma_rad: 0.001,
                        ..angle(time_s, PI * ahead + scatter_rad)
                    };
                    bank.update(head, &measured);
                }
                most = most.max(bank.mode(SelectedHypothesis::WheelSlip).unwrap().0);
            }
            assert!(most < 4.0 * prior, "{seed}: {most}");
        }
    }
}
