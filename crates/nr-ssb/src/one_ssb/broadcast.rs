//! PBCH of an identified SSB: burst set size and message.

use num_complex::Complex32;

use super::acquire::{Acquired, Acquirer};
use crate::standard::band::{LikelyLmax, likely_lmax};
use crate::standard::coding::rate_matching::E;
use crate::standard::grid::PBCH_LEN;
use crate::standard::message::payload::BchPayload;
use crate::standard::numerology::{Lmax, SubcarrierSpacing};
use crate::standard::pbch::{self, Decoder, Period};
use crate::standard::pci::Pci;

/// Maximum number of combined periods, including the latest.
const PERIODS: usize = 4;
/// Maximum number of stored PBCHs that were not decodable alone.
const KEPT: usize = 32;
/// Half frames after which the high bits of the SFN have changed.
const LONGEST_HALF_FRAMES: f64 = 32.0;
/// Maximum deviation of a repetition from a multiple of 5 ms, in samples, due to clock drift.
const PERIOD_TOLERANCE: f64 = 3.0;

/// Message of a PBCH and its burst set size.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Broadcast {
    pub(crate) payload: BchPayload,
    /// `None` if the message is also valid for another size, and the band permits either.
    pub(crate) lmax: Option<Lmax>,
    /// Re-encoded resource elements.
    pub(crate) symbols: [Complex32; PBCH_LEN],
}

/// PBCH that was not decodable alone.
struct Undecoded {
    pci: Pci,
    ibar_ssb: u8,
    /// First sample of the SSB.
    time: f64,
    llrs: [f32; E],
}

/// PBCH decoder that tries the possible burst set sizes, and combines periods of a weak cell.
pub(crate) struct BroadcastDecoder {
    decoder: Decoder,
    llrs: [f32; E],
    spacing: SubcarrierSpacing,
    /// Burst set size, if known.
    configured: Option<Lmax>,
    size: LikelyLmax,
    undecoded: Vec<Undecoded>,
    half_frame_samples: f64,
}

impl BroadcastDecoder {
    /// Creates a decoder for SSBs of a spacing, with the burst set size `lmax` and the frequency if
    /// they are known.
    pub(crate) fn new(
        spacing: SubcarrierSpacing,
        lmax: Option<Lmax>,
        ssb_freq_hz: Option<f64>,
    ) -> Self {
        Self {
            decoder: Decoder::default(),
            llrs: [0.0; E],
            spacing,
            configured: lmax,
            size: size(spacing, lmax, ssb_freq_hz),
            undecoded: Vec::with_capacity(KEPT),
            half_frame_samples: 5e-3 * spacing.base_rate_hz(),
        }
    }

    /// Sets another SSB frequency.
    pub(crate) fn tune(&mut self, ssb_freq_hz: Option<f64>) {
        self.size = size(self.spacing, self.configured, ssb_freq_hz);
        self.forget();
    }

    /// Removes the stored periods.
    pub(crate) fn forget(&mut self) {
        self.undecoded.clear();
    }

    /// Returns the more probable burst set size, before any PBCH was decoded.
    pub(crate) fn likely_lmax(&self) -> Lmax {
        self.size.likely
    }

    /// Returns the burst set size if only one is possible.
    pub(crate) fn certain_lmax(&self) -> Option<Lmax> {
        self.size.certain.then_some(self.size.likely)
    }

    /// Returns the possible burst set sizes, the more probable one first.
    fn sizes(&self) -> impl Iterator<Item = Lmax> + use<> {
        let likely = self.size.likely;
        let other = match likely {
            Lmax::L4 => Some(Lmax::L8),
            Lmax::L8 => Some(Lmax::L4),
            Lmax::L64 => None,
        };
        std::iter::once(likely).chain(other.filter(|_| self.configured.is_none()))
    }

    /// Decodes the PBCH of the acquirer's SSB.
    pub(crate) fn decode(&mut self, acquirer: &Acquirer, acquired: &Acquired) -> Option<Broadcast> {
        let &Acquired { pci, ibar_ssb, .. } = acquired;
        acquirer.log_likelihood_ratios(pci, &acquired.alignment, &mut self.llrs);
        let certain = self.certain_lmax();
        self.sizes().find_map(|lmax| {
            let v = lmax.index_lsb(ibar_ssb);
            let decoded = self.decoder.decode(&self.llrs, pci, v, lmax).ok()??;
            fits(&decoded.payload, lmax, ibar_ssb).then(|| Broadcast {
                payload: decoded.payload,
                lmax: implied_lmax(&decoded.payload, lmax, ibar_ssb, certain),
                symbols: decoded.symbols(),
            })
        })
    }

