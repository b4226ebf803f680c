//! Operating bands at a frequency, and their number of SSBs per burst set.

use super::operating_band::{Band, Spectrum, lmax};
use super::table::BANDS;
use crate::standard::numerology::{Case, Lmax, SubcarrierSpacing};

/// Returns all known bands.
pub const fn all() -> &'static [Band] {
    BANDS
}

/// Returns the bands whose downlink contains `frequency_hz`.
pub fn holding(frequency_hz: f64) -> impl Iterator<Item = &'static Band> {
    let mhz = 1e-6 * frequency_hz;
    let holds = move |band: &&Band| (band.downlink_mhz[0]..=band.downlink_mhz[1]).contains(&mhz);
    all().iter().filter(holds)
}

/// Returns the SSB pattern of the first band that contains `frequency_hz` and has this spacing, or
/// of the spacing alone if there is none. At 30 kHz, the bands have two patterns.
///
/// ```
/// use nr_ssb::{Case, SubcarrierSpacing::Khz30, band::likely_case};
/// // n5 has pattern B, n78 pattern C.
/// assert_eq!(likely_case(Khz30, 0.88e9), Case::B);
/// assert_eq!(likely_case(Khz30, 3.5e9), Case::C);
/// ```
pub fn likely_case(spacing: SubcarrierSpacing, frequency_hz: f64) -> Case {
    let mut by_band = holding(frequency_hz).flat_map(Band::cases);
    let by_spacing = match spacing {
        SubcarrierSpacing::Khz15 => Case::A,
        SubcarrierSpacing::Khz30 => Case::C,
        SubcarrierSpacing::Khz120 => Case::D,
        SubcarrierSpacing::Khz240 => Case::E,
    };
    (by_band.find(|case| case.spacing() == spacing)).unwrap_or(by_spacing)
}

/// Burst set size at a frequency and subcarrier spacing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LikelyLmax {
    /// Burst set size, or the more probable one of two.
    pub likely: Lmax,
    /// Whether all bands at this frequency have the same size.
    pub certain: bool,
}

/// Returns the burst set sizes of the bands at a frequency. Outside all bands, every SSB pattern of
/// the spacing is possible. Without a frequency, 15 kHz indicates a band below 3 GHz, and 30 kHz a
/// band above.
///
/// ```
/// use nr_ssb::{Lmax, SubcarrierSpacing::Khz30, band::likely_lmax};
/// // n41 is unpaired spectrum, n66 paired.
/// assert_eq!(likely_lmax(Khz30, Some(2.6e9)).likely, Lmax::L8);
/// assert_eq!(likely_lmax(Khz30, Some(2.15e9)).likely, Lmax::L4);
/// assert!(!likely_lmax(Khz30, None).certain);
/// ```
pub fn likely_lmax(spacing: SubcarrierSpacing, frequency_hz: Option<f64>) -> LikelyLmax {
    let of_spacing = |case: &Case| case.spacing() == spacing;
    let Some(hz) = frequency_hz.filter(|hz| *hz > 0.0) else {
        let likely = match spacing {
            SubcarrierSpacing::Khz15 => Lmax::L4,
            SubcarrierSpacing::Khz30 => Lmax::L8,
            SubcarrierSpacing::Khz120 | SubcarrierSpacing::Khz240 => Lmax::L64,
        };
        let certain = likely == Lmax::L64;
        return LikelyLmax { likely, certain };
    };
    let by_band = holding(hz).flat_map(|band| {
        let cases = band.cases().filter(of_spacing);
        cases.map(|case| band.lmax(case, hz))
    });
    let by_any = Case::ALL.into_iter().filter(of_spacing).flat_map(|case| {
        [Spectrum::Paired, Spectrum::Unpaired].map(|spectrum| lmax(case, spectrum, hz))
    });
    let mut sizes: Vec<Lmax> = by_band.collect();
    if sizes.is_empty() {
        sizes = by_any.collect();
    }
    let likely = sizes.first().copied().unwrap_or(Lmax::L8);
    LikelyLmax {
        likely,
        certain: sizes.iter().all(|size| *size == likely),
    }
}

#[cfg(test)]
mod tests {
    use super::SubcarrierSpacing::{Khz15, Khz30, Khz120, Khz240};
    use super::*;

    #[test]
    fn the_band_determines_the_size_of_a_burst_set() {
        let sizes = |spacing, mhz: f64| {
            let LikelyLmax { likely, certain } = likely_lmax(spacing, Some(1e6 * mhz));
            (likely.count(), certain)
        };
        // n3, n78, n77, n79; n38, n40 and n41 in unpaired spectrum above 1.88 GHz.
        assert_eq!(sizes(Khz15, 1842.5), (4, true));
        for mhz in [3700.8, 4100.0, 4800.0, 2595.0, 2350.4, 2655.0] {
            assert_eq!(sizes(Khz30, mhz), (8, true), "{mhz}");
        }
        assert_eq!(sizes(Khz15, 2600.0), (4, true));
        // n66 has case B, n50 is below 1.88 GHz.
        assert_eq!(sizes(Khz30, 2150.0), (4, true));
        assert_eq!(sizes(Khz30, 1450.0), (4, true));
        // No band.
        assert_eq!(sizes(Khz30, 2750.0), (4, false));
        assert_eq!(sizes(Khz120, 26_600.0), (64, true));
        assert_eq!(sizes(Khz240, 28_000.0), (64, true));
        assert!(!likely_lmax(Khz30, None).certain);
    }
}
