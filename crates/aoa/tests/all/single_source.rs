//! One source: exactness, efficiency and reliability.

use std::f64::consts::PI;

use crate::common::{METHODS, Random, exact, oracle};
use aoa::{
    AngleEstimate, Array, Batch, Complex64, Covariance, Method, PseudoSpectrum, Reason, Smoothing,
    UntestedEstimate, Verdict, bound, estimate, estimate_several_smoothed, estimate_untested,
    maximum_likelihood_pilots, maximum_likelihood_pilots_untested,
};

#[test]
fn maximum_likelihood_equals_the_maximum_of_a_dense_grid() {
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
fn efficient_methods_attain_the_stochastic_bound() {
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

#[test]
fn constant_snapshots_are_as_accurate_as_random_ones() {
    // Despread pilots give an equal vector in every snapshot; removing the mean would remove the
    // signal.
    let array = Array::<4>::half_wavelength();
    let mut random = Random::new(3);
    let amplitude = 10.0;
    for method in METHODS {
        let (mut squares, mut bounds) = (0.0, 0.0);
        for _ in 0..2000 {
            let angle = random.uniform(20.0, 160.0).to_radians();
            let a = array.steering_vector(array.phase_from_angle(angle));
            let snapshots: Vec<_> = (0..20)
                .map(|_| a.map(|element| element * amplitude + random.gaussian()))
                .collect();
            let covariance = Covariance::from_snapshots(&snapshots).unwrap();
            squares += (estimate(method, &covariance, &array).unwrap().angle_rad - angle).powi(2);
            let sigma = bound::deterministic::<4>(amplitude * amplitude, 20);
            bounds += bound::angle_sigma_rad(sigma, angle, &array).powi(2);
        }
        let ratio = (squares / bounds).sqrt();
        assert!(ratio < 1.12, "{method:?}: RMSE / bound {ratio}");
    }
}

#[test]
fn music_finds_the_highest_peak_for_all_directions() {
    // A grid of a hundred points per antenna contains no higher value, also for noise only. Peaks
    // whose heights differ by less than the resolution of the coarse search are exempt.
    fn check<const N: usize>(random: &mut Random) {
        let array = Array::<N>::half_wavelength();
        for trial in 0..60 {
            let snr_db = [20.0, 5.0, -5.0, -40.0][trial % 4];
            let angle = random.uniform(0.0, 3.1);
            let snapshots = random.snapshots(&array, &[(angle, snr_db)], 20);
            let covariance = Covariance::from_snapshots(&snapshots).unwrap();
            let found = estimate(Method::Music, &covariance, &array)
                .unwrap()
                .phase_rad;
            let points = 100 * N as i32;
            let mut angles: Vec<f64> = (-points..points)
                .map(|g| array.angle_from_phase(PI * f64::from(g) / f64::from(points)))
                .collect();
            angles.push(array.angle_from_phase(found));
            let music = PseudoSpectrum::Music { sources: 1 };
            let spectrum = music.at(&covariance, &array, &angles).unwrap();
            // Fraction of a^H a in the signal subspace.
            let share = |height: &f64| 1.0 - height.recip();
            let highest = spectrum.iter().map(share).fold(0.0, f64::max);
            let here = spectrum.last().map_or(0.0, share);
            assert!(here > 0.96 * highest, "N = {N}: {here} of {highest}");
            if snr_db > 0.0 {
                assert!(
                    here > highest * (1.0 - 1e-12),
                    "N = {N}: {here} of {highest}"
                );
            }
        }
    }
    let mut random = Random::new(4);
    check::<2>(&mut random);
    check::<3>(&mut random);
    check::<4>(&mut random);
    check::<8>(&mut random);
    check::<16>(&mut random);
}

#[test]
fn root_music_selects_the_root_nearest_to_the_circle() {
    fn check<const N: usize>(random: &mut Random) {
        let array = Array::<N>::half_wavelength();
        let mut compared = 0;
        for trial in 0..200 {
            let angle = random.uniform(0.3, 2.8);
            let snr_db = f64::from(trial % 5) * 10.0;
            let snapshots = random.snapshots(&array, &[(angle, snr_db)], 20);
            let covariance = Covariance::from_snapshots(&snapshots).unwrap();
            let at_the_peak = estimate(Method::RootMusic, &covariance, &array).unwrap();
            // With subarrays as large as the array, all roots are computed.
            let of_all =
                estimate_several_smoothed::<N, N>(Method::RootMusic, &covariance, &array, 1, false);
            if at_the_peak.is_resolved() {
                compared += 1;
                let difference = at_the_peak.phase_rad - of_all.unwrap()[0].phase_rad;
                assert!(
                    difference.abs() < 1e-9,
                    "N = {N}, {snr_db} dB: {difference}"
                );
            }
        }
        assert!(compared > 100, "{compared}");
    }
    let mut random = Random::new(9);
    check::<2>(&mut random);
    check::<4>(&mut random);
    check::<5>(&mut random);
    check::<8>(&mut random);
    check::<16>(&mut random);
}

#[test]
fn the_result_of_an_item_does_not_depend_on_its_neighbours() {
    let array = Array::<4>::half_wavelength();
    let mut random = Random::new(10);
    let mut samples = Vec::new();
    for item in 0..150 {
        let truth = [(random.uniform(0.1, 3.0), f64::from(item % 7) * 10.0 - 20.0)];
        let snapshots = random.snapshots(&array, &truth, 6);
        for n in 0..4 {
            samples.extend(snapshots.iter().map(|snapshot| snapshot[n]));
        }
    }
    let batch = Batch::<f64, 4>::new(&samples, 6).unwrap();
    for method in METHODS {
        let mut whole = vec![AngleEstimate::default(); 150];
        let none = Smoothing::default();
        batch.estimate(method, &array, none, 1, &mut whole).unwrap();
        for size in [1, 5, 37] {
            let mut parts = vec![AngleEstimate::default(); 150];
            for (part, places) in batch.split(size).zip(parts.chunks_mut(size)) {
                part.estimate(method, &array, none, 1, places).unwrap();
            }
            assert_eq!(whole, parts, "{method:?} by {size}");
        }
    }
}

#[test]
fn a_batch_equals_single_calls() {
    fn check<const N: usize>() {
        let array = Array::<N>::new(0.45).unwrap();
        let mut random = Random::new(5);
        let (items, count) = (150, 7);
        let mut samples = Vec::new();
        let mut singles = Vec::new();
        for item in 0..items {
            let truth = [(random.uniform(0.1, 3.0), f64::from(item % 5) * 8.0 - 8.0)];
            let snapshots = random.snapshots(&array, &truth, count);
            for n in 0..N {
                samples.extend(snapshots.iter().map(|snapshot| snapshot[n]));
            }
            let covariance = Covariance::from_snapshots(&snapshots).unwrap();
            singles.push(METHODS.map(|method| estimate(method, &covariance, &array).unwrap()));
        }
        let narrow: Vec<_> = samples
            .iter()
            .map(|z| num_complex::Complex::new(z.re as f32, z.im as f32))
            .collect();
        for (m, method) in METHODS.into_iter().enumerate() {
            let mut batch = vec![AngleEstimate::default(); items as usize];
            let view = Batch::<f64, N>::new(&samples, count).unwrap();
            view.estimate(method, &array, Smoothing::default(), 1, &mut batch)
                .unwrap();
            let mut batch_narrow = batch.clone();
            let view = Batch::<f32, N>::new(&narrow, count).unwrap();
            view.estimate(method, &array, Smoothing::default(), 1, &mut batch_narrow)
                .unwrap();
            for (item, single) in singles.iter().enumerate() {
                let single = single[m];
                for (other, tolerance) in [(batch[item], 1e-8), (batch_narrow[item], 2e-4)] {
                    let differs = |a: f64, b: f64| (a - b).abs() > tolerance * (1.0 + b.abs());
                    assert_eq!(other.verdict, single.verdict, "{method:?} {item}");
                    assert!(
                        !differs(other.phase_rad, single.phase_rad),
                        "{other:?} {single:?}"
                    );
                    assert!(
                        !differs(other.snr_db, single.snr_db),
                        "{other:?} {single:?}"
                    );
                    if tolerance < 1e-6 {
                        assert!(!differs(other.angle_rad, single.angle_rad));
                        assert!(!differs(other.sigma_rad, single.sigma_rad));
                        assert!(!differs(other.phase_sigma_rad, single.phase_sigma_rad));
                    }
                }
            }
        }
    }
    check::<2>();
    check::<3>();
    check::<4>();
    check::<8>();
}

#[test]
fn estimates_without_goodness_of_fit_have_equal_values() {
    let array = Array::<4>::half_wavelength();
    let mut random = Random::new(31);
    let count = 12;
    let mut samples = Vec::new();
    let mut blocks = Vec::new();
    for item in 0..90 {
        // Every third item has a reflection, so that the model does not fit.
        let mut truth = vec![(random.uniform(0.1, 3.0), f64::from(item % 4) * 8.0 - 6.0)];
        if item % 3 == 0 {
            truth.push((random.uniform(0.1, 3.0), truth[0].1 - 3.0));
        }
        let snapshots = random.snapshots(&array, &truth, count);
        for n in 0..4 {
            samples.extend(snapshots.iter().map(|snapshot| snapshot[n]));
        }
        blocks.push(snapshots);
    }
    let equal = |untested: &UntestedEstimate, tested: &AngleEstimate| {
        assert_eq!(untested.phase_rad, tested.phase_rad);
        assert_eq!(untested.phase_noise_sigma_rad, tested.phase_noise_sigma_rad);
        assert_eq!(untested.angle_rad, tested.angle_rad);
        assert_eq!(untested.snr_db, tested.snr_db);
        assert_eq!(untested.is_resolved(), tested.is_resolved());
        if tested.fit.misfit().is_none() {
            assert_eq!(untested.sigma_rad, tested.sigma_rad);
            assert_eq!(untested.verdict, tested.verdict);
        }
        tested.fit.misfit().is_some()
    };
    for method in METHODS {
        let batch = Batch::<f64, 4>::new(&samples, count).unwrap();
        let mut tested = vec![AngleEstimate::default(); blocks.len()];
        let mut untested = vec![UntestedEstimate::default(); blocks.len()];
        batch
            .estimate(method, &array, Smoothing::default(), 1, &mut tested)
            .unwrap();
        batch
            .estimate_untested(method, &array, &mut untested)
            .unwrap();
        let pairs = untested.iter().zip(&tested);
        let misfits = pairs
            .filter(|(untested, tested)| equal(untested, tested))
            .count();
        assert!((10..80).contains(&misfits), "{method:?}: {misfits}");
        let covariance = Covariance::from_snapshots(&blocks[0]).unwrap();
        let single = estimate(method, &covariance, &array).unwrap();
        equal(
            &estimate_untested(method, &covariance, &array).unwrap(),
            &single,
        );
    }
    for noise_variance in [None, Some(1.0)] {
        for blocks in &blocks {
            let tested = maximum_likelihood_pilots(blocks, noise_variance, &array).unwrap();
            let untested = maximum_likelihood_pilots_untested(blocks, noise_variance, &array);
            equal(&untested.unwrap(), &tested);
        }
    }
}

#[test]
fn verdicts_reject_unreliable_estimates() {
    let array = Array::<4>::half_wavelength();
    let mut random = Random::new(6);
    let of = |snapshots: &[[Complex64; 4]]| {
        let covariance = Covariance::from_snapshots(snapshots).unwrap();
        estimate(Method::MaximumLikelihood, &covariance, &array).unwrap()
    };
    let trials = 2000;
    // Noise alone rarely resembles a source.
    let nominal = (0..trials)
        .filter(|_| of(&random.snapshots(&array, &[], 20)).is_resolved())
        .count();
    assert!(nominal < trials / 10, "{nominal} of {trials}");
    // In the threshold region, resolved estimates are correct.
    for snr_db in [-8.0, -5.0, -2.0, 0.0] {
        let (mut wrong, mut resolved) = (0, 0);
        for _ in 0..trials {
            let angle = random.uniform(20.0, 160.0).to_radians();
            let found = of(&random.snapshots(&array, &[(angle, snr_db)], 20));
            if found.is_resolved() {
                resolved += 1;
                let error = found.phase_rad - array.phase_from_angle(angle);
                wrong += usize::from(error.abs() > 5.0 * found.phase_sigma_rad);
            }
        }
        assert!(
            wrong * 50 <= resolved,
            "{snr_db} dB: {wrong} of {resolved} wrong"
        );
    }
    let good = (0..trials)
        .filter(|_| of(&random.snapshots(&array, &[(1.2, 5.0)], 20)).is_resolved())
        .count();
    assert!(good * 100 > trials * 99, "{good} of {trials}");
    // Near the axis, the opposite direction fits as well.
    let found = of(&random.snapshots(&array, &[(0.02, 20.0)], 20));
    assert_eq!(found.verdict, Verdict::Unresolved(Reason::NearEndFire));
    assert!(found.sigma_rad.is_finite());
    assert_eq!(
        found.verdict.to_string(),
        "unresolved: too near to the array's axis"
    );
    // With a spacing of one wavelength, every direction is ambiguous.
    let wide = Array::<4>::new(1.0).unwrap();
    let covariance = Covariance::from_matrix(exact(&wide, &[(1.2, 20.0)]), 20).unwrap();
    let found = estimate(Method::RootMusic, &covariance, &wide).unwrap();
    assert_eq!(found.verdict, Verdict::Unresolved(Reason::Ambiguous));
}

#[test]
fn streaming_and_batch_covariances_agree() {
    let array = Array::<3>::half_wavelength();
    let snapshots = Random::new(8).snapshots(&array, &[(1.0, 3.0)], 11);
    let mut streaming = Covariance::<3>::new();
    streaming.accumulate(&snapshots[0], 1.0);
    streaming.reset();
    for snapshot in &snapshots {
        streaming.accumulate(snapshot, 2.5);
    }
    let whole = Covariance::from_snapshots(&snapshots).unwrap();
    assert_eq!(streaming.snapshots(), 11);
    let rows: [Vec<_>; 3] = std::array::from_fn(|n| snapshots.iter().map(|x| x[n]).collect());
    let channels = Covariance::from_channels([&rows[0][..], &rows[1], &rows[2]]).unwrap();
    for (i, row) in whole.matrix().iter().enumerate() {
        for (j, entry) in row.iter().enumerate() {
            assert!((streaming.matrix()[i][j] - entry).norm() < 1e-12);
            assert!((channels.matrix()[i][j] - entry).norm() < 1e-12);
        }
    }
}
