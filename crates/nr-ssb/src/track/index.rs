//! Index of an SSB in its burst set, from the three low bits of the index and its time.

use crate::standard::numerology::{Case, Lmax, Numerology, SubcarrierSpacing};

/// Number of different DM-RS in a burst set of 64; eight SSBs share each of them.
const DMRS_INDICES: u8 = 8;

/// SSB indices of one cell.
#[derive(Debug, Clone)]
pub(super) struct SsbIndex {
    lmax: Lmax,
    spacing: SubcarrierSpacing,
    last: u8,
}

impl SsbIndex {
    /// Creates the state from the index of the detected SSB.
    pub(super) const fn new(lmax: Lmax, spacing: SubcarrierSpacing, last: u8) -> Self {
        Self {
            lmax,
            spacing,
            last,
        }
    }

    pub(super) const fn lmax(&self) -> Lmax {
        self.lmax
    }

    /// Returns the index of an SSB that was transmitted `samples` after the last one. In a burst
    /// set of 64, SSBs with equal DM-RS are half a millisecond apart at 120 kHz, a quarter at 240
    /// kHz.
    pub(super) fn of(&self, ibar_ssb: u8, samples: f64) -> u8 {
        if self.lmax != Lmax::L64 {
            return self.lmax.index_lsb(ibar_ssb);
        }
        let (Some(last), Some(half_frame)) = (self.place(self.last), self.half_frame()) else {
            return ibar_ssb;
        };
        let offset_in_periods = |index: &u8| {
            let expected = self
                .place(*index)
                .map_or(f64::INFINITY, |place| place - last);
            let periods = (samples - expected) / half_frame;
            (periods - periods.round()).abs()
        };
        let candidates = (0..Lmax::L64.count() / DMRS_INDICES)
            .map(|high| high * DMRS_INDICES + ibar_ssb % DMRS_INDICES);
        let nearest =
            candidates.min_by(|a, b| offset_in_periods(a).total_cmp(&offset_in_periods(b)));
        nearest.unwrap_or(ibar_ssb)
    }

    /// Stores the index of the last SSB.
    pub(super) const fn follow(&mut self, index: u8) {
        self.last = index;
    }

    /// Returns the first sample of an SSB in its half frame.
    fn place(&self, index: u8) -> Option<f64> {
        let case = match self.spacing {
            SubcarrierSpacing::Khz240 => Case::E,
            _ => Case::D,
        };
        let symbol = case.start_symbol(index).ok()?;
        Some(self.numerology()?.symbol_start(symbol) as f64)
    }

    fn half_frame(&self) -> Option<f64> {
        Some(self.numerology()?.half_frame_len() as f64)
    }

    fn numerology(&self) -> Option<Numerology> {
        Numerology::new(self.spacing, 256).ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_determines_the_high_bits_of_an_index() {
        for (case, spacing) in [
            (Case::D, SubcarrierSpacing::Khz120),
            (Case::E, SubcarrierSpacing::Khz240),
        ] {
            let numerology = Numerology::new(spacing, 256).unwrap();
            let start = |index| {
                let symbol = case.start_symbol(index).unwrap();
                numerology.symbol_start(symbol) as f64
            };
            let known = SsbIndex::new(Lmax::L64, spacing, 21);
            for index in 0..64 {
                // Three periods of 20 ms later, a tenth of a millisecond off.
                let later = 12.0 * numerology.half_frame_len() as f64;
                let error_samples = 1e-4 * numerology.sample_rate_hz();
                let samples = start(index) - start(21) + later + error_samples;
                assert_eq!(known.of(index % 8, samples), index);
            }
        }
        let few = SsbIndex::new(Lmax::L4, SubcarrierSpacing::Khz15, 1);
        assert_eq!(few.of(6, 0.0), 2);
    }
}
