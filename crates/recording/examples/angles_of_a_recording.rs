//! From a recording to angles of arrival with the library only: samples, SSBs, electrical angles.
//!
//! ```sh
//! access-av record synth yard --duration-s 2 --out drive
//! cargo run --release -p recording --example angles_of_a_recording -- \
//!     drive/iq.sigmf-meta drive/site.toml drive/vehicle.toml
//! ```

#![allow(clippy::print_stdout)]

use std::env;
use std::error::Error;

use onboard::estimator::{self, EstimatedAngle};
use onboard::receive::ReceiverConfig;
use onboard::settings::{Site, Vehicle};
use recording::replay::{ReplayError, receive_recording};
use recording::{Recording, load};

fn main() -> Result<(), Box<dyn Error>> {
    let given: Vec<String> = env::args().skip(1).collect();
    let [file, site, vehicle] = given.as_slice() else {
        return Err("give a recording, a site and a vehicle: names that ship, or files".into());
    };
    // The site determines the cells and the frequency, the vehicle determines the array.
    let site: Site = load(site)?;
    let vehicle: Vehicle = load(vehicle)?;
    let mut recording = Recording::open(file)?;
    let config = ReceiverConfig::new(&site, &vehicle);
    let mut estimator = estimator::built_in(&vehicle)?;

    println!("time_s,pci,ssb_index,phase_rad,phase_sigma_rad,snr_db");
    receive_recording(config, &mut recording, 0.0, |observations| {
        for observation in observations {
            let ssb = observation.ssb;
            let estimated = estimator
                .estimate(observation)
                .map_err(ReplayError::Custom)?;
            if let Some(EstimatedAngle::Angle {
                phase_rad,
                phase_sigma_rad,
                snr_db,
                ..
            }) = estimated
            {
                let sigma_rad = phase_sigma_rad.unwrap_or(f64::NAN);
                let snr_db = snr_db.unwrap_or(ssb.snr_db);
                println!(
                    "{:.6},{},{},{phase_rad:.6},{sigma_rad:.6},{snr_db:.1}",
                    ssb.time_s, ssb.pci, ssb.ssb_index
                );
            }
        }
        Ok(())
    })?;
    Ok(())
}
