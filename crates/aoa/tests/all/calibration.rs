//! Gain and phase of the channels.

use crate::common::{METHODS, Random, exact};
use aoa::{Array, Calibration, Complex64, Covariance, Error, estimate};

fn gains() -> [Complex64; 4] {
    [(1.0, 0.0), (0.8, 2.0), (1.3, -1.0), (0.9, 0.5)]
        .map(|(r, phase)| Complex64::from_polar(r, phase))
}

#[test]
fn a_reference_source_gives_the_gains() {
    let truth = Calibration::new(gains()).unwrap();
    let array = Array::<4>::new(0.458).unwrap().with_calibration(truth);
    let burst = Random::new(31).snapshots(&array, &[(1.0, 30.0)], 2000);
    let found = Calibration::from_reference(&burst, &array, 1.0).unwrap();
    let scale = (gains().iter().map(Complex64::norm_sqr).sum::<f64>() / 4.0).sqrt();
    for (found, gain) in found.gains().iter().zip(gains()) {
        assert!((found - gain / scale).norm() < 0.01, "{found} {gain}");
    }
}

#[test]
fn calibrated_estimates_are_exact() {
    let array = Array::<4>::new(0.458)
        .unwrap()
        .with_calibration(Calibration::new(gains()).unwrap());
    let response = array.response(array.phase_from_angle(0.8));
    let covariance = Covariance::from_snapshots(&[response; 5]).unwrap();
    for method in METHODS {
        let found = estimate(method, &covariance, &array).unwrap();
        assert!(
            (found.angle_rad - 0.8).abs() < 1e-9,
            "{method:?}: {found:?}"
        );
    }
    let ideal = array.calibration().apply(&response);
    for (sample, steering) in ideal
        .iter()
        .zip(array.steering_vector(array.phase_from_angle(0.8)))
    {
        assert!((sample - steering).norm() < 1e-12);
    }
}

#[test]
fn invalid_calibrations_are_rejected() {
    let mut bad = gains();
    bad[2] = Complex64::ZERO;
    assert_eq!(Calibration::new(bad), Err(Error::CalibrationGain(2)));
    bad[2] = Complex64::new(f64::NAN, 0.0);
    assert_eq!(Calibration::new(bad), Err(Error::CalibrationGain(2)));
    let array = Array::<4>::half_wavelength();
    let burst = [[Complex64::ONE; 4]; 3];
    assert_eq!(
        Calibration::from_reference(&burst, &array, 4.0),
        Err(Error::Angle(4.0))
    );
    let mut silent = burst;
    for snapshot in &mut silent {
        snapshot[1] = Complex64::ZERO;
    }
    assert_eq!(
        Calibration::from_reference(&silent, &array, 1.0),
        Err(Error::CalibrationGain(1))
    );
    // Calibration of an ideal array does not change the covariance.
    let covariance = Covariance::from_matrix(exact(&array, &[(1.0, 3.0)]), 5).unwrap();
    assert_eq!(covariance.calibrated(&array), covariance);
}
