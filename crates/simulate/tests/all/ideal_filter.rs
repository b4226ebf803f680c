//! The ideal filter, with which the tracker is compared.

use simulate::bound::Bound;

use crate::common::shipped;

#[test]
fn errors_have_the_reported_covariance() {
    let filter = Bound::new(&shipped("paper-real-odometry-2")).unwrap();
    let filter = filter.ideal_filter(200);
    let runs = 4000;
    let mut sums = vec![[0.0; 3]; filter.run(3, 0).count()];
    for run in 0..runs {
        for (sums, drawn) in sums.iter_mut().zip(filter.run(3, run)) {
            let [a, b] = drawn.error_m;
            for (sum, product) in sums.iter_mut().zip([a * a, a * b, b * b]) {
                *sum += product / runs as f64;
            }
        }
    }
    // The first position is an exact start with zero covariance.
    for (drawn, [aa, ab, bb]) in filter.run(3, 0).zip(sums).skip(1) {
        let [[paa, pab], [_, pbb]] = drawn.covariance_m2;
        // Tolerance: four standard deviations of the sample covariance of Gaussian numbers.
        let tolerance = |variance: f64| 4.0 * (variance / runs as f64).sqrt();
        assert!((aa - paa).abs() < tolerance(2.0 * paa * paa));
        assert!((bb - pbb).abs() < tolerance(2.0 * pbb * pbb));
        assert!((ab - pab).abs() < tolerance(paa * pbb + pab * pab));
    }
}
