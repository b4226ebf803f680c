//! Arrays of any shape: azimuth and elevation, their bound, and measured manifolds.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use crate::common::Random;
use aoa::{
    ArbitraryArray, Array, Calibration, Complex64, Covariance, Direction, DirectionFinder, Error,
    Manifold, MeasuredManifold, Method, PseudoSpectrum, Reason, Verdict, bound, estimate,
};

/// Returns snapshots of a Gaussian source in unit noise.
fn snapshots<M: Manifold<N>, const N: usize>(
    random: &mut Random,
    manifold: &M,
    direction: Direction,
    snr_db: f64,
    count: usize,
) -> Covariance<N> {
    let response = manifold.response(direction);
    let amplitude = 10.0_f64.powf(snr_db / 20.0);
    let snapshots: Vec<[Complex64; N]> = (0..count)
        .map(|_| {
            let signal = random.gaussian() * amplitude;
            response.map(|element| element * signal + random.gaussian())
        })
        .collect();
    Covariance::from_snapshots(&snapshots).unwrap()
}

/// Returns the ratio of RMSE to bound in azimuth and elevation, the mean normalised squared error
/// of the resolved estimates (2 for a correct covariance), and the resolved fraction.
fn quality<M: Manifold<N>, const N: usize>(
    finder: &DirectionFinder<M, N>,
    truth: &impl Manifold<N>,
    elevations_deg: [f64; 2],
    snr_db: f64,
) -> ([f64; 2], f64, f64) {
    let mut random = Random::new(11);
    let (trials, count) = (1500, 20);
    let snr = 10.0_f64.powf(snr_db / 10.0);
    let (mut squares, mut bounds, mut nees, mut resolved) = ([0.0; 2], [0.0; 2], 0.0, 0.0);
    for _ in 0..trials {
        let direction = Direction::new(
            random.uniform(-PI, PI),
            random
                .uniform(elevations_deg[0], elevations_deg[1])
                .to_radians(),
        );
        let covariance = snapshots(&mut random, truth, direction, snr_db, count);
        let found = finder.estimate(&covariance).unwrap();
        let turned = found.direction.azimuth_rad - direction.azimuth_rad;
        let error = [
            (turned + 3.0 * PI).rem_euclid(TAU) - PI,
            found.direction.elevation_rad - direction.elevation_rad,
        ];
        // The bound takes the mean SNR over the antennas.
        let response = truth.response(direction);
        let gain = response.iter().map(Complex64::norm_sqr).sum::<f64>() / N as f64;
        let limit = bound::azimuth_elevation(truth, direction, snr * gain, count);
        let [[a, b], [_, c]] = found.noise_covariance;
        let weighted =
            c * error[0] * error[0] - 2.0 * b * error[0] * error[1] + a * error[1] * error[1];
        if found.is_resolved() {
            resolved += 1.0;
            nees += weighted / (a * c - b * b);
        }
        for axis in 0..2 {
            squares[axis] += error[axis] * error[axis];
            bounds[axis] += limit[axis][axis];
        }
    }
    let trials = f64::from(trials);
    let ratios = [0, 1].map(|axis: usize| (squares[axis] / bounds[axis]).sqrt());
    println!(
        "{snr_db} dB: RMSE / bound {ratios:.3?}, NEES {:.3}",
        nees / resolved
    );
    (ratios, nees / resolved, resolved / trials)
}

#[test]
fn a_circle_of_five_attains_the_bound_in_azimuth_and_elevation() {
    let array = ArbitraryArray::<5>::circular(0.425).unwrap();
    let finder = DirectionFinder::new(array, [0.0, FRAC_PI_2]).unwrap();
    for snr_db in [5.0, 15.0, 25.0] {
        let (ratios, nees, resolved) = quality(&finder, &array, [20.0, 70.0], snr_db);
        assert!(ratios[0] < 1.1 && ratios[1] < 1.1, "{ratios:?}");
        assert!((1.8..2.2).contains(&nees), "NEES {nees} of 2");
        assert!(resolved > 0.98, "{resolved}");
    }
}

