//! Repeated estimation of one batch, for profilers: `batches WHAT TIMES`. `WHAT` is `ml`, `music`,
//! `root-music`, `esprit` or `covariance`, with the suffix `-f32` for single precision.

use std::hint::black_box;

use aoa::{AngleEstimate, Array, Batch, Method, Real, Smoothing};
use num_complex::Complex;

/// Number of items of the batch; four antennas and twenty snapshots as in the benchmarks.
const ITEMS: usize = 64;
const SNAPSHOTS: usize = 20;

fn repeat<T: Real>(what: &str, times: usize, narrow: impl Fn(f64) -> T) -> Result<(), String> {
    // Each item has a source at another angle, and a deterministic disturbance.
    let samples: Vec<Complex<T>> = (0..ITEMS * 4 * SNAPSHOTS)
        .map(|i| {
            let (item, n, t) = (i / (4 * SNAPSHOTS), i / SNAPSHOTS % 4, i % SNAPSHOTS);
            let phase = (item as f64).sin() * 3.0 * n as f64 + (t * t) as f64;
            let noise = Complex::new(((i * 7919) % 97) as f64, ((i * 104_729) % 89) as f64);
            let sample = Complex::cis(phase) + (noise - Complex::new(48.0, 44.0)) / 400.0;
            Complex::new(narrow(sample.re), narrow(sample.im))
        })
        .collect();
    let batch = Batch::<T, 4>::new(&samples, SNAPSHOTS).map_err(|error| error.to_string())?;
    let array = Array::half_wavelength();
    let mut estimates = [AngleEstimate::default(); ITEMS];
    let method = match what {
        "ml" => Some(Method::MaximumLikelihood),
        "music" => Some(Method::Music),
        "root-music" => Some(Method::RootMusic),
        "esprit" => Some(Method::EspritTls),
        "covariance" => None,
        other => return Err(format!("no {other} here")),
    };
    for _ in 0..times {
        if let Some(method) = method {
            let none = Smoothing::default();
            let outcome = batch.estimate(method, &array, none, 1, black_box(&mut estimates));
            outcome.map_err(|error| error.to_string())?;
        } else {
            for covariance in batch.covariances() {
                let _ = black_box(covariance);
            }
        }
    }
    Ok(())
}

fn main() -> Result<(), String> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [what, times] = arguments.as_slice() else {
        return Err("usage: batches WHAT TIMES".into());
    };
    let times = times
        .parse()
        .map_err(|_| format!("TIMES must be a positive integer, not {times}"))?;
    match what.strip_suffix("-f32") {
        Some(what) => repeat(what, times, |it| it as f32),
        None => repeat(what, times, |it| it),
    }
}
