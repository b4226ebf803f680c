//! Several sources.

use crate::common::{METHODS, Random, exact};
use aoa::{
    AngleEstimate, Array, Batch, Complex64, Covariance, Criterion, Method, PseudoSpectrum, Reason,
    Smoothing, Verdict, bound, estimate_several, estimate_several_smoothed, source_count,
};

#[test]
fn every_method_is_exact_on_the_exact_covariance_of_two_sources() {
    fn check<const N: usize>(spacing: f64) {
        let array = Array::<N>::new(spacing).unwrap();
        for (first, second) in [(65.0, 100.0), (20.0, 160.0), (80.0, 90.0), (100.0, 115.0)] {
            let truth = [f64::to_radians(first), f64::to_radians(second)];
            let matrix = exact(&array, &[(truth[0], 10.0), (truth[1], 3.0)]);
            let covariance = Covariance::from_matrix(matrix, 1000).unwrap();
            for method in &METHODS {
                let found = estimate_several(*method, &covariance, &array, 2).unwrap();
                for (estimate, angle) in found.iter().zip(truth) {
                    let error_deg = (estimate.angle_rad - angle).to_degrees().abs();
                    assert!(
                        error_deg < 1e-6,
                        "N {N} {method:?} {first} {second}: {error_deg}"
                    );
                }
                assert_eq!(found.len(), 2);
            }
        }
    }
    check::<3>(0.5);
    check::<4>(0.5);
    check::<4>(0.4);
    check::<8>(0.5);
}

#[test]
fn one_source_less_than_antennas_is_resolved() {
    let array = Array::<4>::half_wavelength();
    let truth: [f64; 3] = [40.0, 75.0, 120.0];
    let sources = truth.map(|degrees| (degrees.to_radians(), 10.0));
    let covariance = Covariance::from_matrix(exact(&array, &sources), 1000).unwrap();
    for method in &METHODS {
        let found = estimate_several(*method, &covariance, &array, 3).unwrap();
        for (estimate, degrees) in found.iter().zip(truth) {
            assert!(
                (estimate.angle_rad.to_degrees() - degrees).abs() < 1e-6,
                "{method:?}"
            );
            assert!(
                (estimate.snr_db - 10.0).abs() < 1e-5,
                "{method:?} {estimate:?}"
            );
        }
    }
}

#[test]
fn estimates_of_two_sources_are_near_the_bound_and_consistent() {
    let array = Array::<4>::half_wavelength();
    let truth = [1.1, 1.8];
    let phases = truth.map(|angle| array.phase_from_angle(angle));
    let bounds = bound::stochastic_several::<4>(&phases, &[100.0, 10.0], 50).unwrap();
    let mut random = Random::new(11);
    let trials = 2000;
    for (method, limit) in METHODS.iter().zip([1.15, 1.15, 1.15, 1.4, 1.4]) {
        let (mut squares, mut normalised) = ([0.0; 2], [0.0; 2]);
        for _ in 0..trials {
            let snapshots = random.snapshots(&array, &[(truth[0], 20.0), (truth[1], 10.0)], 50);
            let covariance = Covariance::from_snapshots(&snapshots).unwrap();
            let found = estimate_several(*method, &covariance, &array, 2).unwrap();
            for k in 0..2 {
                let error = found[k].phase_rad - phases[k];
                squares[k] += error * error;
                normalised[k] += (error / found[k].phase_sigma_rad).powi(2);
                assert!(found[k].is_resolved());
            }
        }
        for k in 0..2 {
            let ratio = (squares[k] / f64::from(trials)).sqrt() / bounds[k];
            let consistency = normalised[k] / f64::from(trials);
            println!("{method:?} source {k}: RMSE / bound {ratio:.3}, NEES {consistency:.3}");
            assert!(ratio < limit, "{method:?} source {k}: {ratio}");
            assert!(
                (0.8..limit * limit * 1.1).contains(&consistency),
                "{method:?}: {consistency}"
            );
        }
    }
}

