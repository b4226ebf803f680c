//! Delays, range rates and carrier phases of all radio heads in one filter: efficiency and
//! consistency, cycle slips, and jumps of clocks.

use std::fmt::Write as _;

use onboard::geometry::Pose;
use onboard::localize::ekf::{Ekf, EkfConfig};
use onboard::localize::{InitialPose, UpdateReason};
use onboard::observation::OdometrySample;
use onboard::radio_head::RadioHead;
use onboard::range::{METRES_PER_NS, RangeMeasurement};
use onboard::settings::{Shipped, Site, TomlFile, Vehicle};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

const STEP_S: f64 = 0.1;
const SPEED_MPS: f64 = 1.5;
const YAW_RATE_RADPS: f64 = 0.1;
const STEPS: i32 = 300;

const ODOMETER_NOISE: f64 = 0.01;
const SCALE_STD: f64 = 0.01;
const GYROSCOPE_NOISE: f64 = 0.002;
const BIAS_STD_RADPS: f64 = 0.001;
const START_STD_M: f64 = 0.3;
const HEADING_STD_RAD: f64 = 0.03;
const SPEED_NOISE_MPS: f64 = 0.02;

const SIGMA_M: f64 = 1.0;
const OFFSET_STD_M: f64 = 2.0;
const CLOCK_STD_NS: f64 = 100.0;
const DRIFT_STD_PPB: f64 = 20.0;
const DRIFT_WALK_PPB: f64 = 0.05;
const FREQUENCY_STD_PPB: f64 = 5.0;
const PHASE_SIGMA_M: f64 = 0.002;
const PHASE_WALK: f64 = 0.005;

#[derive(Clone, Copy)]
struct Kinds {
    rate: bool,
    phase: bool,
}

impl Kinds {
    /// Returns the random walk of the vehicle clock (ns/√s): with carrier phases, that of an OCXO.
    const fn wander_ns(self) -> f64 {
        if self.phase { 0.003 } else { 0.1 }
    }

    /// Returns the standard deviation of a range rate (m/s) and its time interval (s): that of a
    /// phase difference; with carrier phases, that of the measurement within an SSB.
    const fn rate(self) -> [f64; 2] {
        if self.phase {
            [0.3, 2e-4]
        } else {
            [0.02, 0.02]
        }
    }
}

fn setup(heads: usize, kinds: Kinds) -> (EkfConfig, Vec<RadioHead>) {
    let mut site = String::from("name = \"hall\"\n");
    let corners = [[-25.0, -20.0], [30.0, 25.0], [-20.0, 30.0], [28.0, -22.0]];
    for (pci, [x, y]) in corners.iter().take(heads).enumerate() {
        writeln!(
            site,
            "[[radio_heads]]\npci = {pci}\nposition_m = [{x:?}, {y:?}, 4.0]\n\
             clock_offset_std_ns = 0.0\nclock_wander_ns_per_sqrt_s = 0.0\n\
             clock_frequency_std_ppb = {FREQUENCY_STD_PPB:?}"
        )
        .unwrap();
    }
    let (Kinds { rate, phase }, wander_ns) = (kinds, kinds.wander_ns());
    let vehicle = format!(
        "name = \"robot\"\ndrive = \"differential\"\nintegrity = {{ enabled = false }}\n\
         acceleration_mps2 = 0.01\n\
         [odometer]\nnoise_m_per_sqrt_m = {ODOMETER_NOISE}\nnoise_m_per_sqrt_s = 1e-6\n\
         scale_std = {SCALE_STD}\nspeed_noise_mps = {SPEED_NOISE_MPS}\n\
         [gyroscope]\nnoise_rad_per_sqrt_s = {GYROSCOPE_NOISE}\nbias_std_radps = {BIAS_STD_RADPS}\n\
         [ranging]\nkind = \"one-way\"\nsigma_m = {SIGMA_M:?}\noffset_std_m = {OFFSET_STD_M:?}\n\
         offset_walk_m_per_sqrt_m = 0.0\nclock_offset_std_ns = {CLOCK_STD_NS:?}\n\
         clock_drift_std_ppb = {DRIFT_STD_PPB:?}\nclock_wander_ns_per_sqrt_s = {wander_ns}\n\
         clock_drift_walk_ppb_per_sqrt_s = {DRIFT_WALK_PPB}\nposition_m = [0.0, 0.0, 1.0]\n\
         range_rate = {rate}\ncarrier_phase = {phase}\n"
    );
    let site = Site::from_toml(&site, "site", &Shipped).unwrap();
    let vehicle = Vehicle::from_toml(&vehicle, "vehicle", &Shipped).unwrap();
    (
        EkfConfig::new(&site, &vehicle),
        RadioHead::received_by(&site, &vehicle),
    )
}

