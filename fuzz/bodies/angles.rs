//! Angles from arbitrary samples, covariances and manifolds.
//!
//! Byte 0: kind of input. Byte 1: method and averaging. Byte 2: sources and subarray. The remaining
//! bytes are f64 values, repeated as often as needed: samples, entries, positions, elevations.

use aoa::{
    AngleEstimate, ArbitraryArray, Array, Batch, Complex64, Covariance, DirectionEstimate,
    DirectionFinder, Manifold, MeasuredManifold, Method, Smoothing, estimate_several,
};

const N: usize = 4;
const SNAPSHOTS: usize = 6;
const METHODS: [Method; 5] = [
    Method::MaximumLikelihood,
    Method::Music,
    Method::RootMusic,
    Method::EspritLs,
    Method::EspritTls,
];

pub fn run(data: &[u8]) {
    let [what, how, many, rest @ ..] = data else {
        return;
    };
    let words = rest.as_chunks::<8>().0;
    if words.is_empty() {
        return;
    }
    let mut values = words.iter().cycle().map(|bytes| f64::from_le_bytes(*bytes));
    let mut next = || values.next().unwrap_or(0.0);
    let method = METHODS[usize::from(how & 7) % METHODS.len()];
    let sources = usize::from(many & 7);
    match what % 4 {
        0 => {
            let samples: Vec<Complex64> = (0..2 * N * SNAPSHOTS)
                .map(|_| Complex64::new(next(), next()))
                .collect();
            let Ok(batch) = Batch::<f64, N>::new(&samples, SNAPSHOTS) else {
                unreachable!("two whole items");
            };
            let smoothing = Smoothing {
                forward_backward: how >> 3 & 1 == 1,
                subarray: (how >> 4 & 1 == 1).then(|| usize::from(many >> 3)),
            };
            let mut found = vec![AngleEstimate::default(); 2 * sources];
            let array = Array::half_wavelength();
            if batch
                .estimate(method, &array, smoothing, sources, &mut found)
                .is_ok()
            {
                found.iter().for_each(check);
            }
        }
        1 => {
            let entry: [[Complex64; N]; N] =
                std::array::from_fn(|_| std::array::from_fn(|_| Complex64::new(next(), next())));
            // The matrix X itself, or the covariance X X^H.
            let matrix = if how >> 3 & 1 == 1 {
                entry
            } else {
                std::array::from_fn(|i| {
                    std::array::from_fn(|j| (0..N).map(|k| entry[i][k] * entry[j][k].conj()).sum())
                })
            };
            let Ok(covariance) = Covariance::from_matrix(matrix, SNAPSHOTS) else {
                return;
            };
            let array = Array::half_wavelength();
            if let Ok(found) = estimate_several(method, &covariance, &array, sources) {
                found.iter().for_each(check);
            }
        }
        2 => {
            let places = std::array::from_fn(|_| std::array::from_fn(|_| next()));
            if let Ok(array) = ArbitraryArray::<N>::new(places) {
                look(array, [next(), next()], &mut next);
            }
        }
        _ => {
            let elevations: Vec<f64> = (0..=many % 4).map(|_| next()).collect();
            let columns = usize::from(how % 12);
            let responses = (0..columns * elevations.len())
                .map(|_| std::array::from_fn(|_| Complex64::new(next(), next())));
            let table = MeasuredManifold::<N>::new(columns, &elevations, responses.collect());
            if let Ok(table) = table {
                look(table, [next(), next()], &mut next);
            }
        }
    }
}

fn look(manifold: impl Manifold<N>, elevations: [f64; 2], next: &mut impl FnMut() -> f64) {
    let Ok(finder) = DirectionFinder::new(manifold, elevations) else {
        return;
    };
    let blocks: Vec<[Complex64; N]> = (0..SNAPSHOTS)
        .map(|_| std::array::from_fn(|_| Complex64::new(next(), next())))
        .collect();
    let noise = next();
    for found in [
        Covariance::from_snapshots(&blocks).and_then(|covariance| finder.estimate(&covariance)),
        finder.estimate_pilots(&blocks, Some(noise)),
    ] {
        let Ok(DirectionEstimate { direction, .. }) = found else {
            continue;
        };
        let [lowest, highest] = elevations;
        let (azimuth, elevation) = (direction.azimuth_rad, direction.elevation_rad);
        assert!(azimuth.abs() <= std::f64::consts::PI, "{direction:?}");
        assert!(
            (lowest - 1e-9..=highest + 1e-9).contains(&elevation),
            "{direction:?}"
        );
    }
}

fn check(found: &AngleEstimate) {
    use std::f64::consts::{FRAC_PI_2, PI};
    assert!(found.phase_rad.abs() <= PI, "{found:?}");
    assert!((0.0..=PI).contains(&found.angle_rad), "{found:?}");
    assert!((0.0..2.0).contains(&found.phase_sigma_rad), "{found:?}");
    assert!((0.0..=FRAC_PI_2).contains(&found.sigma_rad), "{found:?}");
    assert!(!found.snr_db.is_nan(), "{found:?}");
}
