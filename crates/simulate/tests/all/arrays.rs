//! Arrays that are not linear, in the whole chain.

use num_complex::Complex64;
use onboard::geometry::wrap_angle;
use onboard::settings::{ArraySettings, ArrayShape};
use onboard::thermal::ThermalNoise;
use simulate::bound::Bound;
use simulate::random::Streams;
use simulate::scenario::Scenario;
use simulate::truth::World;
use toml::Value;

use crate::common::{campaign, changed, run, value};
use crate::statistics::{CampaignStatistics, Consistency};

/// Circular array of five elements with adjacent elements half a wavelength apart.
const CIRCLE: [(&str, &str); 2] = [
    ("vehicle.array.elements", "5"),
    ("vehicle.array.shape", "{ kind = \"circular\" }"),
];

fn with_circle<'a>(more: impl IntoIterator<Item = (&'a str, &'a str)>) -> Vec<(&'a str, Value)> {
    let all = CIRCLE.into_iter().chain(more);
    all.map(|(key, text)| (key, value(text))).collect()
}

/// Returns the ratio of RMSE to bound of the azimuths of a run, the mean of the squared errors
/// normalised by their variances, and the number of azimuths.
fn azimuths(scenario: &Scenario, seed: u64) -> [f64; 3] {
    let truth = World::new(scenario).unwrap().draw(Streams::new(seed, 0));
    let thermal = ThermalNoise::new(&scenario.site, &scenario.vehicle);
    let measurand = scenario.vehicle.array.measurand();
    let (mut squares, mut bounds, mut normalised) = (0.0, 0.0, 0.0);
    let record = run(scenario, seed, 0);
    for angle_result in &record.aoa_estimates {
        let (ssb, measured) = (angle_result.ssb, angle_result.measured.unwrap());
        let head = truth.heads.iter().find(|it| it.pci == ssb.pci).unwrap();
        let there = truth.path.at(ssb.time_s);
        let [along, left] = truth.array.line_of_sight(&there, head).towards;
        let error_rad = wrap_angle(measured.phase_rad - left.atan2(along));
        let aperture = measurand.aperture(left.atan2(along), along.hypot(left));
        let share = measurand.mean_aperture() / aperture;
        squares += error_rad * error_rad;
        bounds += thermal.sigma_rad(ssb.snr_db).powi(2) * share;
        normalised += (error_rad / measured.phase_sigma_rad).powi(2);
    }
    let count = record.aoa_estimates.len() as f64;
    [(squares / bounds).sqrt(), normalised / count, count]
}

#[test]
fn azimuth_of_a_circle_of_five_attains_the_bound() {
    // Strong signals without scatter, from the horizon and from above, blind and with pilots, as
    // snapshots and as samples.
    for (pilots, fidelity, height_m) in [
        ("blind", "snapshots", 0.0),
        ("blind", "snapshots", 40.0),
        ("ssb", "snapshots", 40.0),
        ("ssb", "iq", 20.0),
    ] {
        let quoted = [pilots, fidelity].map(|it| format!("\"{it}\""));
        let place = format!("[205.0, 100.0, {height_m:.1}]");
        // The bounds depend on the number of angles, so that a short road suffices.
        let short = "[{ length_m = 40.0, turn_rad = 0.05 }]";
        let all = with_circle([
            ("vehicle.receiver.pilots", quoted[0].as_str()),
            ("fidelity", quoted[1].as_str()),
            ("site.radio_heads[0].position_m", place.as_str()),
            ("site.radio_heads[0].eirp_dbm", "5.0"),
            ("site.rician_k_db", "90.0"),
            ("site.radio_heads[1].ssb_index", "2"),
            ("vehicle.array.mounting_rad", "0.7"),
            ("site.road.segments", short),
        ]);
        let scenario = changed("paper-real-odometry-2", all);
        let [ratio, nees, count] = azimuths(&scenario, 3);
        println!("{pilots} {fidelity} {height_m} m: RMSE / bound {ratio:.3}, NEES {nees:.3}");
        // Four standard deviations of the mean of `count` squares; its root has half of them.
        let chance = 4.0 * (2.0 / count).sqrt();
        assert!((1.0 - 0.5 * chance..1.1).contains(&ratio), "{ratio}");
        assert!((nees - 1.0).abs() < chance, "{nees}");
    }
}

