//! Invalid inputs give an error or an estimate with finite numbers, never a panic.

use crate::common::{METHODS, Random};
use aoa::{
    Array, Batch, Complex64, Covariance, Criterion, Error, PseudoSpectrum, Smoothing, bound,
    estimate, estimate_several, source_count,
};

#[test]
fn every_invalid_input_gives_a_specific_error() {
    let good = [Complex64::ONE; 4];
    assert_eq!(
        Covariance::<4>::from_snapshots(&[]),
        Err(Error::NoSnapshots)
    );
    assert_eq!(
        Covariance::from_snapshots(&[[Complex64::ZERO; 4]; 3]),
        Err(Error::Zero)
    );
    for bad in [f64::NAN, f64::INFINITY, f64::MAX] {
        let mut snapshot = good;
        snapshot[2].im = bad;
        assert_eq!(
            Covariance::from_snapshots(&[good, snapshot]),
            Err(Error::NotFinite)
        );
    }
    for spacing in [0.0, -0.5, 1e-300, 101.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(Array::<4>::new(spacing), Err(Error::Spacing(_))));
    }
    let mut matrix = [[Complex64::ONE; 4]; 4];
    matrix[0][1] = Complex64::new(0.0, 1.0);
    assert_eq!(Covariance::from_matrix(matrix, 5), Err(Error::NotHermitian));
    assert_eq!(
        Covariance::from_matrix([[Complex64::ONE; 4]; 4], 0),
        Err(Error::NoSnapshots)
    );

    // An off-diagonal entry exceeds the diagonal.
    let mut matrix = [[Complex64::from(2.0); 4]; 4];
    for (n, row) in matrix.iter_mut().enumerate() {
        row[n] = Complex64::ONE;
    }
    assert_eq!(Covariance::from_matrix(matrix, 5), Err(Error::Indefinite));

    let array = Array::<4>::half_wavelength();
    let covariance = Covariance::from_snapshots(&[good; 4]).unwrap();
    for criterion in [Criterion::Aic, Criterion::Mdl] {
        let (snapshots, needed) = (4, 5);
        assert_eq!(
            source_count(criterion, &covariance),
            Err(Error::TooFewSnapshots { snapshots, needed })
        );
    }
    for angle in [-0.1, 3.2, f64::NAN] {
        let result = PseudoSpectrum::Bartlett.at(&covariance, &array, &[1.0, angle]);
        assert!(matches!(result, Err(Error::Angle(_))), "{angle}");
    }
    let silent_beside = PseudoSpectrum::Capon.at(&covariance, &array, &[1.0]);
    assert_eq!(silent_beside, Err(Error::Singular));
    for sources in [0, 4] {
        let kind = PseudoSpectrum::Music { sources };
        let result = kind.at(&covariance, &array, &[1.0]);
        assert!(matches!(result, Err(Error::TooManySources { .. })));
    }
    let samples: Vec<Complex64> = [good; 6].concat();
    for subarray in [0, 1, 5, usize::MAX] {
        let smoothing = Smoothing {
            subarray: Some(subarray),
            ..Smoothing::default()
        };
        let batch = Batch::<f64, 4>::new(&samples, 6).unwrap();
        let mut places = [aoa::AngleEstimate::default()];
        let error = batch
            .estimate(METHODS[1], &array, smoothing, 1, &mut places)
            .unwrap_err();
        assert_eq!(
            error.error,
            Error::Subarray {
                subarray,
                antennas: 4
            }
        );
    }
    for (method, requested, maximum) in [
        (METHODS[0], 4, 3),
        (METHODS[1], 4, 3),
        (METHODS[2], 0, 3),
        (METHODS[4], 99, 3),
    ] {
        let error = estimate_several(method, &covariance, &array, requested).unwrap_err();
        assert_eq!(error, Error::TooManySources { requested, maximum });
    }
    let mut streamed = Covariance::<4>::new();
    assert_eq!(
        estimate(METHODS[0], &streamed, &array),
        Err(Error::NoSnapshots)
    );
    streamed.accumulate(&good, f64::NAN);
    assert_eq!(
        estimate(METHODS[0], &streamed, &array),
        Err(Error::NotFinite)
    );
    assert!(matches!(
        source_count(Criterion::Mdl, &streamed),
        Err(Error::NotFinite)
    ));

    assert!(bound::stochastic_several::<4>(&[0.1, 0.1], &[1.0, 1.0], 20).is_err());
    assert!(bound::stochastic_several::<4>(&[0.1; 4], &[1.0; 4], 20).is_err());
    assert!(bound::deterministic_several::<4>(&[0.1], &[-1.0], 20).is_err());
}