#[test]
fn coherent_sources_require_averaging() {
    // A reflection has the waveform of the direct path, so that R has rank one.
    let array = Array::<4>::half_wavelength();
    let truth: [f64; 2] = [60.0, 105.0];
    let [direct, reflected] =
        truth.map(|degrees| array.steering_vector(array.phase_from_angle(degrees.to_radians())));
    let coherent: [Complex64; 4] =
        std::array::from_fn(|n| direct[n] + reflected[n] * Complex64::from_polar(0.8, 1.0));
    let covariance = Covariance::from_snapshots(&[coherent; 10]).unwrap();
    for method in &METHODS[1..] {
        let found = estimate_several_smoothed::<4, 4>(*method, &covariance, &array, 2, true);
        let small = estimate_several_smoothed::<4, 3>(*method, &covariance, &array, 2, false);
        let (found, small) = (found.unwrap(), small.unwrap());
        for k in 0..2 {
            assert!(
                (found[k].angle_rad.to_degrees() - truth[k]).abs() < 1e-4,
                "{method:?}"
            );
            assert!(
                (small[k].angle_rad.to_degrees() - truth[k]).abs() < 1e-4,
                "{method:?}"
            );
        }
    }
}

/// Returns snapshots of two sources of 15 dB with correlated waveforms in unit noise.
fn correlated<const N: usize>(
    random: &mut Random,
    phases: [f64; 2],
    correlation: f64,
    count: usize,
) -> Vec<[Complex64; N]> {
    let array = Array::<N>::half_wavelength();
    let responses = phases.map(|phase| array.steering_vector(phase));
    let amplitude = 10.0_f64.powf(15.0 / 20.0);
    let own = (1.0 - correlation * correlation).max(0.0).sqrt();
    (0..count)
        .map(|_| {
            let (one, other) = (random.gaussian(), random.gaussian());
            // The phase of the correlation is neither 0 nor 90 degrees.
            let second = one * Complex64::from_polar(correlation, -0.8) + other * own;
            std::array::from_fn(|n| {
                (responses[0][n] * one + responses[1][n] * second) * amplitude + random.gaussian()
            })
        })
        .collect()
}

/// Returns the mean normalised squared error of the resolved estimates, and the resolved fraction.
fn consistency<const N: usize, const M: usize>(
    random: &mut Random,
    method: Method,
    correlation: f64,
    forward_backward: bool,
) -> (f64, f64) {
    let array = Array::<N>::half_wavelength();
    let phases = [-0.7, 0.9];
    let trials = 400;
    let (mut sum, mut resolved) = (0.0, 0.0);
    for _ in 0..trials {
        let snapshots = correlated::<N>(random, phases, correlation, 50);
        let covariance = Covariance::from_snapshots(&snapshots).unwrap();
        let found = if N == M && !forward_backward {
            estimate_several(method, &covariance, &array, 2)
                .unwrap()
                .to_vec()
        } else {
            let found =
                estimate_several_smoothed::<N, M>(method, &covariance, &array, 2, forward_backward);
            found.unwrap().to_vec()
        };
        // Ascending angle is descending phase.
        for (estimate, phase) in found.iter().zip([0.9, -0.7]) {
            if estimate.is_resolved() {
                resolved += 1.0;
                sum += ((estimate.phase_rad - phase) / estimate.phase_sigma_rad).powi(2);
            }
        }
    }
    (
        sum / f64::max(resolved, 1.0),
        resolved / (2.0 * f64::from(trials)),
    )
}

#[test]
fn resolved_estimates_are_consistent_for_any_correlation() {
    let mut random = Random::new(15);
    for method in &METHODS {
        for correlation in [0.0, 0.5, 0.9, 0.95, 0.99, 1.0] {
            for (name, (nees, resolved)) in [
                (
                    "4",
                    consistency::<4, 4>(&mut random, *method, correlation, false),
                ),
                (
                    "4, averaged",
                    consistency::<4, 4>(&mut random, *method, correlation, true),
                ),
                (
                    "4, by 3",
                    consistency::<4, 3>(&mut random, *method, correlation, false),
                ),
                (
                    "8",
                    consistency::<8, 8>(&mut random, *method, correlation, false),
                ),
                (
                    "8, by 6, averaged",
                    consistency::<8, 6>(&mut random, *method, correlation, true),
                ),
            ] {
                println!("{method:?} {correlation} {name}: NEES {nees:.2}, resolved {resolved:.2}");
                // Tolerance: four standard deviations of the mean of the squares.
                let chance = 4.0 * (2.0 / (800.0 * resolved).max(1.0)).sqrt();
                assert!(
                    nees < 1.3 + chance,
                    "{method:?} {correlation} {name}: {nees}"
                );
                // Coherent sources require averaging, except with maximum likelihood.
                let likely = *method == Method::MaximumLikelihood;
                if name.ends_with("averaged") || correlation < 0.6 || likely {
                    assert!(
                        resolved > 0.9,
                        "{method:?} {correlation} {name}: {resolved}"
                    );
                }
            }
        }
    }
}

