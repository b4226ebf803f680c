//! False-alarm rate of the model test, and its detection of wrong models.

use std::f64::consts::{FRAC_PI_2, PI};

use aoa::{
    ArbitraryArray, Array, Complex64, Covariance, Direction, DirectionFinder, GoodnessOfFit,
    Manifold, Method, Reason, Verdict, estimate, estimate_several, maximum_likelihood_pilots,
    maximum_likelihood_pilots_unequal,
};

use crate::common::{METHODS, Random};

/// Checks the shares of p-values below given probabilities, with a tolerance of four standard
/// deviations plus the error of the approximated distributions.
fn check(name: &str, trials: u32, mut fit: impl FnMut() -> GoodnessOfFit) {
    let mut below = [0_u32; 3];
    let probabilities = [0.5, 0.1, 0.01];
    for _ in 0..trials {
        let p = fit().p_value();
        for (count, probability) in below.iter_mut().zip(probabilities) {
            *count += u32::from(p < probability);
        }
    }
    for (count, probability) in below.into_iter().zip(probabilities) {
        let share = f64::from(count) / f64::from(trials);
        let chance = 4.0 * (probability / f64::from(trials)).sqrt();
        println!("{name}: {share:.4} of {probability}");
        assert!(
            share < 1.25 * probability + chance,
            "{name}: {share} of {probability}"
        );
        // With few snapshots, the approximation has a lower false-alarm rate.
        assert!(
            share > 0.3 * probability - chance,
            "{name}: {share} of {probability}"
        );
    }
}

fn blind<const N: usize>(method: Method, snapshots: usize, snr_db: f64) {
    let array = Array::<N>::half_wavelength();
    let mut random = Random::new(60);
    check(
        &format!("{method:?}, {N} antennas, {snapshots} snapshots"),
        2000,
        || {
            let angle = random.uniform(0.5, 2.6);
            let covariance = Covariance::from_snapshots(&random.snapshots(
                &array,
                &[(angle, snr_db)],
                snapshots,
            ));
            estimate(method, &covariance.unwrap(), &array).unwrap().fit
        },
    );
}

#[test]
fn p_values_of_one_source_are_uniform() {
    for method in METHODS {
        blind::<4>(method, 20, 10.0);
    }
    blind::<2>(Method::MaximumLikelihood, 20, 10.0);
    blind::<3>(Method::MaximumLikelihood, 8, 20.0);
    blind::<4>(Method::MaximumLikelihood, 200, 5.0);
    blind::<8>(Method::MaximumLikelihood, 20, 10.0);
}

#[test]
fn p_values_of_pilots_are_uniform() {
    let array = Array::<4>::half_wavelength();
    for (noise_is_known, blocks) in [(true, 1), (true, 4), (false, 4), (false, 12)] {
        let mut random = Random::new(61);
        check(
            &format!("known {noise_is_known}, {blocks} blocks"),
            2000,
            || {
                let a = array.steering_vector(random.uniform(-2.8, 2.8));
                // Each block has its own channel phase, as with a carrier offset.
                let blocks: Vec<[Complex64; 4]> = (0..blocks)
                    .map(|_| {
                        let gain = Complex64::from_polar(6.0, random.uniform(-PI, PI));
                        a.map(|it| it * gain + random.gaussian())
                    })
                    .collect();
                let known = noise_is_known.then_some(1.0);
                maximum_likelihood_pilots(&blocks, known, &array)
                    .unwrap()
                    .fit
            },
        );
    }
    let noise = [1.0, 4.0, 1.0, f64::INFINITY];
    let mut random = Random::new(62);
    check("unequal", 2000, || {
        let a = array.steering_vector(random.uniform(-2.8, 2.8));
        let blocks = [(); 4].map(|()| {
            std::array::from_fn(|n| a[n] * 9.0 + random.gaussian() * f64::min(noise[n], 9.0).sqrt())
        });
        maximum_likelihood_pilots_unequal(&blocks, &noise, &array)
            .unwrap()
            .fit
    });
}