#[test]
fn other_shapes_attain_the_bound() {
    let sky = [0.0, FRAC_PI_2];
    let places = std::array::from_fn(|n| [0.5 * (n % 3) as f64, 0.5 * (n / 3) as f64, 0.0]);
    let square = ArbitraryArray::<9>::new(places).unwrap();
    let (ratios, nees, _) = quality(
        &DirectionFinder::new(square, sky).unwrap(),
        &square,
        [30.0, 70.0],
        10.0,
    );
    assert!(ratios.iter().all(|it| *it < 1.1) && (1.8..2.2).contains(&nees));

    // A tetrahedron distinguishes directions above and below, so that the elevation range is
    // unlimited.
    let tetrahedron = [
        [0.2, 0.2, 0.2],
        [0.2, -0.2, -0.2],
        [-0.2, 0.2, -0.2],
        [-0.2, -0.2, 0.2],
    ];
    let tetrahedron = ArbitraryArray::new(tetrahedron).unwrap();
    let finder = DirectionFinder::new(tetrahedron, [-FRAC_PI_2, FRAC_PI_2]).unwrap();
    let (ratios, nees, _) = quality(&finder, &tetrahedron, [-60.0, 60.0], 15.0);
    assert!(ratios.iter().all(|it| *it < 1.1) && (1.8..2.2).contains(&nees));
}

#[test]
fn unequal_channels_are_part_of_the_manifold() {
    let gains = [1.0, 0.5, 1.4, 0.8, 1.1];
    let gains = std::array::from_fn(|n| Complex64::from_polar(gains[n], 1.7 * n as f64));
    let array = ArbitraryArray::<5>::circular(0.425)
        .unwrap()
        .with_calibration(Calibration::new(gains).unwrap());
    let finder = DirectionFinder::new(array, [0.0, FRAC_PI_2]).unwrap();
    let mut random = Random::new(12);
    let (mut squares, mut normalised) = (0.0, 0.0);
    for _ in 0..1000 {
        let direction = Direction::new(random.uniform(-PI, PI), 0.6);
        let found = finder
            .estimate(&snapshots(&mut random, &array, direction, 20.0, 20))
            .unwrap();
        let error = found.direction.elevation_rad - 0.6;
        squares += error * error;
        normalised += (error / found.elevation_sigma_rad()).powi(2);
    }
    assert!((0.9..1.1).contains(&(normalised / 1000.0)), "{normalised}");
    assert!((squares / 1000.0).sqrt() < 0.05, "{squares}");
}

#[test]
fn the_bound_of_collinear_elements_equals_that_of_the_linear_array() {
    // A uniform linear array as a general manifold.
    struct Row;
    impl Manifold<4> for Row {
        fn response(&self, direction: Direction) -> [Complex64; 4] {
            let phase_rad = PI * direction.unit_vector()[0];
            Array::<4>::half_wavelength().steering_vector(phase_rad)
        }
        fn resolution_rad(&self) -> f64 {
            0.2
        }
    }
    let array = Array::<4>::half_wavelength();
    let finder = DirectionFinder::new(Row, [0.0, 0.0]).unwrap();
    let mut random = Random::new(13);
    for snr_db in [0.0, 20.0] {
        let direction = Direction::new(1.1, 0.0);
        let covariance = snapshots(&mut random, &Row, direction, snr_db, 20);
        let found = finder.estimate(&covariance).unwrap();
        let linear = estimate(Method::MaximumLikelihood, &covariance, &array).unwrap();
        assert!((found.direction.azimuth_rad.abs() - linear.angle_rad).abs() < 1e-7);
        assert!((found.azimuth_sigma_rad() / linear.sigma_rad - 1.0).abs() < 1e-4);
        assert!((found.snr_db - linear.snr_db).abs() < 1e-9);
        // A linear array cannot distinguish left and right.
        assert_eq!(found.verdict, Verdict::Unresolved(Reason::Ambiguous));
    }
}

#[test]
fn unreliable_estimates_are_reported() {
    let array = ArbitraryArray::<5>::circular(0.425).unwrap();
    let sky = DirectionFinder::new(array, [0.0, FRAC_PI_2]).unwrap();
    let both = DirectionFinder::new(array, [-FRAC_PI_2, FRAC_PI_2]).unwrap();
    let mut random = Random::new(14);
    let high = snapshots(&mut random, &array, Direction::new(1.0, 0.7), 20.0, 20);
    assert!(sky.estimate(&high).unwrap().is_resolved());
    // A planar array cannot distinguish directions above and below.
    let verdict = both.estimate(&high).unwrap().verdict;
    assert_eq!(verdict, Verdict::Unresolved(Reason::Ambiguous));
    // At the horizon the elevation is unobservable; with a fixed elevation the azimuth is resolved.
    let low = snapshots(&mut random, &array, Direction::new(1.0, 0.0), 20.0, 20);
    let verdict = sky.estimate(&low).unwrap().verdict;
    assert_eq!(verdict, Verdict::Unresolved(Reason::EdgeOfElevations));
    let level = DirectionFinder::new(array, [0.0, 0.0]).unwrap();
    let found = level.estimate(&low).unwrap();
    assert!(found.is_resolved());
    assert!((found.direction.azimuth_rad - 1.0).abs() < 4.0 * found.azimuth_sigma_rad());
    assert_eq!(
        (found.direction.elevation_rad, found.elevation_sigma_rad()),
        (0.0, 0.0)
    );
    // Elements far apart have many ambiguous directions.
    let wide = ArbitraryArray::<3>::circular(2.0).unwrap();
    let finder = DirectionFinder::new(wide, [0.0, FRAC_PI_2]).unwrap();
    let direction = Direction::new(0.3, 0.5);
    let found = finder
        .estimate(&snapshots(&mut random, &wide, direction, 10.0, 20))
        .unwrap();
    assert_eq!(found.verdict, Verdict::Unresolved(Reason::Ambiguous));
    let noise = snapshots(&mut random, &array, direction, -30.0, 20);
    assert_eq!(
        sky.estimate(&noise).unwrap().verdict,
        Verdict::Unresolved(Reason::ThresholdSnr)
    );
}

