//! Channels with different noise variances, and dead channels.

use crate::common::Random;
use aoa::{
    Array, Calibration, Complex64, Error, Reason, Verdict, bound, maximum_likelihood_pilots,
    maximum_likelihood_pilots_unequal,
};

/// Returns despread blocks of a whole SSB with the given noise variances.
fn despread<const N: usize>(
    random: &mut Random,
    array: &Array<N>,
    angle_rad: f64,
    snr_db_per_element: f64,
    noise: &[f64; N],
) -> [[Complex64; N]; 4] {
    let response = array.response(array.phase_from_angle(angle_rad));
    [127.0, 240.0, 223.0, 240.0].map(|elements: f64| {
        let energy = elements * 10_f64.powf(snr_db_per_element / 10.0);
        let gain = Complex64::from_polar(energy.sqrt(), random.uniform(-3.0, 3.0));
        std::array::from_fn(|n| {
            if noise[n].is_finite() {
                gain * response[n] + random.gaussian() * noise[n].sqrt()
            } else {
                Complex64::new(f64::NAN, 0.0)
            }
        })
    })
}

/// Returns the ratio of RMSE to bound and the mean normalised squared error over many directions.
fn statistics<const N: usize>(array: &Array<N>, snr_db: f64, noise: &[f64; N]) -> (f64, f64) {
    let mut random = Random::new(40);
    let power = 830.0 * 10_f64.powf(snr_db / 10.0);
    let gains = array.calibration().gains();
    let snrs: [f64; N] = std::array::from_fn(|n| power * gains[n].norm_sqr() / noise[n]);
    let sigma = bound::known_signal_unequal(&snrs);
    let trials = 8000;
    let (mut squares, mut normalised) = (0.0, 0.0);
    for _ in 0..trials {
        let angle = random.uniform(40.0, 140.0).to_radians();
        let blocks = despread(&mut random, array, angle, snr_db, noise);
        let found = maximum_likelihood_pilots_unequal(&blocks, noise, array).unwrap();
        assert!(found.is_resolved(), "{found:?}");
        let error = found.phase_rad - array.phase_from_angle(angle);
        squares += error * error;
        normalised += (error / found.phase_sigma_rad).powi(2);
    }
    let trials = f64::from(trials);
    ((squares / trials).sqrt() / sigma, normalised / trials)
}

#[test]
fn one_bad_channel_has_the_predicted_loss() {
    fn check<const N: usize>() {
        let ideal = Array::<N>::half_wavelength();
        let uneven = std::array::from_fn(|n| Complex64::from_polar(1.0 + 0.3 * n as f64, n as f64));
        let uneven = ideal.with_calibration(Calibration::new(uneven).unwrap());
        for array in [ideal, uneven] {
            // The middle one of three antennas is required: a spacing of one wavelength is
            // ambiguous.
            for bad in (0..N).filter(|bad| N > 3 || *bad != 1) {
                for level in [10.0, 100.0, f64::INFINITY] {
                    for snr_db in [0.0, 15.0] {
                        let mut noise = [1.0; N];
                        noise[bad] = level;
                        let (ratio, nees) = statistics(&array, snr_db, &noise);
                        let case = format!(
                            "N {N}, channel {bad}, {level}, {snr_db} dB: {ratio:.3} {nees:.3}"
                        );
                        println!("{case}");
                        assert!(ratio < 1.1, "{case}");
                        assert!((0.9..1.1).contains(&nees), "{case}");
                    }
                }
            }
        }
    }
    check::<3>();
    check::<4>();
    check::<8>();
}

#[test]
fn equal_noise_equals_the_estimator_for_equal_noise() {
    let array = Array::<4>::half_wavelength();
    let mut random = Random::new(41);
    for _ in 0..200 {
        let blocks = despread(&mut random, &array, 1.2, 3.0, &[2.5; 4]);
        let one = maximum_likelihood_pilots(&blocks, Some(2.5), &array).unwrap();
        let other = maximum_likelihood_pilots_unequal(&blocks, &[2.5; 4], &array).unwrap();
        assert!((one.phase_rad - other.phase_rad).abs() < 1e-7);
        assert!((one.phase_sigma_rad / other.phase_sigma_rad - 1.0).abs() < 1e-9);
        assert!((one.snr_db - other.snr_db).abs() < 1e-9);
        assert_eq!(one.verdict, other.verdict);
    }
}

#[test]
fn ambiguities_of_a_thinned_array_are_reported() {
    let array = Array::<4>::half_wavelength();
    let mut random = Random::new(42);
    let dead = f64::INFINITY;
    let estimate = |blocks: &[[Complex64; 4]], noise| {
        maximum_likelihood_pilots_unequal(blocks, &noise, &array)
    };
    let blocks = despread(&mut random, &array, 1.0, 10.0, &[1.0; 4]);
    let found = estimate(&blocks, [1.0, dead, 1.0, dead]).unwrap();
    assert_eq!(found.verdict, Verdict::Unresolved(Reason::Ambiguous));
    assert!(
        estimate(&blocks, [1.0, 1.0, dead, dead])
            .unwrap()
            .is_resolved()
    );
    assert_eq!(
        estimate(&blocks, [1.0, dead, dead, dead]),
        Err(Error::DeadChannels { living: 1 })
    );
    for bad in [0.0, -1.0, f64::NAN] {
        let refused = estimate(&blocks, [1.0, bad, 1.0, 1.0]);
        assert!(
            matches!(refused, Err(Error::NotPositive { .. })),
            "{refused:?}"
        );
    }
    assert_eq!(estimate(&[], [1.0; 4]), Err(Error::NoSnapshots));
}