#[test]
fn a_batch_is_smoothed_like_a_single_covariance() {
    let mut random = Random::new(17);
    let array = Array::<6>::half_wavelength();
    let snapshots = correlated::<6>(&mut random, [-0.7, 0.9], 0.9, 40);
    let channels: Vec<Complex64> = (0..6)
        .flat_map(|n| snapshots.iter().map(move |snapshot| snapshot[n]))
        .collect();
    let batch = Batch::<f64, 6>::new(&channels, 40).unwrap();
    let covariance = Covariance::from_snapshots(&snapshots).unwrap();
    let smoothing = Smoothing {
        forward_backward: true,
        subarray: Some(4),
    };
    let mut found = [AngleEstimate::default(); 2];
    for method in &METHODS {
        batch
            .estimate(*method, &array, smoothing, 2, &mut found)
            .unwrap();
        let expected = estimate_several_smoothed::<6, 4>(*method, &covariance, &array, 2, true);
        for (found, expected) in found.iter().zip(expected.unwrap().iter()) {
            assert!((found.phase_rad - expected.phase_rad).abs() < 1e-9);
            assert!((found.phase_sigma_rad / expected.phase_sigma_rad - 1.0).abs() < 1e-9);
        }
    }
}

/// Returns the bound of the electrical angles of the coherent sources of [`correlated`] with
/// unknown waveforms: `C^-1 = 2 L Re[(D^H P D) * S^T]` (Stoica and Nehorai 1989).
fn coherent_bound(phases: [f64; 2], count: usize) -> [f64; 2] {
    let steering = phases.map(|phase| Array::<4>::half_wavelength().steering_vector(phase));
    let derivatives: [[Complex64; 4]; 2] =
        steering.map(|a| std::array::from_fn(|n| a[n] * Complex64::new(0.0, n as f64)));
    let dot = |a: &[Complex64; 4], b: &[Complex64; 4]| -> Complex64 {
        a.iter().zip(b).map(|(a, b)| a.conj() * b).sum()
    };
    // Gram–Schmidt orthogonalisation.
    let second = dot(&steering[0], &steering[1]) / 4.0;
    let second: [Complex64; 4] = std::array::from_fn(|n| steering[1][n] - steering[0][n] * second);
    let power = dot(&second, &second).re;
    let metric = |i: usize, j: usize| {
        let [a, b] = [&derivatives[i], &derivatives[j]];
        dot(a, b)
            - dot(a, &steering[0]) * dot(&steering[0], b) / 4.0
            - dot(a, &second) * dot(&second, b) / power
    };
    let snr = 10.0_f64.powf(1.5);
    let scale = 2.0 * count as f64 * snr;
    let [own, other] = [metric(0, 0).re * scale, metric(1, 1).re * scale];
    let cross = (metric(0, 1) * Complex64::from_polar(1.0, -0.8)).re * scale;
    let determinant = own * other - cross * cross;
    [(other / determinant).sqrt(), (own / determinant).sqrt()]
}

