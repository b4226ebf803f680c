//! Ranges in the filter: efficiency and consistency with one-way delays, and the effect of their
//! absence.

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
const STEPS: i32 = 400;

const ODOMETER_NOISE: f64 = 0.03;
const SCALE_STD: f64 = 0.02;
const GYROSCOPE_NOISE: f64 = 0.005;
const BIAS_STD_RADPS: f64 = 0.002;
const START_STD_M: f64 = 0.5;
const HEADING_STD_RAD: f64 = 0.05;
const SIGMA_M: f64 = 1.5;
const OFFSET_STD_M: f64 = 2.0;
const WALK: f64 = 0.02;
const CLOCK_STD_NS: f64 = 100.0;
const DRIFT_STD_PPB: f64 = 20.0;
const WANDER_NS: f64 = 0.3;
const DRIFT_WALK_PPB: f64 = 0.2;
const HEAD_CLOCK_STD_NS: f64 = 10.0;
const HEAD_WANDER_NS: f64 = 0.1;

fn setup(heads: usize) -> (EkfConfig, Vec<RadioHead>) {
    let mut site = String::from("name = \"hall\"\n");
    let corners = [[-25.0, -20.0], [30.0, 25.0], [-20.0, 30.0], [28.0, -22.0]];
    let group = if heads > 1 { "clock_group = 1\n" } else { "" };
    for (pci, [x, y]) in corners.iter().take(heads).enumerate() {
        writeln!(
            site,
            "[[radio_heads]]\npci = {pci}\nposition_m = [{x:?}, {y:?}, 4.0]\n{group}\
             clock_offset_std_ns = {HEAD_CLOCK_STD_NS:?}\n\
             clock_wander_ns_per_sqrt_s = {HEAD_WANDER_NS:?}"
        )
        .unwrap();
    }
    let vehicle = format!(
        "name = \"robot\"\ndrive = \"differential\"\nintegrity = {{ enabled = false }}\n\
         [odometer]\nnoise_m_per_sqrt_m = {ODOMETER_NOISE}\nnoise_m_per_sqrt_s = 1e-6\n\
         scale_std = {SCALE_STD}\n\
         [gyroscope]\nnoise_rad_per_sqrt_s = {GYROSCOPE_NOISE}\nbias_std_radps = {BIAS_STD_RADPS}\n\
         [ranging]\nkind = \"one-way\"\nsigma_m = {SIGMA_M}\noffset_std_m = {OFFSET_STD_M}\n\
         offset_walk_m_per_sqrt_m = {WALK}\nclock_offset_std_ns = {CLOCK_STD_NS:?}\n\
         clock_drift_std_ppb = {DRIFT_STD_PPB:?}\nclock_wander_ns_per_sqrt_s = {WANDER_NS}\n\
         clock_drift_walk_ppb_per_sqrt_s = {DRIFT_WALK_PPB}\nposition_m = [0.3, 0.1, 1.0]\n"
    );
    let site = Site::from_toml(&site, "site", &Shipped).unwrap();
    let vehicle = Vehicle::from_toml(&vehicle, "vehicle", &Shipped).unwrap();
    (
        EkfConfig::new(&site, &vehicle),
        RadioHead::received_by(&site, &vehicle),
    )
}

/// Covariance recursion of a linear filter at the true trajectory, whose states are x, y, heading,
/// odometer scale, yaw rate bias, clock, drift and offsets: the posterior Cramér–Rao bound.
struct Bound {
    covariance: Vec<Vec<f64>>,
}

const CLOCK: usize = 5;
const DRIFT: usize = 6;
const OFFSET: usize = 7;

impl Bound {
    fn new(heads: usize, yaw_scale_std: f64) -> Self {
        let count = OFFSET + heads + 1;
        let mut covariance = vec![vec![0.0; count]; count];
        let clock_m = METRES_PER_NS * HEAD_CLOCK_STD_NS;
        let stds = [
            START_STD_M,
            START_STD_M,
            HEADING_STD_RAD,
            SCALE_STD,
            BIAS_STD_RADPS,
            METRES_PER_NS * CLOCK_STD_NS,
            METRES_PER_NS * DRIFT_STD_PPB,
        ];
        for (state, std) in stds.into_iter().enumerate() {
            covariance[state][state] = std * std;
        }
        for one in 0..heads {
            for other in 0..heads {
                covariance[OFFSET + one][OFFSET + other] = clock_m * clock_m;
            }
            covariance[OFFSET + one][OFFSET + one] += OFFSET_STD_M * OFFSET_STD_M;
        }
        covariance[count - 1][count - 1] = yaw_scale_std * yaw_scale_std;
        Self { covariance }
    }