const CLOCK: usize = 5;
const DRIFT: usize = 6;
const YAW_SCALE: usize = 7;
const OFFSET: usize = 8;

/// Covariance recursion of a linear filter at the true trajectory: the posterior Cramér–Rao bound.
/// States: x, y, heading, odometer scale, yaw rate bias, clock, drift, yaw rate scale, then offset,
/// rate offset and phase offset of each radio head.
struct Bound {
    heads: usize,
    covariance: Vec<Vec<f64>>,
}

impl Bound {
    fn new(heads: usize, yaw_scale_std: f64) -> Self {
        let count = OFFSET + 3 * heads;
        let mut covariance = vec![vec![0.0; count]; count];
        let mut stds = vec![
            START_STD_M,
            START_STD_M,
            HEADING_STD_RAD,
            SCALE_STD,
            BIAS_STD_RADPS,
            METRES_PER_NS * CLOCK_STD_NS,
            METRES_PER_NS * DRIFT_STD_PPB,
            yaw_scale_std,
        ];
        stds.extend(vec![OFFSET_STD_M; heads]);
        stds.extend(vec![METRES_PER_NS * FREQUENCY_STD_PPB; heads]);
        stds.extend(vec![100.0; heads]);
        for (state, std) in stds.into_iter().enumerate() {
            covariance[state][state] = std * std;
        }
        Self { heads, covariance }
    }

    fn drive(&mut self, pose: &Pose, kinds: Kinds) {
        let count = self.covariance.len();
        let (length_m, turn_rad) = (SPEED_MPS * STEP_S, YAW_RATE_RADPS * STEP_S);
        let (sin, cos) = (pose.heading_rad + 0.5 * turn_rad).sin_cos();
        let mut f = vec![vec![0.0; count]; count];
        for (state, row) in f.iter_mut().enumerate() {
            row[state] = 1.0;
        }
        let turned = [-0.5 * length_m * sin, 0.5 * length_m * cos, 1.0];
        f[0][2] = -length_m * sin;
        f[1][2] = length_m * cos;
        f[0][3] = -length_m * cos;
        f[1][3] = -length_m * sin;
        for (state, by) in turned.into_iter().enumerate() {
            f[state][4] = -STEP_S * by;
            f[state][YAW_SCALE] = -turn_rad * by;
        }
        f[CLOCK][DRIFT] = STEP_S;
        let mut left = vec![vec![0.0; count]; count];
        for i in 0..count {
            for k in 0..count {
                if f[i][k] != 0.0 {
                    for j in 0..count {
                        left[i][j] += f[i][k] * self.covariance[k][j];
                    }
                }
            }
        }
        let p = &mut self.covariance;
        for i in 0..count {
            for j in 0..count {
                p[i][j] = (0..count).map(|k| left[i][k] * f[j][k]).sum();
            }
        }
        let spread = ODOMETER_NOISE * ODOMETER_NOISE * length_m;
        let along = [cos, sin, 0.0];
        for i in 0..3 {
            for j in 0..3 {
                p[i][j] += spread * along[i] * along[j]
                    + GYROSCOPE_NOISE * GYROSCOPE_NOISE * STEP_S * turned[i] * turned[j];
            }
        }
        let walk = (METRES_PER_NS * DRIFT_WALK_PPB).powi(2) * STEP_S;
        p[CLOCK][CLOCK] +=
            (METRES_PER_NS * kinds.wander_ns()).powi(2) * STEP_S + walk * STEP_S * STEP_S / 3.0;
        p[CLOCK][DRIFT] += 0.5 * walk * STEP_S;
        p[DRIFT][CLOCK] += 0.5 * walk * STEP_S;
        p[DRIFT][DRIFT] += walk;
        for number in 0..self.heads {
            let phase = OFFSET + 2 * self.heads + number;
            p[phase][phase] += PHASE_WALK * PHASE_WALK * length_m;
        }
    }

