//! Two sources in noise, separated by every method: `cargo run --example two_sources`.

#![allow(clippy::print_stdout)]

use aoa::{Array, Complex64, Covariance, Criterion, Method, estimate_several, source_count};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

fn main() -> Result<(), aoa::Error> {
    let array = Array::<8>::half_wavelength();
    let truth_deg: [f64; 2] = [75.0, 100.0];
    let amplitude = 3.0;

    let mut random = ChaCha8Rng::seed_from_u64(1);
    let mut gaussian = || {
        let [re, im]: [f64; 2] = std::array::from_fn(|_| StandardNormal.sample(&mut random));
        Complex64::new(re, im) * 0.5_f64.sqrt()
    };
    let steering = truth_deg.map(|degrees| {
        let phase_rad = array.phase_from_angle(degrees.to_radians());
        array.steering_vector(phase_rad)
    });
    let snapshots: Vec<[Complex64; 8]> = (0..50)
        .map(|_| {
            let waveforms = [gaussian() * amplitude, gaussian() * amplitude];
            std::array::from_fn(|n| {
                steering[0][n] * waveforms[0] + steering[1][n] * waveforms[1] + gaussian()
            })
        })
        .collect();

    let covariance = Covariance::from_snapshots(&snapshots)?;
    let sources = source_count(Criterion::Mdl, &covariance)?;
    println!("{sources} sources, at {truth_deg:?} degrees");
    for method in [Method::Music, Method::RootMusic, Method::EspritTls] {
        for found in estimate_several(method, &covariance, &array, sources)?.iter() {
            println!(
                "{method:?}: {:.2} ± {:.2} degrees, SNR {:.1} dB, {}",
                found.angle_rad.to_degrees(),
                found.sigma_rad.to_degrees(),
                found.snr_db,
                found.verdict,
            );
        }
    }
    Ok(())
}
