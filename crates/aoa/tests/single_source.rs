//! One source: exactness, efficiency, and what the estimates say about themselves.

mod common;

use aoa::{Array, Covariance, Method, bound, estimate};
use common::{METHODS, Random, exact, oracle};

#[test]
fn maximum_likelihood_is_the_maximum_of_a_dense_grid() {
    let array = Array::<4>::half_wavelength();
    let mut random = Random::new(1);
    for trial in 0..200 {
        let angle = random.uniform(0.1, 3.0);
        let snapshots =
            random.snapshots(&array, &[(angle, -10.0 + f64::from(trial % 4) * 10.0)], 20);
        let covariance = Covariance::from_snapshots(&snapshots).unwrap();
        let expected = oracle(&array, &covariance.matrix());
        let found = estimate(Method::MaximumLikelihood, &covariance, &array)
            .unwrap()
            .phase_rad;
        let off = (found - expected + 9.0 * std::f64::consts::PI).rem_euclid(std::f64::consts::TAU)
            - std::f64::consts::PI;
        assert!(
            off.abs() < 4e-4,
            "trial {trial}: {found} instead of {expected}"
        );
    }
}

#[test]
fn every_method_is_exact_on_the_exact_covariance() {
    let array = Array::<4>::half_wavelength();
    for degrees in 15..=165 {
        let angle = f64::from(degrees).to_radians();
        let covariance = Covariance::from_matrix(exact(&array, &[(angle, 10.0)]), 20).unwrap();
        for method in METHODS {
            let found = estimate(method, &covariance, &array).unwrap();
            assert!(
                (found.angle_rad - angle).abs() < 1e-9,
                "{method:?} {degrees}: {found:?}"
            );
            assert!(
                (found.snr_db - 10.0).abs() < 1e-6,
                "{method:?} {degrees}: {found:?}"
            );
        }
    }
}

#[test]
fn efficient_methods_reach_the_stochastic_bound() {
    let array = Array::<4>::half_wavelength();
    for snr_db in [10.0, 20.0, 30.0] {
        let snr = 10.0_f64.powf(snr_db / 10.0);
        let mut squares = [0.0; METHODS.len()];
        let mut normalised = [0.0; METHODS.len()];
        let mut bound_squared = 0.0;
        let trials = 4000;
        let mut random = Random::new(7);
        for _ in 0..trials {
            let angle = random.uniform(20.0, 160.0).to_radians();
            let snapshots = random.snapshots(&array, &[(angle, snr_db)], 20);
            let covariance = Covariance::from_snapshots(&snapshots).unwrap();
            let sigma = bound::stochastic::<4>(snr, 20);
            bound_squared += bound::angle_sigma_rad(sigma, angle, &array).powi(2);
            for (m, method) in METHODS.into_iter().enumerate() {
                let found = estimate(method, &covariance, &array).unwrap();
                squares[m] += (found.angle_rad - angle).powi(2);
                normalised[m] += ((found.angle_rad - angle) / found.sigma_rad).powi(2);
            }
        }
        for m in 0..METHODS.len() {
            let ratio = (squares[m] / bound_squared).sqrt();
            let consistency = normalised[m] / f64::from(trials);
            println!(
                "{snr_db} dB {:?}: RMSE / bound {ratio:.3}, NEES {consistency:.3}",
                METHODS[m]
            );
            let limit = if m < 3 { 1.08 } else { 1.14 };
            assert!(ratio < limit, "{:?} at {snr_db} dB: {ratio}", METHODS[m]);
            assert!(
                (0.85..1.2).contains(&consistency),
                "{:?}: NEES {consistency}",
                METHODS[m]
            );
        }
    }
}