    fn update(&mut self, row: &[f64], variance: f64) {
        let count = row.len();
        let p = &mut self.covariance;
        let cross: Vec<f64> = (p.iter())
            .map(|line| line.iter().zip(row).map(|(a, b)| a * b).sum())
            .collect();
        let total = variance + cross.iter().zip(row).map(|(a, b)| a * b).sum::<f64>();
        for i in 0..count {
            for j in 0..count {
                p[i][j] -= cross[i] * cross[j] / total;
            }
        }
    }

    fn burst(&mut self, number: usize, head: &RadioHead, pose: &Pose, kinds: Kinds) {
        let count = self.covariance.len();
        let (dx, dy) = (pose.x_m - head.position.x_m, pose.y_m - head.position.y_m);
        let range_m = dx.hypot(dy).hypot(head.height_m - 1.0);
        let mut range = vec![0.0; count];
        (range[0], range[1], range[CLOCK]) = (dx / range_m, dy / range_m, 1.0);
        let mut phase = range.clone();
        range[OFFSET + number] = 1.0;
        phase[OFFSET + 2 * self.heads + number] = 1.0;
        self.update(&range, SIGMA_M * SIGMA_M);
        if kinds.rate {
            let (sin, cos) = pose.heading_rad.sin_cos();
            let (vx, vy) = (SPEED_MPS * cos, SPEED_MPS * sin);
            let rate_mps = (dx * vx + dy * vy) / range_m;
            let mut row = vec![0.0; count];
            row[0] = (vx - rate_mps * dx / range_m) / range_m;
            row[1] = (vy - rate_mps * dy / range_m) / range_m;
            row[2] = (-dx * vy + dy * vx) / range_m;
            row[3] = -rate_mps;
            row[DRIFT] = 1.0;
            row[OFFSET + self.heads + number] = 1.0;
            self.update(&row, rate_variance(rate_mps, kinds));
        }
        if kinds.phase {
            self.update(&phase, PHASE_SIGMA_M * PHASE_SIGMA_M);
        }
    }
}

/// Returns the variance of a range rate, due to noise, the clock within the interval, and the speed
/// of the odometer.
fn rate_variance(rate_mps: f64, kinds: Kinds) -> f64 {
    let [sigma_mps, interval_s] = kinds.rate();
    let along = rate_mps / SPEED_MPS;
    sigma_mps * sigma_mps
        + (METRES_PER_NS * kinds.wander_ns()).powi(2) / interval_s
        + along * along * speed_variance()
}

/// Returns the variance of the speed of the odometer. The range rates of all radio heads share its
/// error.
fn speed_variance() -> f64 {
    SPEED_NOISE_MPS.powi(2) + ODOMETER_NOISE.powi(2) * SPEED_MPS / STEP_S
}

#[derive(Default)]
struct Sums {
    error2: f64,
    bound: f64,
    nees: f64,
    count: f64,
    /// Carrier phases that continued a sequence.
    continued: u32,
    phases: u32,
}

/// Change of the truth at a step.
#[derive(Clone, Copy, Default)]
struct Fault {
    at_step: i32,
    clock_m: f64,
    /// Change of the first radio head's delays (m).
    offset_m: f64,
    /// Change of the first radio head's carrier phases (cycles).
    cycles: f64,
}

