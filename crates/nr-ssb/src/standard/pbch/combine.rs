//! Combination of the PBCHs of several periods.
//!
//! Between periods, only the SFN's low bits, the half-frame bit and the payload's scrambling
//! change. The change depends on the position of the first period within the 160 ms after which the
//! SFN's high bits change. For every position, the difference between two payloads is known. CRC,
//! polar code and rate matching are linear, so that the difference between their coded bits is also
//! known. Log-likelihood ratios are added after the corresponding sign changes. The correct
//! position yields a valid CRC, and its message contains the position.

use super::decode::{Decoded, Decoder, recover};
use super::encode::{message, with_crc};
use crate::error::Error;
use crate::standard::coding::polar::{self, N};
use crate::standard::coding::rate_matching::E;
use crate::standard::message::payload::{BchPayload, scramble};
use crate::standard::numerology::Lmax;
use crate::standard::pci::Pci;

/// Number of half frames (of 5 ms) with equal six high bits of the SFN.
const SAME_SFN_MSB: u32 = 32;
/// Number of half frames in 20 ms. Periods at multiples of this distance have equal half-frame bits
/// and equal last SFN bits, on which the scrambling does not depend.
const COARSEST_STEP: u32 = 4;

/// PBCH of one period; all periods have the same cell and SSB index.
#[derive(Debug, Clone, Copy)]
pub struct Period<'a> {
    /// Log-likelihood ratios like those of [`Decoder::decode`], weighted by the SNR of the period.
    pub llr: &'a [f32; E],
    /// Reception time in half frames of 5 ms since the first one; 4 for the SSB 20 ms later.
    pub half_frames: u16,
}

impl Decoder {
    /// Decodes the PBCHs of several periods together, with a gain of about 10·log₁₀(n) dB. Returns
    /// the payload of the first period.
    ///
    /// Up to 8 list decodings are needed at periods of multiples of 20 ms, up to 32 at 5 ms, so
    /// that it is useful only after the last period failed alone. Periods before and after a change
    /// of the SFN's high bits, every 160 ms, cannot be added; the side with more periods is used.
    ///
    /// # Errors
    /// [`Error::NonFiniteLlr`] for a NaN or infinite ratio.
    pub fn combine(
        &mut self,
        periods: &[Period],
        pci: Pci,
        v: u8,
        lmax: Lmax,
    ) -> Result<Option<Decoded>, Error> {
        if let [only] = periods {
            return self.decode(only.llr, pci, v, lmax);
        }
        self.periods.resize(periods.len(), [0.0; N]);
        for (coded, period) in self.periods.iter_mut().zip(periods) {
            recover(period.llr, pci, v, coded)?;
        }
        // Power of two that divides all times.
        let all_times = periods
            .iter()
            .fold(COARSEST_STEP, |all, p| all | u32::from(p.half_frames));
        let step = 1 << all_times.trailing_zeros();
        for start in (0..SAME_SFN_MSB).step_by(step) {
            let Some(reference) = self.add_up(periods, start, pci, lmax) else {
                return Ok(None);
            };
            let time = (start + reference) % SAME_SFN_MSB;
            let decoded = self
                .list
                .decode(&self.coded)
                .filter_map(|message| Decoded::read(message, pci, v, lmax))
                .find(|decoded| clock(&decoded.payload) / step as u32 == time / step as u32);
            if let Some(decoded) = decoded {
                return Ok(Some(earlier(&decoded, reference, lmax)));
            }
        }
        Ok(None)
    }

    /// Adds the periods as if all had the payload of one of them, for a first period `start` half
    /// frames after a change of the SFN's high bits. Returns the time of that one.
    fn add_up(&mut self, periods: &[Period], start: u32, pci: Pci, lmax: Lmax) -> Option<u32> {
        let side = |period: &Period| (start + u32::from(period.half_frames)) / SAME_SFN_MSB;
        let count = |period: &&Period| periods.iter().filter(|p| side(p) == side(period)).count();
        let reference = periods.iter().rev().max_by_key(count)?;
        let clock_payload = |period: &Period| {
            let time = (start + u32::from(period.half_frames)) % SAME_SFN_MSB;
            let payload = BchPayload {
                sfn_lsb: (time / 2) as u8,
                half_frame: time % 2 == 1,
                ..BchPayload::default()
            };
            scramble(payload.bits(lmax), pci, lmax)
        };
        self.coded.fill(0.0);
        for (period, llr) in periods.iter().zip(&self.periods) {
            if side(period) == side(reference) {
                let difference = clock_payload(period) ^ clock_payload(reference);
                add_flipped(&mut self.coded, llr, &polar::encode(with_crc(difference)));
            }
        }
        Some(u32::from(reference.half_frames))
    }
}

/// Adds `llr` with a reversed sign for each 1 in `flips`.
fn add_flipped(sum: &mut [f32; N], llr: &[f32; N], flips: &polar::Codeword) {
    let words = sum
        .chunks_exact_mut(64)
        .zip(llr.chunks_exact(64))
        .zip(flips);
    for ((sum, llr), &flips) in words {
        for (bit, (sum, &x)) in sum.iter_mut().zip(llr).enumerate() {
            let sign = ((flips >> bit & 1) as u32) << 31;
            *sum += f32::from_bits(x.to_bits() ^ sign);
        }
    }
}

/// Returns the number of half frames since the SFN's high bits changed.
fn clock(payload: &BchPayload) -> u32 {
    2 * u32::from(payload.sfn_lsb) + u32::from(payload.half_frame)
}

/// Returns the message of the same SSB `half_frames` earlier.
fn earlier(decoded: &Decoded, half_frames: u32, lmax: Lmax) -> Decoded {
    const SFN_CYCLE: u32 = 2048;
    let now = 2 * u32::from(decoded.payload.sfn()) + u32::from(decoded.payload.half_frame);
    let then = (now + SFN_CYCLE - half_frames % SFN_CYCLE) % SFN_CYCLE;
    let mut payload = decoded.payload;
    payload.mib.sfn_msb = (then / 32) as u8;
    payload.sfn_lsb = (then / 2 % 16) as u8;
    payload.half_frame = then % 2 == 1;
    // Reserved bits are part of the message, but not of the payload's fields.
    let sent = scramble((decoded.message >> 24) as u32, decoded.pci, lmax);
    let reserved = sent ^ decoded.payload.bits(lmax);
    Decoded {
        payload,
        message: message(payload.bits(lmax) ^ reserved, decoded.pci, lmax),
        ..*decoded
    }
}
