//! Times of estimates from four antennas and twenty snapshots, covariance included.

#![allow(clippy::unwrap_used)]

use aoa::{Array, Batch, Complex64, Covariance, Method, Smoothing};
use divan::{Bencher, black_box, counter::ItemsCount};

fn main() {
    divan::main();
}

/// Samples of a source at various angles with some deterministic noise, row-major.
fn samples(items: usize) -> Vec<Complex64> {
    let mut state = 1_u64;
    let mut uniform = || {
        state = state
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    let mut samples = Vec::with_capacity(items * 80);
    for item in 0..items {
        let phase = 2.9 * (item as f64 * 0.7).cos();
        let waveform: [Complex64; 20] =
            std::array::from_fn(|_| Complex64::new(uniform(), uniform()) * 4.0);
        for n in 0..4 {
            let element = Complex64::cis(phase * f64::from(n));
            samples.extend(waveform.map(|s| s * element + Complex64::new(uniform(), uniform())));
        }
    }
    samples
}

const METHODS: [Method; 5] = [
    Method::MaximumLikelihood,
    Method::Music {
        grid_deg: 0.1,
        refine: true,
    },
    Method::RootMusic,
    Method::EspritLs,
    Method::EspritTls,
];

#[divan::bench(args = METHODS)]
fn single(bencher: Bencher, method: &Method) {
    let array = Array::<4>::half_wavelength();
    let data = samples(1);
    let batch = Batch::<f64, 4>::new(&data, 20).unwrap();
    bencher.bench_local(|| {
        let covariance = black_box(batch).covariances().next().unwrap().unwrap();
        aoa::estimate(*method, &covariance, &array)
    });
}

#[divan::bench]
fn covariance(bencher: Bencher) {
    let data = samples(1);
    let batch = Batch::<f64, 4>::new(&data, 20).unwrap();
    bencher.bench_local(|| -> Covariance<4> {
        black_box(batch).covariances().next().unwrap().unwrap()
    });
}

#[divan::bench(args = [2, 3])]
fn several(bencher: Bencher, sources: usize) {
    let array = Array::<4>::half_wavelength();
    let data = samples(1);
    let covariance = Batch::<f64, 4>::new(&data, 20)
        .unwrap()
        .covariances()
        .next()
        .unwrap()
        .unwrap();
    bencher.bench_local(|| {
        aoa::estimate_several(Method::RootMusic, black_box(&covariance), &array, sources)
    });
}

#[divan::bench]
fn maximum_likelihood_batch_f64(bencher: Bencher) {
    let data = samples(1024);
    batch(bencher, &data);
}

#[divan::bench]
fn maximum_likelihood_batch_f32(bencher: Bencher) {
    let data: Vec<_> = samples(1024)
        .iter()
        .map(|z| num_complex::Complex::new(z.re as f32, z.im as f32))
        .collect();
    batch(bencher, &data);
}

fn batch<T: aoa::Real>(bencher: Bencher, data: &[num_complex::Complex<T>]) {
    let array = Array::<4>::half_wavelength();
    let batch = Batch::<T, 4>::new(data, 20).unwrap();
    let mut estimates = vec![aoa::AngleEstimate::default(); 1024];
    bencher
        .counter(ItemsCount::new(1024_usize))
        .bench_local(move || {
            batch.estimate(
                Method::MaximumLikelihood,
                &array,
                Smoothing::default(),
                1,
                black_box(&mut estimates),
            )
        });
}
