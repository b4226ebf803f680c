//! Azimuth and elevation with five antennas in a circle: `cargo run --example circular_array`.

#![allow(clippy::print_stdout)]

use std::f64::consts::FRAC_PI_2;

use aoa::{
    ArbitraryArray, Complex64, Covariance, Direction, DirectionFinder, Manifold, PseudoSpectrum,
    bound,
};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

fn main() -> Result<(), aoa::Error> {
    // Adjacent antennas are half a wavelength apart.
    let array = ArbitraryArray::<5>::circular(0.425)?;
    // A horizontal circle cannot distinguish directions above and below; search above.
    let finder = DirectionFinder::new(array, [0.0, FRAC_PI_2])?;

    let truth = Direction::new(110_f64.to_radians(), 35_f64.to_radians());
    let (snr, count) = (10.0_f64, 20);
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let mut gaussian = || {
        let [re, im]: [f64; 2] = std::array::from_fn(|_| StandardNormal.sample(&mut random));
        Complex64::new(re, im) * 0.5_f64.sqrt()
    };
    let response = array.response(truth);
    let snapshots: Vec<[Complex64; 5]> = (0..count)
        .map(|_| {
            let signal = gaussian() * snr.sqrt();
            response.map(|element| element * signal + gaussian())
        })
        .collect();
    let covariance = Covariance::from_snapshots(&snapshots)?;

    let found = finder.estimate(&covariance)?;
    println!(
        "azimuth {:.1} ± {:.1}, elevation {:.1} ± {:.1} degrees, SNR {:.1} dB, {}",
        found.direction.azimuth_rad.to_degrees(),
        found.azimuth_sigma_rad().to_degrees(),
        found.direction.elevation_rad.to_degrees(),
        found.elevation_sigma_rad().to_degrees(),
        found.snr_db,
        found.verdict,
    );
    let limit = bound::azimuth_elevation(&array, truth, snr, count);
    println!(
        "Cramér–Rao bound: {:.1} and {:.1} degrees",
        limit[0][0].sqrt().to_degrees(),
        limit[1][1].sqrt().to_degrees(),
    );

    println!("MUSIC spectrum in dB over elevation (down) and azimuth (across):");
    let music = PseudoSpectrum::Music { sources: 1 };
    for elevation_deg in (0..=90).rev().step_by(15) {
        let ring: Vec<Direction> = (-180..180)
            .step_by(30)
            .map(|azimuth_deg| {
                Direction::new(
                    f64::from(azimuth_deg).to_radians(),
                    f64::from(elevation_deg).to_radians(),
                )
            })
            .collect();
        print!("{elevation_deg:4}°");
        for value in music.over_directions(&covariance, &array, &ring)? {
            print!(" {:5.1}", 10.0 * value.log10());
        }
        println!();
    }
    Ok(())
}