#[test]
fn p_values_of_several_sources_and_of_other_arrays_are_uniform() {
    let array = Array::<5>::half_wavelength();
    for method in [
        Method::MaximumLikelihood,
        Method::RootMusic,
        Method::EspritTls,
    ] {
        let mut random = Random::new(63);
        check(&format!("two by {method:?}"), 800, || {
            let snapshots = random.snapshots(&array, &[(0.9, 15.0), (1.9, 12.0)], 40);
            let covariance = Covariance::from_snapshots(&snapshots).unwrap();
            estimate_several(method, &covariance, &array, 2).unwrap()[0].fit
        });
    }
    let circle = ArbitraryArray::<5>::circular(0.425).unwrap();
    for elevations in [[0.0, FRAC_PI_2], [0.6, 0.6]] {
        let finder = DirectionFinder::new(circle, elevations).unwrap();
        let mut random = Random::new(64);
        check(&format!("circle {elevations:?}"), 800, || {
            let response = circle.response(Direction::new(random.uniform(-PI, PI), 0.6));
            let snapshots: Vec<[Complex64; 5]> = (0..20)
                .map(|_| {
                    let waveform = random.gaussian() * 6.0;
                    response.map(|it| it * waveform + random.gaussian())
                })
                .collect();
            finder
                .estimate(&Covariance::from_snapshots(&snapshots).unwrap())
                .unwrap()
                .fit
        });
    }
}

/// Returns snapshots of a source and its reflection, both angles at random but `apart` radians or
/// more, in unit noise.
fn with_echo<const N: usize>(
    random: &mut Random,
    array: &Array<N>,
    [snr_db, echo_db]: [f64; 2],
    apart: f64,
) -> (f64, Vec<[Complex64; N]>) {
    let angle = random.uniform(0.5, 2.6);
    let echo = loop {
        let echo = random.uniform(0.3, 2.8);
        if (echo - angle).abs() > apart {
            break echo;
        }
    };
    let [a, b] = [angle, echo].map(|it| array.response(array.phase_from_angle(it)));
    let gain = Complex64::from_polar(10.0_f64.powf(echo_db / 20.0), random.uniform(-PI, PI));
    let snapshots = (0..20).map(|_| {
        let waveform = random.gaussian() * 10.0_f64.powf(snr_db / 20.0);
        std::array::from_fn(|n| (a[n] + b[n] * gain) * waveform + random.gaussian())
    });
    (array.phase_from_angle(angle), snapshots.collect())
}

#[test]
fn reflections_and_additional_sources_are_reported() {
    let array = Array::<4>::half_wavelength();
    let trials = 400;
    for echo_db in [-3.0, -6.0, -9.0, -12.0] {
        let mut random = Random::new(65);
        let (mut named, mut z) = (0, Vec::new());
        for _ in 0..trials {
            let (phase, snapshots) = with_echo(&mut random, &array, [20.0, echo_db], 0.17);
            let covariance = Covariance::from_snapshots(&snapshots).unwrap();
            let found = estimate(Method::MaximumLikelihood, &covariance, &array).unwrap();
            named += u32::from(found.doubt() == Some(Reason::Multipath));
            let error = (found.phase_rad - phase + 3.0 * PI).rem_euclid(2.0 * PI) - PI;
            z.push((error / found.phase_sigma_rad).abs());
        }
        z.sort_unstable_by(f64::total_cmp);
        let (median, most) = (z[trials / 2], z[trials * 9 / 10]);
        println!("echo {echo_db} dB: {named} of {trials}, |z| {median:.2} {most:.2}");
        assert!(
            f64::from(named) >= 0.9 * trials as f64,
            "{echo_db} dB: {named}"
        );
        // The standard deviation has the size of the error: the quantiles would be 0.67 and 1.64
        // for a Gaussian error.
        assert!(
            (0.4..1.2).contains(&median) && most < 4.0,
            "{median} {most}"
        );
    }
    let mut random = Random::new(66);
    let mut named = 0;
    for _ in 0..trials {
        let first = random.uniform(0.5, 2.3);
        let second = random.uniform(first + 0.25, 2.7);
        let snapshots = random.snapshots(&array, &[(first, 20.0), (second, 20.0)], 20);
        let covariance = Covariance::from_snapshots(&snapshots).unwrap();
        let found = estimate(Method::Music, &covariance, &array).unwrap();
        named += u32::from(found.doubt() == Some(Reason::MoreSources));
    }
    assert!(f64::from(named) >= 0.95 * trials as f64, "{named}");
}