/// Drives circles with measurements that have the specified errors.
fn drive(seed: u64, heads: usize, kinds: Kinds, fault: Fault, sums: &mut Sums) -> Ekf {
    let (config, known) = setup(heads, kinds);
    let wavelength_m = config.ranging.unwrap().wavelength_m;
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut normal = |std: f64| std * rng.sample::<f64, _>(StandardNormal);
    let mut truth = Pose {
        x_m: 10.0,
        y_m: -5.0,
        heading_rad: 0.4,
    };
    let start = InitialPose {
        pose: Pose {
            x_m: truth.x_m + normal(START_STD_M),
            y_m: truth.y_m + normal(START_STD_M),
            heading_rad: truth.heading_rad + normal(HEADING_STD_RAD),
        },
        position_std_m: START_STD_M,
        heading_std_rad: HEADING_STD_RAD,
    };
    let mut ekf = Ekf::new(config, None, &known, &start);
    // All drives have the same true trajectory, and therefore the same bound.
    let mut bound = (seed == 0).then(|| Bound::new(heads, config.yaw_rate_scale_std));
    let (scale, bias) = (normal(SCALE_STD), normal(BIAS_STD_RADPS));
    let yaw_scale = normal(config.yaw_rate_scale_std);
    let mut clock_m = normal(METRES_PER_NS * CLOCK_STD_NS);
    let mut drift_mps = normal(METRES_PER_NS * DRIFT_STD_PPB);
    let mut offsets_m: Vec<f64> = (0..heads).map(|_| normal(OFFSET_STD_M)).collect();
    let rates_mps: Vec<f64> = (0..heads)
        .map(|_| normal(METRES_PER_NS * FREQUENCY_STD_PPB))
        .collect();
    let mut cycles: Vec<f64> = (0..heads).map(|_| normal(1e3)).collect();
    let (length_m, turn_rad) = (SPEED_MPS * STEP_S, YAW_RATE_RADPS * STEP_S);
    let [sigma_mps, interval_s] = kinds.rate();
    let mut distance_m = 0.0;
    for step in 0..=STEPS {
        let time_s = STEP_S * f64::from(step);
        let mut rate_radps = 0.0;
        if step > 0 {
            if let Some(bound) = &mut bound {
                bound.drive(&truth, kinds);
            }
            truth = truth.along_chord(length_m, turn_rad);
            distance_m += (1.0 + scale) * (length_m + normal(ODOMETER_NOISE * length_m.sqrt()));
            let turned_rad = turn_rad + normal(GYROSCOPE_NOISE * STEP_S.sqrt());
            rate_radps = (1.0 + yaw_scale) * turned_rad / STEP_S + bias;
            clock_m +=
                STEP_S * drift_mps + normal(METRES_PER_NS * kinds.wander_ns() * STEP_S.sqrt());
            drift_mps += normal(METRES_PER_NS * DRIFT_WALK_PPB * STEP_S.sqrt());
            for cycles in &mut cycles {
                *cycles += normal(PHASE_WALK * length_m.sqrt()) / wavelength_m;
            }
        }
        if step == fault.at_step {
            clock_m += fault.clock_m;
            offsets_m[0] += fault.offset_m;
            cycles[0] += fault.cycles;
        }
        ekf.odometry(&OdometrySample {
            time_s,
            distance_m,
            speed_mps: (1.0 + scale) * SPEED_MPS + normal(speed_variance().sqrt()),
            yaw_rate_radps: Some(rate_radps),
        });
        for (number, head) in known.iter().enumerate() {
            let range_m = head.distance_m(truth.point(), 1.0);
            let delay_m = range_m + clock_m + offsets_m[number] + normal(SIGMA_M);
            let rate = kinds.rate.then(|| {
                let bearing_rad = truth.point().bearing_rad(head.position) - truth.heading_rad;
                let level = truth.point().distance_m(head.position) / range_m;
                let rate_mps = -SPEED_MPS * level * bearing_rad.cos();
                let error_mps = normal(rate_variance(0.0, kinds).sqrt());
                let value_mps = rate_mps + drift_mps + rates_mps[number] + error_mps;
                RangeMeasurement::range_rate(time_s, value_mps, sigma_mps, interval_s)
            });
            let phase = kinds.phase.then(|| {
                let phase_m = range_m + clock_m + normal(PHASE_SIGMA_M);
                let turns = -(phase_m / wavelength_m + cycles[number]).fract();
                let rad_per_m = std::f64::consts::TAU / wavelength_m;
                RangeMeasurement::carrier_phase(
                    time_s,
                    std::f64::consts::TAU * turns,
                    rad_per_m * PHASE_SIGMA_M,
                    wavelength_m,
                )
            });
            let delay = RangeMeasurement::range(time_s, delay_m, None);
            for measured in [rate, Some(delay)].into_iter().flatten() {
                ekf.update_range(head, &measured);
            }
            if let Some(phase) = phase {
                let verdict = ekf.update_range(head, &phase);
                sums.phases += 1;
                sums.continued += u32::from(verdict.mahalanobis_squared.is_some());
            }
            if let Some(bound) = &mut bound {
                bound.burst(number, head, &truth, kinds);
            }
        }
        if step > STEPS / 3 && step % 50 == 0 {
            let estimate = ekf.pose(time_s);
            let [[xx, xy, _], [_, yy, _], _] = estimate.covariance.unwrap();
            let (dx, dy) = (estimate.pose.x_m - truth.x_m, estimate.pose.y_m - truth.y_m);
            sums.error2 += dx * dx + dy * dy;
            sums.nees += (yy * dx * dx - 2.0 * xy * dx * dy + xx * dy * dy) / (xx * yy - xy * xy);
            if let Some(bound) = &bound {
                sums.bound += bound.covariance[0][0] + bound.covariance[1][1];
            }
            sums.count += 1.0;
        }
    }
    ekf
}

