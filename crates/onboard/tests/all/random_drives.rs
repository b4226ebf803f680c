//! Random drives: finite numbers, positive variances, and no position jumps.

use std::f64::consts::PI;
use std::fmt::Write as _;

use onboard::geometry::Pose;
use onboard::localize::{AngleUpdate, OutOfSequenceBuffer, UpdateReason, UpdateResult, built_in};
use onboard::observation::OdometrySample;
use onboard::radio_head::RadioHead;
use onboard::settings::{Shipped, Site, TomlFile, Vehicle};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use crate::angle;

/// Number of drives of the test, which takes seconds.
const DRIVES: u64 = 20;
/// Number of drives of the campaign, which takes minutes.
const CAMPAIGN_DRIVES: u64 = 2000;

fn drive(seed: u64) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut site = String::from("name = \"hall\"\nrician_k_db = 200.0\n");
    for pci in 0..rng.random_range(1..7) {
        let [x, y] = [(); 2].map(|()| rng.random_range(-15.0..15.0_f64));
        let z = rng.random_range(0.0..5.0_f64);
        writeln!(
            site,
            "[[radio_heads]]\npci = {pci}\nposition_m = [{x:?}, {y:?}, {z:?}]"
        )
        .unwrap();
    }
    let kind = if rng.random() { "road" } else { "differential" };
    let has_yaw: bool = rng.random();
    let yaw_noise = rng.random_range(0.0..0.1_f64);
    let noise = rng.random_range(0.0..0.1_f64);
    let guard = if rng.random() { "[integrity]\n" } else { "" };
    let vehicle = format!(
        "name = \"any\"\ndrive = \"{kind}\"\n{guard}[odometer]\nnoise_m_per_sqrt_m = {noise:?}\n\
         [gyroscope]\nnoise_rad_per_sqrt_s = {yaw_noise:?}\nbias_std_radps = 0.01\n\
         [array]\nposition_m = [0.2, 0.1, 0.5]\n[receiver]\ncorrelated_noise_fraction = 0.5\n"
    );
    let site = Site::from_toml(&site, "site", &Shipped).unwrap();
    let vehicle = Vehicle::from_toml(&vehicle, "vehicle", &Shipped).unwrap();
    let heads = RadioHead::received_by(&site, &vehicle);
    let mut localizer =
        OutOfSequenceBuffer::new(built_in(&site, &vehicle, Pose::default()).unwrap());

    let mut truth = Pose::default();
    let (mut distance_m, mut speed_mps, mut rate_radps) = (0.0, 0.0, 0.0);
    let late_s = rng.random_range(0.0..0.3_f64);
    let (gap_from, gap_to) = (rng.random_range(50..300), rng.random_range(100..400));
    let mut before: Option<(Pose, f64)> = None;
    for step in 0..500 {
        let time_s = 0.05 * f64::from(step);
        if step % 20 == 0 {
            speed_mps = if rng.random() {
                rng.random_range(-0.5..3.0)
            } else {
                0.0
            };
            let spot = kind == "differential" || speed_mps != 0.0;
            rate_radps = if spot {
                rng.random_range(-1.0..1.0)
            } else {
                0.0
            };
        }
        let step_m = 0.05 * speed_mps;
        truth = truth.along_chord(step_m, 0.05 * rate_radps);
        let normal: f64 = rng.sample(StandardNormal);
        distance_m += step_m + noise * (step_m.abs()).sqrt() * normal;
        let wild = rng.random_bool(0.002);
        let sample = OdometrySample {
            time_s,
            distance_m,
            speed_mps,
            yaw_rate_radps: has_yaw.then_some(if wild { 20.0 } else { rate_radps }),
        };
        if !(gap_from..gap_to).contains(&step) {
            localizer.odometry(&sample).unwrap();
        }
        let mut burst = Vec::new();
        for head in &heads {
            if !rng.random_bool(0.2) {
                continue;
            }
            let noise: f64 = rng.sample(StandardNormal);
            let outlier = if rng.random_bool(0.05) {
                rng.random_range(-3.0..3.0)
            } else {
                0.0
            };
            let eye = truth.point_at(0.2, 0.1);
            let ground_m = eye.distance_m(head.position);
            let level = ground_m / ground_m.hypot(head.height_m - 0.5).max(1e-9);
            let phase_rad = PI * level * (eye.bearing_rad(head.position) - truth.heading_rad).cos();
            let phase_rad = phase_rad + 0.1 * noise + outlier;
            let measured = angle(time_s - late_s, phase_rad, 0.1);
            burst.push(AngleUpdate {
                number: burst.len(),
                head: *head,
                measured,
                verdict: UpdateResult::unused(UpdateReason::Unusable),
            });
        }
        localizer.update(&mut burst).unwrap();
        let estimate = localizer.localizer().pose(time_s).unwrap();
        let (pose, covariance) = (estimate.pose, estimate.covariance.unwrap());
        assert!(pose.x_m.is_finite() && pose.y_m.is_finite() && pose.heading_rad.is_finite());
        for (axis, row) in covariance.iter().enumerate() {
            assert!(
                row[axis] >= 0.0,
                "drive {seed}, step {step}: {covariance:?}"
            );
        }
        let std_m = estimate.principal_variances()[0].sqrt();
        if let Some((last, last_std_m)) = before {
            let moved_m = pose.point().distance_m(last.point());
            // Several angles a step, each within the gate; the odometer's step, or a gap's.
            let max_m = 0.4 + 5.0 * last_std_m.max(std_m);
            assert!(
                moved_m <= max_m,
                "drive {seed}, step {step}: {moved_m} of {max_m}"
            );
        }
        let gap = (gap_from..=gap_to).contains(&step);
        before = (!gap).then_some((pose, std_m));
    }
}

#[test]
fn random_drives_have_finite_and_continuous_results() {
    (0..DRIVES).for_each(drive);
}

#[test]
#[ignore = "a campaign of minutes: `make campaign`"]
fn campaign_of_random_drives() {
    (DRIVES..CAMPAIGN_DRIVES).for_each(drive);
}