    fn drive(&mut self, pose: &Pose) {
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
            f[state][count - 1] = -turn_rad * by;
        }
        f[CLOCK][DRIFT] = STEP_S;
        let product = |a: &[Vec<f64>], b: &dyn Fn(usize, usize) -> f64| -> Vec<Vec<f64>> {
            (0..count)
                .map(|i| {
                    (0..count)
                        .map(|j| (0..count).map(|k| a[i][k] * b(k, j)).sum())
                        .collect()
                })
                .collect()
        };
        let left = product(&f, &|k, j| self.covariance[k][j]);
        self.covariance = product(&left, &|k, j| f[j][k]);
        let p = &mut self.covariance;
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
            (METRES_PER_NS * WANDER_NS).powi(2) * STEP_S + walk * STEP_S * STEP_S / 3.0;
        p[CLOCK][DRIFT] += 0.5 * walk * STEP_S;
        p[DRIFT][CLOCK] += 0.5 * walk * STEP_S;
        p[DRIFT][DRIFT] += walk;
        let common = (METRES_PER_NS * HEAD_WANDER_NS).powi(2) * STEP_S;
        for one in OFFSET..count - 1 {
            for other in OFFSET..count - 1 {
                p[one][other] += common;
            }
            p[one][one] += WALK * WALK * length_m;
        }
    }

    fn update(&mut self, number: usize, head: &RadioHead, pose: &Pose) {
        let count = self.covariance.len();
        let eye = pose.point_at(0.3, 0.1);
        let (dx, dy) = (eye.x_m - head.position.x_m, eye.y_m - head.position.y_m);
        let range_m = dx.hypot(dy).hypot(head.height_m - 1.0);
        let mut row = vec![0.0; count];
        let (sin, cos) = pose.heading_rad.sin_cos();
        row[0] = dx / range_m;
        row[1] = dy / range_m;
        row[2] = (dx * (-0.3 * sin - 0.1 * cos) + dy * (0.3 * cos - 0.1 * sin)) / range_m;
        (row[CLOCK], row[OFFSET + number]) = (1.0, 1.0);
        let p = &mut self.covariance;
        let cross: Vec<f64> = (p.iter())
            .map(|line| line.iter().zip(&row).map(|(a, b)| a * b).sum())
            .collect();
        let total: f64 =
            SIGMA_M * SIGMA_M + cross.iter().zip(&row).map(|(a, b)| a * b).sum::<f64>();
        for i in 0..count {
            for j in 0..count {
                p[i][j] -= cross[i] * cross[j] / total;
            }
        }
    }
}

#[derive(Default)]
struct Sums {
    error2: f64,
    bound: f64,
    nees: f64,
    count: f64,
}

/// Drives circles with delays that have the specified errors.
fn drive(seed: u64, heads: usize, sums: &mut Sums) {
    let (config, known) = setup(heads);
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
    let mut common_m = normal(METRES_PER_NS * HEAD_CLOCK_STD_NS);
    let mut offsets_m: Vec<f64> = (0..heads).map(|_| normal(OFFSET_STD_M)).collect();
    let (length_m, turn_rad) = (SPEED_MPS * STEP_S, YAW_RATE_RADPS * STEP_S);
    let mut distance_m = 0.0;
    for step in 0..=STEPS {
        let time_s = STEP_S * f64::from(step);
        let mut rate_radps = 0.0;
        if step > 0 {
            if let Some(bound) = &mut bound {
                bound.drive(&truth);
            }
            truth = truth.along_chord(length_m, turn_rad);
            distance_m += (1.0 + scale) * (length_m + normal(ODOMETER_NOISE * length_m.sqrt()));
            let turned_rad = turn_rad + normal(GYROSCOPE_NOISE * STEP_S.sqrt());
            rate_radps = (1.0 + yaw_scale) * turned_rad / STEP_S + bias;
            clock_m += STEP_S * drift_mps + normal(METRES_PER_NS * WANDER_NS * STEP_S.sqrt());
            drift_mps += normal(METRES_PER_NS * DRIFT_WALK_PPB * STEP_S.sqrt());
            common_m += normal(METRES_PER_NS * HEAD_WANDER_NS * STEP_S.sqrt());
            for offset_m in &mut offsets_m {
                *offset_m += normal(WALK * length_m.sqrt());
            }
        }
        ekf.odometry(&OdometrySample {
            time_s,
            distance_m,
            speed_mps: SPEED_MPS,
            yaw_rate_radps: Some(rate_radps),
        });
        let number = step as usize % heads;
        let head = &known[number];
        let range_m = head.distance_m(truth.point_at(0.3, 0.1), 1.0);
        let measured = RangeMeasurement::range(
            time_s,
            range_m + clock_m + common_m + offsets_m[number] + normal(SIGMA_M),
            None,
        );
        ekf.update_range(head, &measured);
        if let Some(bound) = &mut bound {
            bound.update(number, head, &truth);
        }
        if step > STEPS / 4 && step % 50 == 0 {
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
}

const RUNS: u64 = 500;

/// The filter reaches the bound, and its covariance is that of its errors.
#[test]
fn delays_reach_the_bound() {
    for heads in [1, 2, 4] {
        let mut sums = Sums::default();
        for seed in 0..RUNS {
            drive(seed, heads, &mut sums);
        }
        sums.bound *= RUNS as f64;
        let ratio = (sums.error2 / sums.bound).sqrt();
        let nees = 0.5 * sums.nees / sums.count;
        println!(
            "{heads} heads: RMS {:.3} m, bound {:.3} m, ratio {ratio:.3}, NEES/2 {nees:.3}",
            (sums.error2 / sums.count).sqrt(),
            (sums.bound / sums.count).sqrt()
        );
        assert!(ratio < 1.1, "{heads}: {ratio}");
        assert!((0.9..1.1).contains(&nees), "{heads}: {nees}");
    }
}

#[test]
fn ranges_without_their_settings_are_unusable() {
    let (config, known) = setup(2);
    let without = EkfConfig {
        ranging: None,
        ..config
    };
    let start = InitialPose {
        pose: Pose::default(),
        position_std_m: 1.0,
        heading_std_rad: 0.1,
    };
    let measured = RangeMeasurement::range(0.0, 30.0, Some(1.0));
    let mut ekf = Ekf::new(without, None, &known, &start);
    let before = *ekf.belief();
    let verdict = ekf.update_range(&known[0], &measured);
    assert_eq!(verdict.reason, UpdateReason::Unusable);
    assert_eq!(*ekf.belief(), before);

    let mut ekf = Ekf::new(config, None, &known, &start);
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
