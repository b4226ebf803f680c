//! PBCH of an acquired SSB: which burst set size, and what it says.

use crate::acquire::{Acquired, Acquirer};
use crate::numerology::{Lmax, SubcarrierSpacing};
use crate::pbch::{Decoded, Decoder};
use crate::rate_matching::E;
use crate::search::SearchConfig;

/// A PBCH whose checksum held, and the burst set size under which it did.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Broadcast {
    pub(crate) decoded: Decoded,
    pub(crate) lmax: Lmax,
}

/// PBCH decoder that tries the admissible burst set sizes.
pub(crate) struct BroadcastDecoder {
    decoder: Decoder,
    llrs: [f32; E],
    /// Burst set sizes to try, the likelier first.
    sizes: Vec<Lmax>,
}

impl BroadcastDecoder {
    pub(crate) fn new(config: &SearchConfig) -> Self {
        Self {
            decoder: Decoder::default(),
            llrs: [0.0; E],
            sizes: burst_set_sizes(config),
        }
    }

    pub(crate) fn tune(&mut self, config: &SearchConfig) {
        self.sizes = burst_set_sizes(config);
    }

    pub(crate) fn likely_lmax(&self) -> Lmax {
        self.sizes.first().copied().unwrap_or(Lmax::L8)
    }

    /// Decodes the SSB that the acquirer holds.
    pub(crate) fn decode(&mut self, acquirer: &Acquirer, acquired: &Acquired) -> Option<Broadcast> {
        let &Acquired { pci, ibar_ssb, .. } = acquired;
        acquirer.log_likelihood_ratios(pci, &acquired.alignment, &mut self.llrs);
        self.sizes.iter().find_map(|&lmax| {
            let v = lmax.index_lsb(ibar_ssb);
            let decoded = self.decoder.decode(&self.llrs, pci, v, lmax).ok()??;
            // With four SSBs the DM-RS tells the half frame, and must tell the PBCH's.
            let half_frame_fits = lmax != Lmax::L4 || decoded.payload.half_frame == (ibar_ssb >= 4);
            half_frame_fits.then_some(Broadcast { decoded, lmax })
        })
    }
}

/// Burst set sizes to try, the likelier first.
fn burst_set_sizes(config: &SearchConfig) -> Vec<Lmax> {
    match config.lmax {
        Some(lmax) => vec![lmax],
        None if four_is_usual(config) => vec![Lmax::L4, Lmax::L8],
        None => vec![Lmax::L8, Lmax::L4],
    }
}

/// TS 38.213 §4.1: four SSBs up to 3 GHz. Without a frequency, 15 kHz speaks for the bands below.
fn four_is_usual(config: &SearchConfig) -> bool {
    match config.ssb_freq_hz {
        Some(hz) if hz > 0.0 => hz <= 3e9,
        _ => config.spacing == SubcarrierSpacing::Khz15,
    }
}