#[test]
fn maximum_likelihood_separates_coherent_sources_without_averaging() {
    let array = Array::<4>::half_wavelength();
    let phases = [-0.7, 0.9];
    let mut random = Random::new(18);
    let mut squares = [0.0; 2];
    let trials = 1000;
    for _ in 0..trials {
        let snapshots = correlated::<4>(&mut random, phases, 1.0, 50);
        let covariance = Covariance::from_snapshots(&snapshots).unwrap();
        let found = estimate_several(Method::MaximumLikelihood, &covariance, &array, 2).unwrap();
        for (square, (estimate, phase)) in squares.iter_mut().zip(found.iter().zip([0.9, -0.7])) {
            *square += (estimate.phase_rad - phase).powi(2);
        }
    }
    let rms = squares.map(|square| (square / f64::from(trials)).sqrt());
    let bounds = coherent_bound(phases, 50);
    let bounds = [bounds[1], bounds[0]];
    println!("{rms:?} {bounds:?}");
    for (rms, bound) in rms.iter().zip(bounds) {
        assert!(rms / bound < 1.1, "{rms} {bound}");
    }
}

#[test]
fn spectra_have_the_power_of_the_sources() {
    let array = Array::<8>::half_wavelength();
    // SNRs of 10 and 5 dB in unit noise.
    let sources = [(1.1, 10.0), (2.0, 5.0)];
    let covariance = Covariance::from_matrix(exact(&array, &sources), 100).unwrap();
    let angles = [1.1, 2.0, 1.55];
    let at = |kind: PseudoSpectrum| kind.at(&covariance, &array, &angles).unwrap();
    let bartlett = at(PseudoSpectrum::Bartlett);
    let capon = at(PseudoSpectrum::Capon);
    for (k, (_, snr_db)) in sources.iter().enumerate() {
        // The noise adds 1/8 with eight antennas. Bartlett also receives the other source with a
        // side lobe of at most -13 dB.
        let power = 10.0_f64.powf(0.1 * snr_db) + 1.0 / 8.0;
        assert!((capon[k] / power - 1.0).abs() < 0.02, "{capon:?}");
        assert!((0.9..1.3).contains(&(bartlett[k] / power)), "{bartlett:?}");
    }
    assert!(
        capon[2] < 0.3 && bartlett[2] < 1.5,
        "{capon:?} {bartlett:?}"
    );
    let music = at(PseudoSpectrum::Music { sources: 2 });
    assert!(
        music[0] > 1e9 && music[1] > 1e9 && music[2] < 10.0,
        "{music:?}"
    );
}

#[test]
fn coherent_sources_are_reported_as_correlated() {
    let mut random = Random::new(16);
    let array = Array::<4>::half_wavelength();
    for method in &METHODS[1..] {
        let snapshots = correlated::<4>(&mut random, [-0.7, 0.9], 1.0, 50);
        let covariance = Covariance::from_snapshots(&snapshots).unwrap();
        let found = estimate_several(*method, &covariance, &array, 2).unwrap();
        let correlated = |it: &AngleEstimate| it.verdict == Verdict::Unresolved(Reason::Correlated);
        assert!(found.iter().all(correlated), "{method:?} {found:?}");
    }
}

#[test]
fn sources_below_the_resolution_limit_are_not_separated() {
    let array = Array::<4>::half_wavelength();
    let mut random = Random::new(12);
    let resolved = (0..200)
        .filter(|_| {
            let snapshots = random.snapshots(&array, &[(1.50, 3.0), (1.53, 3.0)], 20);
            let covariance = Covariance::from_snapshots(&snapshots).unwrap();
            let found = estimate_several(METHODS[1], &covariance, &array, 2).unwrap();
            found.iter().any(aoa::AngleEstimate::is_resolved)
        })
        .count();
    assert!(resolved <= 10, "{resolved} of 200 claimed to be resolved");
}

#[test]
fn the_number_of_sources_is_estimated() {
    let array = Array::<5>::half_wavelength();
    let mut random = Random::new(13);
    let sources = [(0.9, 10.0), (1.5, 10.0), (2.2, 10.0)];
    for count in 0..=3 {
        let (mut mdl, mut aic) = (0, 0);
        for _ in 0..200 {
            let snapshots = random.snapshots(&array, &sources[..count], 100);
            let covariance = Covariance::from_snapshots(&snapshots).unwrap();
            mdl += usize::from(source_count(Criterion::Mdl, &covariance) == Ok(count));
            aic += usize::from(source_count(Criterion::Aic, &covariance) == Ok(count));
        }
        assert!(mdl >= 196, "MDL {count}: {mdl} of 200");
        assert!(aic >= 160, "AIC {count}: {aic} of 200");
    }
}