#[test]
fn the_zenith_is_estimated_like_other_directions() {
    let array = ArbitraryArray::<5>::circular(0.425).unwrap();
    let finder = DirectionFinder::new(array, [0.0, FRAC_PI_2]).unwrap();
    let overhead = Direction::new(0.0, FRAC_PI_2).unit_vector();
    let mut random = Random::new(15);
    for _ in 0..50 {
        let direction = Direction::new(random.uniform(-PI, PI), FRAC_PI_2 - 0.01);
        let found = finder
            .estimate(&snapshots(&mut random, &array, direction, 30.0, 50))
            .unwrap();
        assert!(found.is_resolved(), "{found:?}");
        let cosine: f64 = found
            .direction
            .unit_vector()
            .iter()
            .zip(overhead)
            .map(|(a, b)| a * b)
            .sum();
        assert!(cosine.acos() < 0.05, "{found:?}");
    }
}

#[test]
fn a_measured_manifold_with_coupling_is_as_accurate_as_the_true_one() {
    // Circular array with coupling between adjacent elements.
    struct Coupled(ArbitraryArray<5>);
    impl Manifold<5> for Coupled {
        fn response(&self, direction: Direction) -> [Complex64; 5] {
            let ideal = self.0.response(direction);
            let coupling = Complex64::from_polar(0.25, 2.0);
            std::array::from_fn(|n| ideal[n] + (ideal[(n + 1) % 5] + ideal[(n + 4) % 5]) * coupling)
        }
        fn resolution_rad(&self) -> f64 {
            self.0.resolution_rad()
        }
    }
    let truth = Coupled(ArbitraryArray::circular(0.425).unwrap());
    let elevations_rad: Vec<f64> = (0..=18)
        .map(|i| (5.0 * f64::from(i)).to_radians())
        .collect();
    let azimuths = 72;
    let responses = elevations_rad
        .iter()
        .flat_map(|elevation| {
            let truth = &truth;
            (0..azimuths).map(move |i| {
                truth.response(Direction::new(TAU * i as f64 / azimuths as f64, *elevation))
            })
        })
        .collect();
    let table = MeasuredManifold::new(azimuths, &elevations_rad, responses).unwrap();
    let mut random = Random::new(16);
    for _ in 0..200 {
        let direction = Direction::new(random.uniform(-4.0, 4.0), random.uniform(0.0, 1.57));
        let (a, b) = (table.response(direction), truth.response(direction));
        let error = a
            .iter()
            .zip(b)
            .map(|(a, b)| (a - b).norm())
            .fold(0.0, f64::max);
        // Interpolation error: 1/24 of the fourth power of the change between entries, in azimuth
        // and in elevation, for an element and its two neighbours.
        let change = 2.0 * PI * 0.425 * 5_f64.to_radians();
        let limit = 2.0 * change.powi(4) / 24.0 * 1.5;
        assert!(error < limit, "{direction:?}: {error}");
    }
    let finder = DirectionFinder::new(table, [0.0, FRAC_PI_2]).unwrap();
    let (ratios, nees, _) = quality(&finder, &truth, [20.0, 70.0], 20.0);
    assert!(ratios.iter().all(|it| *it < 1.1), "{ratios:?}");
    // The bound is valid for the SNR per antenna, which coupling changes; the estimate accounts for
    // this.
    assert!((1.8..2.2).contains(&nees), "NEES {nees} of 2");
    // Without the coupling in the manifold, the error exceeds the noise.
    let ideal = DirectionFinder::new(truth.0, [0.0, FRAC_PI_2]).unwrap();
    let (_, blind, _) = quality(&ideal, &truth, [20.0, 70.0], 20.0);
    assert!(blind > 10.0, "{blind}");
    // The misfit is reported, and the covariance includes its effect.
    let mut random = Random::new(16);
    let (mut reliable, mut squares) = (0, 0.0);
    for _ in 0..200 {
        let direction = Direction::new(random.uniform(-PI, PI), random.uniform(0.4, 1.2));
        let covariance = snapshots(&mut random, &truth, direction, 20.0, 20);
        let found = ideal.estimate(&covariance).unwrap();
        let turned = found.direction.azimuth_rad - direction.azimuth_rad;
        let error = (turned + 3.0 * PI).rem_euclid(TAU) - PI;
        reliable += u32::from(found.is_reliable());
        squares += error * error / found.covariance[0][0] / 200.0;
    }
    println!("coupling left out: {reliable} of 200 reliable, {squares:.2}");
    assert!(reliable < 3 && squares < 2.0, "{reliable}, {squares}");
}