/// The filter reaches the bound with every kind, and its covariance is that of its errors.
#[test]
fn every_kind_reaches_the_bound() {
    const RUNS: u64 = 100;
    let kinds = [(true, false), (true, true)];
    let mut failed = Vec::new();
    for (rate, phase) in kinds {
        for heads in [1, 2, 4] {
            let mut sums = Sums::default();
            for seed in 0..RUNS {
                drive(
                    seed,
                    heads,
                    Kinds { rate, phase },
                    Fault::default(),
                    &mut sums,
                );
            }
            sums.bound *= RUNS as f64;
            let ratio = (sums.error2 / sums.bound).sqrt();
            let nees = 0.5 * sums.nees / sums.count;
            println!(
                "{heads} heads, rate {rate}, phase {phase}: RMS {:.3} m, bound {:.3} m, ratio \
                 {ratio:.3}, NEES/2 {nees:.3}, phases continued {:.3}",
                (sums.error2 / sums.count).sqrt(),
                (sums.bound / sums.count).sqrt(),
                f64::from(sums.continued) / f64::from(sums.phases.max(1)),
            );
            // The mean of 100 runs has a standard deviation of at most 0.1. Phases of two radio heads
            // have a NEES/2 of 1.33, because they are far more accurate than the linearised distance.
            let max_nees = if phase { 1.3 } else { 1.15 };
            if ratio > 1.1 || !(0.85..max_nees).contains(&nees) {
                failed.push((heads, rate, phase, ratio, nees));
            }
        }
    }
    assert!(failed.is_empty(), "{failed:?}");
}

/// Returns RMS error with a fault in the middle of the drive, relative to that without.
fn with_fault(kinds: Kinds, fault: Fault) -> [f64; 2] {
    let mut sums = [Sums::default(), Sums::default()];
    for seed in 0..40 {
        drive(seed, 4, kinds, Fault::default(), &mut sums[0]);
        drive(seed, 4, kinds, fault, &mut sums[1]);
    }
    sums.map(|it| (it.error2 / it.count).sqrt())
}

const FAULT_STEP: i32 = STEPS / 2;

#[test]
fn a_clock_step_and_a_blocked_path_do_not_bias_the_position() {
    let kinds = Kinds {
        rate: true,
        phase: false,
    };
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
        let [usual_m, faulty_m] = with_fault(kinds, fault);
        println!("usual {usual_m:.3} m, faulty {faulty_m:.3} m");
        assert!(faulty_m < 1.2 * usual_m, "{usual_m} {faulty_m}");
    }
}

#[test]
fn cycle_slip_begins_a_new_sequence() {
    let kinds = Kinds {
        rate: true,
        phase: true,
    };
    // Half a cycle is the hardest slip of a receiver; a quarter results from a wrong symbol.
    for cycles in [0.5, 0.25] {
        let fault = Fault {
            at_step: FAULT_STEP,
            cycles,
            ..Fault::default()
        };
        let [usual_m, faulty_m] = with_fault(kinds, fault);
        println!("{cycles} cycles: usual {usual_m:.3} m, faulty {faulty_m:.3} m");
        assert!(faulty_m < 1.2 * usual_m, "{usual_m} {faulty_m}");
    }
}

#[test]
fn kinds_that_are_not_configured_are_unusable() {
    let (config, known) = setup(
        2,
        Kinds {
            rate: false,
            phase: false,
        },
    );
    let start = InitialPose {
        pose: Pose::default(),
        position_std_m: 1.0,
        heading_std_rad: 0.1,
    };
    let mut ekf = Ekf::new(config, None, &known, &start);
    ekf.odometry(&OdometrySample::of_speed(0.0, 0.0, None));
    for measured in [
        RangeMeasurement::range_rate(0.0, 0.1, 0.01, 0.02),
        RangeMeasurement::carrier_phase(0.0, 0.1, 0.01, 0.0857),
    ] {
        let verdict = ekf.update_range(&known[0], &measured);
        assert_eq!(verdict.reason, UpdateReason::Unusable);
    }
}
