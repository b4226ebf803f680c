//! The bands that cells are operated in, and what follows from them: where in frequency an SSB may
//! lie, and how many a burst set has.

mod table;

use super::numerology::{Case, Lmax, SubcarrierSpacing};

/// Whether uplink has a spectrum of its own. A band without uplink counts as paired.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Spectrum {
    /// Frequency division.
    Paired,
    /// Time division.
    Unpaired,
}

/// An operating band.
///
/// ```
/// use nr_ssb::{Case, band};
/// let n78 = band::all().iter().find(|band| band.number == 78).expect("a band");
/// assert_eq!(n78.downlink_mhz, [3300.0, 3800.0]);
/// let gscn: Vec<u16> = n78.gscn(Case::C).collect();
/// assert_eq!((gscn[0], gscn.len()), (7711, 341));
/// assert_eq!(n78.gscn(Case::A).count(), 0);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Band {
    /// The number after the n.
    pub number: u16,
    /// Lowest and highest frequency of the downlink, MHz.
    pub downlink_mhz: [f64; 2],
    /// Whether uplink has a spectrum of its own.
    pub spectrum: Spectrum,
    raster: &'static [(Case, Entries)],
}

/// Global synchronization channel numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Entries {
    /// First, step and last.
    Steps(u16, u16, u16),
    Listed(&'static [u16]),
}

/// All bands that this crate knows.
pub const fn all() -> &'static [Band] {
    table::BANDS
}

/// The bands whose downlink holds `frequency_hz`.
pub fn holding(frequency_hz: f64) -> impl Iterator<Item = &'static Band> {
    let mhz = 1e-6 * frequency_hz;
    let holds = move |band: &&Band| (band.downlink_mhz[0]..=band.downlink_mhz[1]).contains(&mhz);
    all().iter().filter(holds)
}

impl Band {
    /// The patterns that the band's SSBs may have in time.
    pub fn cases(&self) -> impl Iterator<Item = Case> {
        self.raster.iter().map(|(case, _)| *case)
    }

    /// The numbers of the raster's points where an SSB of this pattern may lie; the frequency of one
    /// is that of its [`RasterPoint`](crate::raster::RasterPoint).
    pub fn gscn(&self, case: Case) -> impl Iterator<Item = u16> {
        let of_case = self.raster.iter().filter(move |(it, _)| *it == case);
        of_case.flat_map(|(_, entries)| {
            let (steps, listed) = match *entries {
                Entries::Steps(first, step, last) => {
                    (Some((first..=last).step_by(usize::from(step))), None)
                }
                Entries::Listed(numbers) => (None, Some(numbers.iter().copied())),
            };
            steps
                .into_iter()
                .flatten()
                .chain(listed.into_iter().flatten())
        })
    }

    /// The size of a burst set of this pattern at `frequency_hz` (TS 38.213 §4.1).
    pub fn lmax(&self, case: Case, frequency_hz: f64) -> Lmax {
        lmax(case, self.spectrum, frequency_hz)
    }
}

/// The size of a burst set (TS 38.213 §4.1).
fn lmax(case: Case, spectrum: Spectrum, frequency_hz: f64) -> Lmax {
    let four = match (case, spectrum) {
        (Case::D | Case::E, _) => return Lmax::L64,
        (Case::C, Spectrum::Unpaired) => frequency_hz < 1.88e9,
        _ => frequency_hz <= 3e9,
    };
    if four { Lmax::L4 } else { Lmax::L8 }
}

/// What size burst sets have at a frequency and subcarrier spacing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LikelyLmax {
    /// The size, or the likelier of two.
    pub likely: Lmax,
    /// Whether none of the bands there has another.
    pub certain: bool,
}

/// The sizes that the bands at a frequency leave open. Where no band is, any pattern of that spacing
/// may be; without a frequency, 15 kHz speaks for bands below 3 GHz and 30 kHz for those above.
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
    fn bands_tell_the_size_of_a_burst_set() {
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
