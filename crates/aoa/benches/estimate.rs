//! Time per estimate from four antennas and twenty snapshots, including the covariance.

#![allow(clippy::unwrap_used)]

use aoa::{Array, Batch, Complex64, Covariance, Method, Smoothing};
use divan::{Bencher, black_box, counter::ItemsCount};

/// Number of items of a batch.
const ITEMS: usize = 1024;

fn main() {
    divan::main();
}

/// Returns samples of a source at various angles with deterministic noise, row-major.
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
    Method::Music,
    Method::RootMusic,
    Method::EspritLs,
    Method::EspritTls,
];

#[divan::bench(args = METHODS)]
fn single(bencher: Bencher, method: Method) {
    let array = Array::<4>::half_wavelength();
    let data = samples(1);
    let batch = Batch::<f64, 4>::new(&data, 20).unwrap();
    bencher.bench_local(|| {
        let covariance = black_box(batch).covariances().next().unwrap().unwrap();
        aoa::estimate(method, &covariance, &array)
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

#[divan::bench(args = [Method::Music, Method::RootMusic, Method::EspritTls])]
fn two_sources(bencher: Bencher, method: Method) {
    let array = Array::<4>::half_wavelength();
    let data = samples(1);
    let covariance = Batch::<f64, 4>::new(&data, 20)
        .unwrap()
        .covariances()
        .next()
        .unwrap()
        .unwrap();
    bencher.bench_local(|| aoa::estimate_several(method, black_box(&covariance), &array, 2));
}

#[divan::bench(args = METHODS)]
fn batch_f64(bencher: Bencher, method: Method) {
    batch(bencher, &samples(ITEMS), method);
}

#[divan::bench(args = METHODS)]
fn batch_untested_f64(bencher: Bencher, method: Method) {
    let array = Array::<4>::half_wavelength();
    let data = samples(ITEMS);
    let batch = Batch::<f64, 4>::new(&data, 20).unwrap();
    let mut estimates = vec![aoa::UntestedEstimate::default(); ITEMS];
    bencher
        .counter(ItemsCount::new(ITEMS))
        .bench_local(move || batch.estimate_untested(method, &array, black_box(&mut estimates)));
}

#[divan::bench(args = METHODS)]
fn batch_f32(bencher: Bencher, method: Method) {
    let data: Vec<_> = samples(ITEMS)
        .iter()
        .map(|z| num_complex::Complex::new(z.re as f32, z.im as f32))
        .collect();
    batch(bencher, &data, method);
}

fn batch<T: aoa::Real>(bencher: Bencher, data: &[num_complex::Complex<T>], method: Method) {
    let array = Array::<4>::half_wavelength();
    let batch = Batch::<T, 4>::new(data, 20).unwrap();
    let mut estimates = vec![aoa::AngleEstimate::default(); ITEMS];
    bencher
        .counter(ItemsCount::new(ITEMS))
        .bench_local(move || {
            let smoothing = Smoothing::default();
            batch.estimate(method, &array, smoothing, 1, black_box(&mut estimates))
        });
}
