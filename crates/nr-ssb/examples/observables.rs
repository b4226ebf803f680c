//! Errors of delay, carrier phase, range rate and power in noise, after sleeps: RMS error divided by
//! the Cramér–Rao bound, and normalised estimation error squared (NEES).
//!
//! ```sh
//! cargo run --release -p nr-ssb --example observables -- 400    # SSBs of each setting
//! ```
#![allow(
    clippy::expect_used,
    clippy::print_stdout,
    clippy::unwrap_used,
    reason = "a campaign"
)]

#[path = "../tests/all/air/mod.rs"]
mod air;
#[path = "../tests/all/moving/mod.rs"]
mod moving;

use moving::{Error, Moving, SsbErrors, summary};
use nr_ssb::SubcarrierSpacing::{Khz15, Khz30};
use nr_ssb::observables::delay::Multipath;
use nr_ssb::observables::range_rate::RateSource;

/// Number of SSBs of one run. Cell, position and speed change after a run.
const RUN: usize = 25;
/// Number of SSBs at the start of a run that are not evaluated.
const SETTLE: usize = 5;

fn main() {
    let count: usize = std::env::args()
        .nth(1)
        .map_or(200, |it| it.parse().unwrap());
    println!(
        "spacing_khz,snr_db,sleep_s,ssbs,missed,delay_ratio,delay_nees,delay_bias_sigmas,\
         multipath_detected,phase_ratio,phase_nees,rate_from_phase,rate_ratio,rate_nees,power_ratio"
    );
    let mut seed = 0;
    for spacing in [Khz15, Khz30] {
        for snr_db in [0.0, 10.0, 20.0, 30.0] {
            for sleep_s in [0.02, 0.16, 1.0, 5.0] {
                let (mut ssbs, mut missed) = (Vec::new(), 0);
                for _ in 0..count.div_ceil(RUN) {
                    seed += 1;
                    let mut moving = Moving::new(spacing, snr_db, None, seed);
                    for number in 0..RUN + SETTLE {
                        let settling = number < SETTLE;
                        match moving.next(if settling { 0.02 } else { sleep_s }) {
                            Some(_) if settling => {}
                            Some(ssb) => ssbs.push(ssb),
                            None => missed += 1,
                        }
                    }
                }
                let of = |select: fn(&SsbErrors) -> Error| {
                    let errors: Vec<Error> = ssbs.iter().map(select).collect();
                    summary(&errors)
                };
                let share = |is: fn(&SsbErrors) -> bool| {
                    ssbs.iter().filter(|it| is(it)).count() as f64 / ssbs.len() as f64
                };
                let [delay, phase, rate, power] = [
                    of(|it| it.delay),
                    of(|it| it.phase),
                    of(|it| it.rate),
                    of(|it| it.power),
                ];
                println!(
                    "{},{snr_db},{sleep_s},{},{missed},{:.3},{:.2},{:.2},{:.3},{:.3},{:.2},{:.2},{:.3},{:.2},{:.3}",
                    spacing.khz(),
                    delay.count,
                    delay.ratio,
                    delay.nees,
                    delay.bias_sigmas,
                    share(|it| it.multipath != Multipath::NotDetected),
                    phase.ratio,
                    phase.nees,
                    share(|it| it.source == RateSource::PhaseDifference),
                    rate.ratio,
                    rate.nees,
                    power.ratio,
                );
            }
        }
    }
}
