//! Known pilots: despread blocks.

use crate::common::Random;
use aoa::{Array, Complex64, Error, Reason, Verdict, bound, maximum_likelihood_pilots};

/// Returns four despread blocks with 830 resource elements in total, each with an unknown phase.
fn despread(
    random: &mut Random,
    array: &Array<4>,
    angle_rad: f64,
    snr_db_per_element: f64,
) -> [[Complex64; 4]; 4] {
    let response = array.response(array.phase_from_angle(angle_rad));
    [127.0, 240.0, 223.0, 240.0].map(|elements: f64| {
        let energy = elements * 10_f64.powf(snr_db_per_element / 10.0);
        let phase = random.uniform(-3.0, 3.0);
        let gain = Complex64::from_polar(energy.sqrt(), phase);
        response.map(|element| gain * element + random.gaussian())
    })
}

#[test]
fn the_known_signal_bound_is_attained_and_reported() {
    let array = Array::<4>::half_wavelength();
    let mut random = Random::new(21);
    for snr_db in [-10.0, 0.0, 10.0, 20.0] {
        for noise_variance in [Some(1.0), None] {
            let sigma = bound::known_signal::<4>(830.0 * 10_f64.powf(snr_db / 10.0));
            let (mut squares, mut normalised) = (0.0, 0.0);
            let trials = 8000;
            for _ in 0..trials {
                let angle = random.uniform(20.0, 160.0).to_radians();
                let blocks = despread(&mut random, &array, angle, snr_db);
                let found = maximum_likelihood_pilots(&blocks, noise_variance, &array).unwrap();
                let error = found.phase_rad - array.phase_from_angle(angle);
                squares += error * error;
                normalised += (error / found.phase_sigma_rad).powi(2);
                assert_ne!(found.verdict, Verdict::Unresolved(Reason::ThresholdSnr));
            }
            let ratio = (squares / f64::from(trials)).sqrt() / sigma;
            let consistency = normalised / f64::from(trials);
            println!(
                "{snr_db} dB {noise_variance:?}: RMSE / bound {ratio:.3}, NEES {consistency:.3}"
            );
            assert!(ratio < 1.05, "{snr_db} dB: RMSE / bound {ratio}");
            // Noise estimated with f = 23 degrees of freedom: (f - 3) / (f - 2) = 0.952. Standard error 0.018.
            let least = if noise_variance.is_some() { 0.92 } else { 0.90 };
            assert!(
                (least..1.08).contains(&consistency),
                "{snr_db} dB: NEES {consistency}"
            );
        }
    }
}

#[test]
fn weak_pilots_are_unresolved() {
    let array = Array::<4>::half_wavelength();
    let mut random = Random::new(22);
    let (mut resolved, mut wrong, mut nominal_noise) = (0, 0, 0);
    for _ in 0..4000 {
        let blocks = despread(&mut random, &array, 1.3, -24.0);
        let found = maximum_likelihood_pilots(&blocks, Some(1.0), &array).unwrap();
        if found.is_resolved() {
            resolved += 1;
            let error = found.phase_rad - array.phase_from_angle(1.3);
            wrong += usize::from(error.abs() > 5.0 * found.phase_sigma_rad);
        }
        let noise = despread(&mut random, &array, 1.3, -90.0);
        let found = maximum_likelihood_pilots(&noise, Some(1.0), &array).unwrap();
        nominal_noise += usize::from(found.is_resolved());
    }
    assert!(
        wrong * 50 <= resolved,
        "{wrong} of {resolved} resolved ones are wrong"
    );
    assert!(
        nominal_noise < 200,
        "{nominal_noise} of 4000 blocks of noise accepted"
    );
}

#[test]
fn an_invalid_noise_variance_is_rejected() {
    let array = Array::<4>::half_wavelength();
    let blocks = [[Complex64::ONE; 4]; 2];
    for value in [0.0, -1.0, f64::INFINITY] {
        let error = maximum_likelihood_pilots(&blocks, Some(value), &array).unwrap_err();
        assert_eq!(
            error,
            Error::NotPositive {
                name: "noise_variance",
                value
            }
        );
    }
    assert_eq!(
        maximum_likelihood_pilots::<4>(&[], None, &array),
        Err(Error::NoSnapshots)
    );
}
