//! Several sources.

mod common;

use aoa::{Array, Covariance, estimate_several};
use common::{METHODS, exact};

#[test]
fn every_method_is_exact_on_the_exact_covariance_of_two_sources() {
    fn check<const N: usize>(spacing: f64) {
        let array = Array::<N>::new(spacing).unwrap();
        for (first, second) in [(65.0, 100.0), (20.0, 160.0), (80.0, 90.0), (100.0, 115.0)] {
            let truth = [f64::to_radians(first), f64::to_radians(second)];
            let matrix = exact(&array, &[(truth[0], 10.0), (truth[1], 3.0)]);
            let covariance = Covariance::from_matrix(matrix, 1000).unwrap();
            for method in &METHODS[1..] {
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
