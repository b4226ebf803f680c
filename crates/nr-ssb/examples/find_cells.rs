//! Finds every cell in a recording of one channel: `find_cells FILE RATE_HZ [CENTRE_HZ]`. The file
//! contains interleaved 32-bit floats (`cf32_le`, as in SigMF and GNU Radio). Without a file, the
//! example generates samples.
#![allow(clippy::print_stdout, reason = "it is what the example is for")]

use std::error::Error;

use nr_ssb::{BchPayload, Beam, Burst, Case, Complex32, Lmax, Mib, Numerology, Ofdm, Pci, raster};

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let (samples, rate_hz, centre_hz) = if let Some(file) = arguments.next() {
        let rate_hz = arguments.next().ok_or("which sample rate, in Hz?")?;
        let centre_hz = arguments.next().map(|it| it.parse()).transpose()?;
        (read(&file)?, rate_hz.parse()?, centre_hz)
    } else {
        (made()?, 15.36e6, Some(3_699.5e6))
    };
    for find in raster::scan(&[&samples], rate_hz, centre_hz)? {
        let mhz = 1e-6 * find.point.ssb_freq_hz;
        println!("{mhz:.3} MHz, {} kHz", find.spacing.khz());
        for ssb in find.ssbs {
            let at_ms = 1e3 * ssb.sample_start * find.input_per_output / rate_hz;
            let frame = ssb.payload.map_or_else(
                || "not decoded".to_owned(),
                |it| format!("frame {}", it.sfn()),
            );
            println!(
                "  {at_ms:8.3} ms  cell {:4}  beam {}  {:5.1} dB  {frame}",
                ssb.pci, ssb.ssb_index, ssb.snr_db
            );
        }
    }
    Ok(())
}

fn read(file: &str) -> Result<Vec<Complex32>, Box<dyn Error>> {
    let bytes = std::fs::read(file)?;
    let (numbers, _) = bytes.as_chunks::<4>();
    let (pairs, _) = numbers.as_chunks::<2>();
    let sample = |pair: &[[u8; 4]; 2]| {
        Complex32::new(f32::from_le_bytes(pair[0]), f32::from_le_bytes(pair[1]))
    };
    Ok(pairs.iter().map(sample).collect())
}

/// Creates the samples of two beams of a cell 1.3 MHz above the recording's centre.
fn made() -> Result<Vec<Complex32>, nr_ssb::Error> {
    let burst = Burst {
        pci: Pci::new(601)?,
        case: Case::C,
        lmax: Lmax::L8,
        payload: BchPayload::new(Mib::default(), 784, false, 0)?,
        beams: vec![Beam::new(1), Beam::new(6)],
        ssb_freq_hz: Some(3_700.8e6),
    };
    let numerology = Numerology::from_sample_rate(Case::C.spacing(), 15.36e6)?;
    let mut samples = burst.iq(&mut Ofdm::new(numerology))?;
    for (n, sample) in samples.iter_mut().enumerate() {
        let turns = 1.3e6 / 15.36e6 * n as f64;
        *sample *= Complex32::cis((std::f64::consts::TAU * turns.fract()) as f32);
    }
    Ok(samples)
}
