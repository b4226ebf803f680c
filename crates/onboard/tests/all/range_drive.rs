//! Drives in circles with ranges, range rates and carrier phases that have the specified errors: set-up, posterior
//! Cramér–Rao bound, and statistics of the errors.

use std::fmt::Write as _;

use onboard::geometry::Pose;
use onboard::localize::InitialPose;
use onboard::localize::ekf::{Ekf, EkfConfig};
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
/// Number of steps of a drive.
pub const STEPS: i32 = 300;

const SPEED_NOISE_MPS: f64 = 0.02;
const OFFSET_STD_M: f64 = 2.0;
const CLOCK_STD_NS: f64 = 100.0;
const DRIFT_STD_PPB: f64 = 20.0;
const FREQUENCY_STD_PPB: f64 = 5.0;
const PHASE_SIGMA_M: f64 = 0.002;
const PHASE_WALK: f64 = 0.005;
/// Correlation distance of multipath (m).
const SCATTER_M: f64 = 20.0;

/// Standard deviations of the errors, which are drawn and specified.
#[derive(Clone, Copy)]
pub struct Model {
    pub odometer_noise: f64,
    pub scale_std: f64,
    pub gyroscope_noise: f64,
    pub bias_std_radps: f64,
    pub start_std_m: f64,
    pub heading_std_rad: f64,
    pub sigma_m: f64,
    /// Error of the delays due to multipath (m), exponentially correlated over [`SCATTER_M`].
    pub scatter_m: f64,
    /// Walk of the offsets (m/√m).
    pub offset_walk: f64,
    pub wander_ns: f64,
    pub drift_walk_ppb: f64,
    /// Offset (ns) and random walk (ns/√s) of the clock that the radio heads share.
    pub head_clock: [f64; 2],
    /// Position of the ranging antenna (m).
    pub lever_m: [f64; 2],
    /// Noise of a range rate (m/s) and its time interval (s).
    pub rate: Option<[f64; 2]>,
    /// Whether carrier phases are measured.
    pub phase: bool,
}

/// Delays of radio heads with a common clock, and a weak odometer.
pub const DELAYS: Model = Model {
    odometer_noise: 0.03,
    scale_std: 0.02,
    gyroscope_noise: 0.005,
    bias_std_radps: 0.002,
    start_std_m: 0.5,
    heading_std_rad: 0.05,
    sigma_m: 1.5,
    scatter_m: 0.0,
    offset_walk: 0.02,
    wander_ns: 0.3,
    drift_walk_ppb: 0.2,
    head_clock: [10.0, 0.1],
    lever_m: [0.3, 0.1],
    rate: None,
    phase: false,
};

/// Delays, and range rates of phase differences.
pub const RATES: Model = Model {
    odometer_noise: 0.01,
    scale_std: 0.01,
    gyroscope_noise: 0.002,
    bias_std_radps: 0.001,
    start_std_m: 0.3,
    heading_std_rad: 0.03,
    sigma_m: 1.0,
    scatter_m: 0.0,
    offset_walk: 0.0,
    wander_ns: 0.1,
    drift_walk_ppb: 0.05,
    head_clock: [0.0; 2],
    lever_m: [0.0; 2],
    rate: Some([0.02, 0.02]),
    phase: false,
};

/// Delays, carrier phases with the clock of an OCXO, and range rates within an SSB.
pub const PHASES: Model = Model {
    wander_ns: 0.003,
    rate: Some([0.3, 2e-4]),
    phase: true,
    ..RATES
};