#[test]
fn a_batch_reports_the_invalid_item() {
    let array = Array::<2>::half_wavelength();
    let mut samples = vec![Complex64::ONE; 2 * 3 * 200];
    samples[2 * 3 * 130 + 4].re = f64::NAN;
    let mut estimates = vec![aoa::AngleEstimate::default(); 200];
    for method in METHODS {
        let batch = Batch::<f64, 2>::new(&samples, 3).unwrap();
        let error = batch
            .estimate(method, &array, Smoothing::default(), 1, &mut estimates)
            .unwrap_err();
        assert_eq!(
            (error.item, error.error),
            (130, Error::NotFinite),
            "{method:?}"
        );
    }
    assert!(Batch::<f64, 2>::new(&samples, 0).is_err());
    for snapshots in [1 << 63, usize::MAX] {
        let error = Batch::<f64, 2>::new(&[], snapshots).unwrap_err();
        assert!(matches!(error, Error::TooManySnapshots { .. }), "{error}");
    }
    let longest = Batch::<f64, 2>::new(&samples, (1 << 63) - 1).unwrap();
    assert_eq!((longest.len(), longest.split(usize::MAX).count()), (0, 1));
}

#[test]
fn no_input_causes_a_panic_or_a_non_finite_number() {
    fn check<const N: usize>(random: &mut Random) {
        let array = Array::<N>::new(random.uniform(0.05, 2.0)).unwrap();
        let scale = 10_f64.powf(random.uniform(-140.0, 140.0));
        // Few snapshots, channels without a signal, repeated rows, and huge and tiny numbers.
        let count = random.uniform(1.0, 5.0) as usize;
        let kind = random.uniform(0.0, 4.0) as usize;
        let snapshots: Vec<[Complex64; N]> = (0..count)
            .map(|t| {
                let mut snapshot: [Complex64; N] =
                    std::array::from_fn(|_| random.gaussian() * scale);
                match kind {
                    0 => snapshot[t % N] = Complex64::ZERO,
                    1 => snapshot = [snapshot[0]; N],
                    2 => {
                        snapshot = [Complex64::ZERO; N];
                        snapshot[0] = Complex64::from(scale);
                    }
                    _ => {}
                }
                snapshot
            })
            .collect();
        let Ok(covariance) = Covariance::from_snapshots(&snapshots) else {
            return;
        };
        for method in METHODS {
            for covariance in [covariance, covariance.forward_backward()] {
                let Ok(found) = estimate(method, &covariance, &array) else {
                    continue;
                };
                let numbers = [
                    found.phase_rad,
                    found.phase_sigma_rad,
                    found.angle_rad,
                    found.sigma_rad,
                ];
                assert!(
                    numbers.iter().all(|x| x.is_finite()),
                    "{method:?} {found:?}"
                );
                assert!(
                    found.snr_db.is_finite() && found.sigma_rad >= 0.0,
                    "{found:?}"
                );
                for sources in 1..N {
                    if let Ok(found) = estimate_several(method, &covariance, &array, sources) {
                        assert_eq!(found.len(), sources);
                        for found in found.iter() {
                            assert!(found.angle_rad.is_finite(), "{method:?} {found:?}");
                            assert!(found.sigma_rad.is_finite(), "{method:?} {found:?}");
                        }
                    }
                }
            }
        }
        assert!(source_count(Criterion::Aic, &covariance).is_ok_and(|it| it < N) || count <= N);
    }
    let mut random = Random::new(41);
    for _ in 0..150 {
        check::<2>(&mut random);
        check::<3>(&mut random);
        check::<4>(&mut random);
        check::<7>(&mut random);
    }
}