#[test]
fn spectra_over_azimuth_and_elevation_peak_at_the_source() {
    let array = ArbitraryArray::<5>::circular(0.425).unwrap();
    let source = Direction::new(-0.8, 0.5);
    let covariance = snapshots(&mut Random::new(17), &array, source, 20.0, 50);
    let others = [(-0.8, 1.2), (0.5, 0.5), (2.5, 0.1)].map(|(az, el)| Direction::new(az, el));
    for kind in [
        PseudoSpectrum::Bartlett,
        PseudoSpectrum::Capon,
        PseudoSpectrum::Music { sources: 1 },
    ] {
        let at = |directions: &[Direction]| {
            kind.over_directions(&covariance, &array, directions)
                .unwrap()
        };
        assert!(
            at(&others)
                .iter()
                .all(|other| *other < 0.8 * at(&[source])[0]),
            "{kind:?}"
        );
    }
    let bartlett = PseudoSpectrum::Bartlett.over_directions(&covariance, &array, &[source]);
    assert!((bartlett.unwrap()[0] / 100.0 - 1.0).abs() < 0.5);
}

#[test]
fn invalid_arrays_are_rejected() {
    let corner = [[0.0; 3], [0.5, 0.0, 0.0], [0.0, 0.5, 0.0]];
    assert!(ArbitraryArray::new(corner).is_ok());
    for bad in [f64::NAN, f64::INFINITY, 101.0, -1e300] {
        let mut places = corner;
        places[2][1] = bad;
        assert_eq!(ArbitraryArray::new(places), Err(Error::ElementPlace(2)));
    }
    let mut twice = corner;
    twice[2] = twice[1];
    assert_eq!(
        ArbitraryArray::new(twice),
        Err(Error::CoincidentElements(1, 2))
    );
    let row = [0.0, 0.5, 1.0].map(|x| [x, x, 0.0]);
    assert_eq!(ArbitraryArray::new(row), Err(Error::ElementsInARow));
    assert_eq!(
        ArbitraryArray::<5>::circular(0.0),
        Err(Error::CoincidentElements(0, 1))
    );

    let array = ArbitraryArray::new(corner).unwrap();
    for elevations_rad in [
        [0.5, 0.4],
        [f64::NAN, 1.0],
        [-2.0, 0.0],
        [0.0, f64::INFINITY],
    ] {
        let error = DirectionFinder::new(array, elevations_rad).unwrap_err();
        assert!(matches!(error, Error::Elevations { .. }));
    }
    let finder = DirectionFinder::new(array, [0.0, 1.0]).unwrap();
    assert_eq!(finder.estimate(&Covariance::new()), Err(Error::NoSnapshots));

    let one = [Complex64::ONE; 3];
    let table = |azimuths, elevations: &[f64], count: usize| {
        MeasuredManifold::new(azimuths, elevations, vec![one; count]).map(|_| ())
    };
    assert_eq!(table(4, &[0.0, 0.1], 8), Ok(()));
    for (azimuths, elevations, count) in [
        (3, &[0.0][..], 3),
        (4, &[][..], 0),
        (4, &[0.0, 0.1][..], 7),
        (usize::MAX, &[0.0, 0.1][..], 8),
        (4, &[0.1, 0.0][..], 8),
        (4, &[0.0, 0.0][..], 8),
        (4, &[0.0, 0.1, 0.3][..], 12),
        (4, &[0.0, f64::NAN][..], 8),
        (4, &[0.0, 2.0][..], 8),
    ] {
        let refused = table(azimuths, elevations, count);
        assert!(
            matches!(refused, Err(Error::ManifoldTable(_))),
            "{elevations:?}"
        );
    }
    let silent = MeasuredManifold::new(4, &[0.0], vec![[Complex64::ZERO; 3]; 4]);
    assert!(matches!(silent, Err(Error::ManifoldTable(_))));
}