/// Returns configuration and radio heads of a robot in a hall.
pub fn setup(heads: usize, model: &Model) -> (EkfConfig, Vec<RadioHead>) {
    let mut site = String::from("name = \"hall\"\n");
    let corners = [[-25.0, -20.0], [30.0, 25.0], [-20.0, 30.0], [28.0, -22.0]];
    let [clock_ns, wander_ns] = model.head_clock;
    let is_common = heads > 1 && clock_ns > 0.0;
    let group = if is_common { "clock_group = 1\n" } else { "" };
    for (pci, [x, y]) in corners.iter().take(heads).enumerate() {
        writeln!(
            site,
            "[[radio_heads]]\npci = {pci}\nposition_m = [{x:?}, {y:?}, 4.0]\n{group}\
             clock_offset_std_ns = {clock_ns:?}\nclock_wander_ns_per_sqrt_s = {wander_ns:?}\n\
             clock_frequency_std_ppb = {FREQUENCY_STD_PPB:?}"
        )
        .unwrap();
    }
    let Model {
        odometer_noise,
        scale_std,
        gyroscope_noise,
        bias_std_radps,
        sigma_m,
        offset_walk,
        wander_ns,
        drift_walk_ppb,
        lever_m: [forward_m, left_m],
        rate,
        phase,
        ..
    } = model;
    let rate = rate.is_some();
    let vehicle = format!(
        "name = \"robot\"\ndrive = \"differential\"\nintegrity = {{ enabled = false }}\n\
         acceleration_mps2 = 0.01\n\
         [odometer]\nnoise_m_per_sqrt_m = {odometer_noise}\nnoise_m_per_sqrt_s = 1e-6\n\
         scale_std = {scale_std}\nspeed_noise_mps = {SPEED_NOISE_MPS}\n\
         [gyroscope]\nnoise_rad_per_sqrt_s = {gyroscope_noise}\nbias_std_radps = {bias_std_radps}\n\
         [ranging]\nkind = \"one-way\"\nsigma_m = {sigma_m:?}\noffset_std_m = {OFFSET_STD_M:?}\n\
         offset_walk_m_per_sqrt_m = {offset_walk:?}\nclock_offset_std_ns = {CLOCK_STD_NS:?}\n\
         clock_frequency_std_ppb = {DRIFT_STD_PPB:?}\nclock_wander_ns_per_sqrt_s = {wander_ns}\n\
         clock_drift_walk_ppb_per_sqrt_s = {drift_walk_ppb}\n\
         position_m = [{forward_m:?}, {left_m:?}, 1.0]\nrange_rate = {rate}\ncarrier_phase = {phase}\n"
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
    model: Model,
    covariance: Vec<Vec<f64>>,
}

impl Bound {
    fn new(heads: usize, model: &Model, yaw_scale_std: f64) -> Self {
        let count = OFFSET + 3 * heads;
        let mut covariance = vec![vec![0.0; count]; count];
        let mut stds = vec![
            model.start_std_m,
            model.start_std_m,
            model.heading_std_rad,
            model.scale_std,
            model.bias_std_radps,
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
        let common = (METRES_PER_NS * model.head_clock[0]).powi(2);
        for one in OFFSET..OFFSET + heads {
            for other in OFFSET..OFFSET + heads {
                covariance[one][other] += common;
            }
        }
        Self {
            heads,
            model: *model,
            covariance,
        }
    }

    fn drive(&mut self, pose: &Pose) {
        let model = self.model;
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
        let spread = model.odometer_noise * model.odometer_noise * length_m;
        let along = [cos, sin, 0.0];
        for i in 0..3 {
            for j in 0..3 {
                p[i][j] += spread * along[i] * along[j]
                    + model.gyroscope_noise
                        * model.gyroscope_noise
                        * STEP_S
                        * turned[i]
                        * turned[j];
            }
        }
        let walk = (METRES_PER_NS * model.drift_walk_ppb).powi(2) * STEP_S;
        p[CLOCK][CLOCK] +=
            (METRES_PER_NS * model.wander_ns).powi(2) * STEP_S + walk * STEP_S * STEP_S / 3.0;
        p[CLOCK][DRIFT] += 0.5 * walk * STEP_S;
        p[DRIFT][CLOCK] += 0.5 * walk * STEP_S;
        p[DRIFT][DRIFT] += walk;
        let common = (METRES_PER_NS * model.head_clock[1]).powi(2) * STEP_S;
        for number in 0..self.heads {
            for other in 0..self.heads {
                p[OFFSET + number][OFFSET + other] += common;
            }
            p[OFFSET + number][OFFSET + number] += model.offset_walk * model.offset_walk * length_m;
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

    fn burst(&mut self, number: usize, head: &RadioHead, pose: &Pose) {
        let model = self.model;
        let count = self.covariance.len();
        let [forward_m, left_m] = model.lever_m;
        let antenna = pose.point_at(forward_m, left_m);
        let (dx, dy) = (
            antenna.x_m - head.position.x_m,
            antenna.y_m - head.position.y_m,
        );
        let range_m = dx.hypot(dy).hypot(head.height_m - 1.0);
        let mut range = vec![0.0; count];
        (range[0], range[1], range[CLOCK]) = (dx / range_m, dy / range_m, 1.0);
        let (sin, cos) = pose.heading_rad.sin_cos();
        let turned = [
            -forward_m * sin - left_m * cos,
            forward_m * cos - left_m * sin,
        ];
        range[2] = (dx * turned[0] + dy * turned[1]) / range_m;
        let mut phase = range.clone();
        range[OFFSET + number] = 1.0;
        phase[OFFSET + 2 * self.heads + number] = 1.0;
        self.update(&range, model.sigma_m * model.sigma_m);
        if model.rate.is_some() {
            let (vx, vy) = (SPEED_MPS * cos, SPEED_MPS * sin);
            let rate_mps = (dx * vx + dy * vy) / range_m;
            let mut row = vec![0.0; count];
            row[0] = (vx - rate_mps * dx / range_m) / range_m;
            row[1] = (vy - rate_mps * dy / range_m) / range_m;
            row[2] = (-dx * vy + dy * vx) / range_m;
            row[3] = -rate_mps;
            row[DRIFT] = 1.0;
            row[OFFSET + self.heads + number] = 1.0;
            self.update(&row, rate_variance(rate_mps, &model));
        }
        if model.phase {
            self.update(&phase, PHASE_SIGMA_M * PHASE_SIGMA_M);
        }
    }
}

/// Returns the variance of a range rate, due to noise, the clock within the interval, and the speed
/// of the odometer.
fn rate_variance(rate_mps: f64, model: &Model) -> f64 {
    let [sigma_mps, interval_s] = model.rate.unwrap_or([0.0, 1.0]);
    let along = rate_mps / SPEED_MPS;
    sigma_mps * sigma_mps
        + (METRES_PER_NS * model.wander_ns).powi(2) / interval_s
        + along * along * speed_variance(model)
}

/// Returns the variance of the speed of the odometer. The range rates of all radio heads share its
/// error.
fn speed_variance(model: &Model) -> f64 {
    SPEED_NOISE_MPS.powi(2) + model.odometer_noise.powi(2) * SPEED_MPS / STEP_S
}

#[derive(Default)]
pub struct Sums {
    error2: f64,
    bound: f64,
    nees: f64,
    count: f64,
    /// Carrier phases that continued a sequence.
    continued: u32,
    phases: u32,
}

impl Sums {
    /// Returns the RMS error (m), its ratio to the bound, and NEES/2, of `runs` drives.
    pub fn figures(&self, runs: u64) -> [f64; 3] {
        let rms_m = (self.error2 / self.count).sqrt();
        // The bound of the first drive is that of every drive.
        let ratio = (self.error2 / (self.bound * runs as f64)).sqrt();
        [rms_m, ratio, 0.5 * self.nees / self.count]
    }

    /// Returns the fraction of carrier phases that continued a sequence.
    pub fn continued(&self) -> f64 {
        f64::from(self.continued) / f64::from(self.phases.max(1))
    }
}

/// Change of the truth at a step.
#[derive(Clone, Copy, Default)]
pub struct Fault {
    pub at_step: i32,
    pub clock_m: f64,
    /// Change of the first radio head's delays (m).
    pub offset_m: f64,
    /// Change of the first radio head's carrier phases (cycles).
    pub cycles: f64,
}

/// Drives circles with measurements that have the specified errors.
pub fn drive(seed: u64, heads: usize, model: &Model, fault: Fault, sums: &mut Sums) -> Ekf {
    let (config, known) = setup(heads, model);
    let wavelength_m = config.ranging.unwrap().wavelength_m;
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut normal = |std: f64| {
        // An error that a model does not have changes no other error.
        if std == 0.0 {
            return 0.0;
        }
        std * rng.sample::<f64, _>(StandardNormal)
    };
    let mut truth = Pose {
        x_m: 10.0,
        y_m: -5.0,
        heading_rad: 0.4,
    };
    let start = InitialPose {
        pose: Pose {
            x_m: truth.x_m + normal(model.start_std_m),
            y_m: truth.y_m + normal(model.start_std_m),
            heading_rad: truth.heading_rad + normal(model.heading_std_rad),
        },
        position_std_m: model.start_std_m,
        heading_std_rad: model.heading_std_rad,
    };
    let mut ekf = Ekf::new(config, None, &known, &start);
    // All drives have the same true trajectory, and therefore the same bound.
    let mut bound = (seed == 0).then(|| Bound::new(heads, model, config.yaw_rate_scale_std));
    let (scale, bias) = (normal(model.scale_std), normal(model.bias_std_radps));
    let yaw_scale = normal(config.yaw_rate_scale_std);
    let mut clock_m = normal(METRES_PER_NS * CLOCK_STD_NS);
    let mut drift_mps = normal(METRES_PER_NS * DRIFT_STD_PPB);
    let head_clock_m = model.head_clock.map(|ns| METRES_PER_NS * ns);
    let common_m = normal(head_clock_m[0]);
    let mut offsets_m: Vec<f64> = (0..heads)
        .map(|_| common_m + normal(OFFSET_STD_M))
        .collect();
    let rates_mps: Vec<f64> = (0..heads)
        .map(|_| normal(METRES_PER_NS * FREQUENCY_STD_PPB))
        .collect();
    let mut scatter_m: Vec<f64> = (0..heads).map(|_| normal(model.scatter_m)).collect();
    let mut cycles: Vec<f64> = (0..heads).map(|_| normal(1e3)).collect();
    let (length_m, turn_rad) = (SPEED_MPS * STEP_S, YAW_RATE_RADPS * STEP_S);
    let [forward_m, left_m] = model.lever_m;
    let mut distance_m = 0.0;
    for step in 0..=STEPS {
        let time_s = STEP_S * f64::from(step);
        let mut rate_radps = 0.0;
        if step > 0 {
            if let Some(bound) = &mut bound {
                bound.drive(&truth);
            }
            truth = truth.along_chord(length_m, turn_rad);
            distance_m +=
                (1.0 + scale) * (length_m + normal(model.odometer_noise * length_m.sqrt()));
            let turned_rad = turn_rad + normal(model.gyroscope_noise * STEP_S.sqrt());
            rate_radps = (1.0 + yaw_scale) * turned_rad / STEP_S + bias;
            clock_m += STEP_S * drift_mps + normal(METRES_PER_NS * model.wander_ns * STEP_S.sqrt());
            drift_mps += normal(METRES_PER_NS * model.drift_walk_ppb * STEP_S.sqrt());
            let common_m = normal(head_clock_m[1] * STEP_S.sqrt());
            for offset_m in &mut offsets_m {
                *offset_m += common_m + normal(model.offset_walk * length_m.sqrt());
            }
            let kept = (-length_m / SCATTER_M).exp();
            for scatter_m in &mut scatter_m {
                *scatter_m *= kept;
                *scatter_m += normal(model.scatter_m * (1.0 - kept * kept).sqrt());
            }
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
            speed_mps: (1.0 + scale) * SPEED_MPS + normal(speed_variance(model).sqrt()),
            yaw_rate_radps: Some(rate_radps),
        });
        for (number, head) in known.iter().enumerate() {
            let range_m = head.distance_m(truth.point_at(forward_m, left_m), 1.0);
            let delay_m =
                range_m + clock_m + offsets_m[number] + scatter_m[number] + normal(model.sigma_m);
            let rate = model.rate.map(|[sigma_mps, interval_s]| {
                let bearing_rad = truth.point().bearing_rad(head.position) - truth.heading_rad;
                let level = truth.point().distance_m(head.position) / range_m;
                let rate_mps = -SPEED_MPS * level * bearing_rad.cos();
                let error_mps = normal(rate_variance(0.0, model).sqrt());
                let value_mps = rate_mps + drift_mps + rates_mps[number] + error_mps;
                RangeMeasurement::range_rate(time_s, value_mps, sigma_mps, interval_s)
            });
            let phase = model.phase.then(|| {
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
            let delay = RangeMeasurement {
                scatter_m: model.scatter_m,
                ..RangeMeasurement::range(time_s, delay_m, None)
            };
            for measured in [rate, Some(delay)].into_iter().flatten() {
                ekf.update_range(head, &measured);
            }
            if let Some(phase) = phase {
                let verdict = ekf.update_range(head, &phase);
                sums.phases += 1;
                sums.continued += u32::from(verdict.mahalanobis_squared.is_some());
            }
            if let Some(bound) = &mut bound {
                bound.burst(number, head, &truth);
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
