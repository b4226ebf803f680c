//! Consistency of the Cramér–Rao bounds.

use aoa::{Array, bound};

#[test]
fn well_separated_sources_have_the_bound_of_one_source() {
    // With orthogonal steering vectors and low noise, the sources do not disturb each other.
    let phases = [0.0, std::f64::consts::PI];
    let snr = 1e4;
    let together = bound::deterministic_several::<4>(&phases, &[snr; 2], 20).unwrap();
    let alone = bound::deterministic::<4>(snr, 20);
    for sigma in together.iter() {
        assert!((1.0..1.2).contains(&(sigma / alone)), "{sigma} {alone}");
    }
    // With one source, the matrix formulas equal the closed forms.
    let pairs = [
        (
            bound::stochastic_several::<4>(&[0.7], &[0.5], 20),
            bound::stochastic::<4>(0.5, 20),
        ),
        (
            bound::deterministic_several::<4>(&[0.7], &[0.5], 20),
            bound::deterministic::<4>(0.5, 20),
        ),
        (
            bound::known_signal_several::<4>(&[0.7], &[0.5], 20),
            bound::known_signal::<4>(10.0),
        ),
    ];
    for (several, one) in pairs {
        assert!((several.unwrap()[0] / one - 1.0).abs() < 1e-12);
    }
}

#[test]
fn bounds_increase_with_the_number_of_unknowns() {
    for snr in [0.1, 1.0, 10.0, 100.0] {
        let stochastic = bound::stochastic::<4>(snr, 20);
        let deterministic = bound::deterministic::<4>(snr, 20);
        assert!(stochastic > deterministic);
        assert_eq!(deterministic, bound::known_signal::<4>(20.0 * snr));
        let phases = [0.3, 0.9];
        let pair = |bound: Result<aoa::List<f64, 4>, aoa::Error>| bound.unwrap()[0];
        let several = pair(bound::stochastic_several(&phases, &[snr; 2], 20));
        assert!(several >= pair(bound::deterministic_several(&phases, &[snr; 2], 20)));
        assert!(several > stochastic);
    }
}

#[test]
fn bounds_equal_reference_values() {
    // Four antennas, twenty snapshots, angles uniform in 20 to 160 degrees: RMS in degrees.
    let array = Array::<4>::half_wavelength();
    for (snr_db, expected) in [(0.0, 2.175), (10.0, 0.609), (20.0, 0.193), (30.0, 0.0613)] {
        let sigma = bound::stochastic::<4>(10_f64.powf(snr_db / 10.0), 20);
        let angles = (0..1400).map(|i| (20.05 + 0.1 * f64::from(i)).to_radians());
        let sum: f64 = angles
            .map(|angle| bound::angle_sigma_rad(sigma, angle, &array).powi(2))
            .sum();
        let rms = (sum / 1400.0).sqrt().to_degrees();
        assert!((rms / expected - 1.0).abs() < 0.05, "{snr_db} dB: {rms}");
    }
    // The resolvable SNR for 20 snapshots is in the threshold region.
    let threshold_db = 10.0 * bound::resolvable_snr::<4>(20).log10();
    assert!((-5.0..0.0).contains(&threshold_db), "{threshold_db}");
}