#[test]
fn the_reported_reason_is_correct() {
    let array = Array::<4>::half_wavelength();
    let mut random = Random::new(67);
    let mut most_frequent = |snr_db: f64, snapshots: usize| {
        let mut counts = [0; Verdict::ALL.len()];
        for _ in 0..50 {
            let snapshots = random.snapshots(&array, &[(1.2, snr_db)], snapshots);
            let covariance = Covariance::from_snapshots(&snapshots).unwrap();
            let found = estimate(Method::MaximumLikelihood, &covariance, &array).unwrap();
            counts[found.verdict.index()] += 1;
        }
        let most = (0..counts.len())
            .max_by_key(|index| counts[*index])
            .unwrap();
        Verdict::ALL[most]
    };
    assert_eq!(
        most_frequent(-12.0, 20),
        Verdict::Unresolved(Reason::ThresholdSnr)
    );
    assert_eq!(
        most_frequent(10.0, 2),
        Verdict::Unresolved(Reason::TooFewSnapshots)
    );
    assert_eq!(most_frequent(10.0, 20), Verdict::Resolved);
    // Samples without noise fit, and so does a single snapshot, which has no degrees of freedom for
    // a test and too few for the noise variance.
    let exact = [array.steering_vector(0.7)];
    for count in [1, 20] {
        let covariance = Covariance::from_snapshots(&exact.repeat(count)).unwrap();
        for method in METHODS {
            let found = estimate(method, &covariance, &array).unwrap();
            assert_eq!(found.is_reliable(), count > 1, "{found:?}");
            assert!(found.fit.p_value() > 0.5, "{found:?}");
        }
    }
}

#[test]
fn two_sources_of_any_array_agree_with_their_standard_deviations() {
    let array = ArbitraryArray::<8>::circular(0.7).unwrap();
    for (elevations, correlated) in [
        ([0.3, 0.3], false),
        ([0.0, FRAC_PI_2], false),
        ([0.3, 0.3], true),
    ] {
        let finder = DirectionFinder::new(array, elevations).unwrap();
        let mut random = Random::new(68);
        let (trials, mut nees, mut reliable) = (80, [0.0; 2], 0);
        for _ in 0..trials {
            let first = random.uniform(-2.6, 0.0);
            let truth = [first, first + random.uniform(0.9, 2.2)];
            let [a, b] = truth.map(|azimuth| array.response(Direction::new(azimuth, 0.3)));
            let snapshots: Vec<[Complex64; 8]> = (0..40)
                .map(|_| {
                    let [mut x, y] = [(); 2].map(|()| random.gaussian() * 10.0);
                    if correlated {
                        x = y;
                    }
                    std::array::from_fn(|n| a[n] * x + b[n] * y + random.gaussian())
                })
                .collect();
            let covariance = Covariance::from_snapshots(&snapshots).unwrap();
            let found = finder.estimate_several(&covariance, 2).unwrap();
            for k in 0..2 {
                let error = found[k].direction.azimuth_rad - truth[k];
                nees[k] += error * error / found[k].covariance[0][0] / f64::from(trials);
                reliable += u32::from(found[k].is_reliable());
            }
        }
        println!("{elevations:?}, correlated {correlated}: NEES {nees:.2?}, {reliable} reliable");
        // Four standard deviations of the mean of squares.
        let chance = 4.0 * (2.0 / f64::from(trials)).sqrt();
        assert!(nees.iter().all(|it| (it - 1.0).abs() < chance), "{nees:?}");
        assert!(
            f64::from(reliable) > 0.95 * 2.0 * f64::from(trials),
            "{reliable}"
        );
    }
}