#[test]
fn tracker_with_a_circle_is_consistent_and_efficient() {
    let (runs, campaigns) = (6, 100);
    let scenario = changed("paper-real-odometry-2", with_circle([]));
    let bound = Bound::new(&scenario).unwrap();
    let points = bound.along_route();
    let square_m2: f64 = points.iter().map(|it| it.position_rms_m.powi(2)).sum();
    let bound_m = (square_m2 / points.len() as f64).sqrt();
    // Spread of an ideal filter in campaigns of this size.
    let filter = bound.ideal_filter(50);
    let ideal: Vec<_> = (0..campaigns)
        .map(|seed| filter.campaign(seed, runs).consistency(1))
        .collect();
    let found = campaign(&scenario, 11, runs as usize).consistency(50);
    let figures: [fn(&Consistency) -> f64; 2] = [|it| it.rms_m, |it| it.mean_nees];
    let [rms_m, _] = figures.map(|figure| {
        let mean = ideal.iter().map(figure).sum::<f64>() / campaigns as f64;
        let square: f64 = ideal.iter().map(|it| (figure(it) - mean).powi(2)).sum();
        let spread = (square / (campaigns - 1) as f64).sqrt();
        println!("{:.4}, expected {mean:.4} ± {spread:.4}", figure(&found));
        assert!((figure(&found) - mean).abs() < 4.0 * spread);
        mean
    });
    println!("{rms_m:.4} m, bound {bound_m:.4} m");
    assert!(rms_m < 1.1 * bound_m);
}

#[test]
fn positions_and_tables_of_a_circle_give_equal_results() {
    let circle = ArraySettings {
        elements: 5,
        shape: ArrayShape::Circular {},
        ..ArraySettings::default()
    };
    let manifold = circle.any_manifold().unwrap();
    let places = manifold.places_wavelengths().unwrap();
    let part = |it: &Complex64| format!("[{:.9}, {:.9}]", it.re, it.im);
    let elevations: Vec<f64> = (0..=15).map(|step| 0.1 * f64::from(step)).collect();
    let responses = elevations.iter().flat_map(|&elevation_rad| {
        (0..90).map(move |step| {
            (
                elevation_rad,
                std::f64::consts::TAU * f64::from(step) / 90.0,
            )
        })
    });
    let responses = responses.map(|(elevation_rad, azimuth_rad)| {
        let (left, along) = azimuth_rad.sin_cos();
        let towards = [along, left].map(|it| it * elevation_rad.cos());
        let mut response = [Complex64::ZERO; 5];
        manifold.add(Complex64::ONE, towards, &mut response);
        format!(
            "[{}]",
            response.iter().map(part).collect::<Vec<_>>().join(", ")
        )
    });
    let responses = responses.collect::<Vec<_>>().join(", ");
    let planar = format!("{{ kind = \"planar\", places_wavelengths = {places:?} }}");
    let measured = format!(
        "{{ kind = \"measured\", elevations_rad = {elevations:?}, responses = [{responses}] }}"
    );
    let angles = |shape: &str| {
        // Angles are compared one by one, so that a short road suffices.
        let road = "[{ length_m = 60.0, turn_rad = 0.1 }]";
        let all = with_circle([("vehicle.array.shape", shape), ("site.road.segments", road)]);
        let record = run(&changed("paper-real-odometry-2", all), 1, 0);
        let angles = record.aoa_estimates.iter().map(|it| it.measured.unwrap());
        angles
            .map(|it| (it.phase_rad, it.phase_sigma_rad))
            .collect::<Vec<_>>()
    };
    let circle = angles("{ kind = \"circular\" }");
    for (shape, most) in [(planar, 1e-6), (measured, 1e-3)] {
        let others = angles(&shape);
        assert_eq!(others.len(), circle.len());
        let apart = |(one, other): (&(f64, f64), &(f64, f64))| wrap_angle(one.0 - other.0).abs();
        let worst = circle.iter().zip(&others).map(apart).fold(0.0, f64::max);
        println!("{worst:.2e} rad apart");
        for (one, other) in circle.iter().zip(others) {
            assert!(
                wrap_angle(one.0 - other.0).abs() < most,
                "{one:?} {other:?}"
            );
            assert!(
                (one.1 / other.1 - 1.0).abs() < 30.0 * most,
                "{one:?} {other:?}"
            );
        }
    }
}