    /// Stores the PBCH that [`decode`](Self::decode) failed to decode, whose SSB begins at sample
    /// `time`, and decodes it together with up to three earlier ones of the same cell and beam.
    pub(crate) fn combine(&mut self, acquired: &Acquired, time: f64) -> Option<Broadcast> {
        let &Acquired { pci, ibar_ssb, .. } = acquired;
        let half_frame = self.half_frame_samples;
        if self.undecoded.len() == KEPT {
            self.undecoded.remove(0);
        }
        self.undecoded.push(Undecoded {
            pci,
            ibar_ssb,
            time,
            llrs: self.llrs,
        });
        let repeats = |other: &&Undecoded| {
            let samples = time - other.time;
            let whole = (samples / half_frame).round();
            other.pci == pci
                && other.ibar_ssb == ibar_ssb
                && whole.abs() < LONGEST_HALF_FRAMES
                && (samples - whole * half_frame).abs() < PERIOD_TOLERANCE
        };
        // The latest examined PBCH, which need not be the latest received one.
        let mut periods_of_ssb = [None; PERIODS];
        for (slot, other) in periods_of_ssb
            .iter_mut()
            .zip(self.undecoded.iter().rev().filter(repeats))
        {
            *slot = Some(other);
        }
        let count = periods_of_ssb.iter().flatten().count();
        let time_of = |one: Option<&Undecoded>| one.map_or(f64::INFINITY, |one| one.time);
        periods_of_ssb.sort_by(|a, b| time_of(*a).total_cmp(&time_of(*b)));
        let first = periods_of_ssb[0].filter(|_| count > 1)?;
        let after_first = |time: f64| ((time - first.time) / half_frame).round() as u16;
        let periods = periods_of_ssb.map(|one| {
            let one = one.unwrap_or(first);
            Period {
                llr: &one.llrs,
                half_frames: after_first(one.time),
            }
        });
        let elapsed = i32::from(after_first(time));
        let certain = self.certain_lmax();
        self.sizes().find_map(|lmax| {
            let v = lmax.index_lsb(ibar_ssb);
            let decoded = self
                .decoder
                .combine(&periods[..count], pci, v, lmax)
                .ok()??;
            let payload = moved(decoded.payload, elapsed);
            fits(&payload, lmax, ibar_ssb).then(|| Broadcast {
                payload,
                lmax: implied_lmax(&payload, lmax, ibar_ssb, certain),
                symbols: pbch::encode(&payload, pci, lmax),
            })
        })
    }

    /// Returns the message of the same SSB `samples` later (or earlier, if negative); `None` unless
    /// that is a multiple of 5 ms.
    pub(crate) fn repeated(&self, payload: BchPayload, samples: f64) -> Option<BchPayload> {
        let half_frames = (samples / self.half_frame_samples).round();
        let off = (samples - half_frames * self.half_frame_samples).abs();
        (off < PERIOD_TOLERANCE).then(|| moved(payload, half_frames as i32))
    }
}

/// Returns the burst set size implied by a PBCH that was decoded with `lmax`; `certain` is the size
/// if only one is possible. The first four SSBs of the first half frame are identical in burst sets
/// of 4 and 8.
fn implied_lmax(
    payload: &BchPayload,
    lmax: Lmax,
    ibar_ssb: u8,
    certain: Option<Lmax>,
) -> Option<Lmax> {
    let same = lmax != Lmax::L64 && ibar_ssb < 4 && !payload.half_frame;
    if same { certain } else { Some(lmax) }
}

/// Whether DM-RS and PBCH encode the same half frame. The DM-RS encodes it for Lmax 4 only.
fn fits(payload: &BchPayload, lmax: Lmax, ibar_ssb: u8) -> bool {
    lmax != Lmax::L4 || payload.half_frame == (ibar_ssb >= 4)
}

/// Returns the payload of the same SSB `half_frames` later.
fn moved(payload: BchPayload, half_frames: i32) -> BchPayload {
    const SFN_CYCLE: i32 = 2048;
    let now = 2 * i32::from(payload.sfn()) + i32::from(payload.half_frame);
    let then = (now + half_frames).rem_euclid(SFN_CYCLE);
    let mut result = payload;
    result.mib.sfn_msb = (then / 32) as u8;
    result.sfn_lsb = (then / 2 % 16) as u8;
    result.half_frame = then % 2 == 1;
    result
}

/// Returns the configured burst set size, or the size in the bands at this frequency.
fn size(
    spacing: SubcarrierSpacing,
    configured: Option<Lmax>,
    ssb_freq_hz: Option<f64>,
) -> LikelyLmax {
    let configured = configured.map(|likely| LikelyLmax {
        likely,
        certain: true,
    });
    configured.unwrap_or_else(|| likely_lmax(spacing, ssb_freq_hz))
}
