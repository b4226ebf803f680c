//! Operating band.

use crate::standard::numerology::{Case, Lmax};

/// Whether the uplink has its own spectrum. A band without uplink counts as paired.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Spectrum {
    /// Frequency division duplex.
    Paired,
    /// Time division duplex.
    Unpaired,
}

/// Operating band.
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
    /// Band number: n followed by this number.
    pub number: u16,
    /// Lower and upper end of the downlink, in MHz.
    pub downlink_mhz: [f64; 2],
    /// Whether the uplink has its own spectrum.
    pub spectrum: Spectrum,
    pub(super) raster: &'static [(Case, Entries)],
}

/// Global synchronization channel numbers (GSCN).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Entries {
    /// First, step and last.
    Steps(u16, u16, u16),
    Listed(&'static [u16]),
}

impl Band {
    /// Returns the possible SSB patterns in time.
    pub fn cases(&self) -> impl Iterator<Item = Case> {
        self.raster.iter().map(|(case, _)| *case)
    }

    /// Returns the GSCNs of the raster points for SSBs of this pattern.
    /// [`RasterPoint`](crate::raster::RasterPoint) contains the frequency of a GSCN.
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

    /// Returns the burst set size of this pattern at `frequency_hz` (TS 38.213 §4.1).
    pub fn lmax(&self, case: Case, frequency_hz: f64) -> Lmax {
        lmax(case, self.spectrum, frequency_hz)
    }
}

/// Returns the burst set size (TS 38.213 §4.1).
pub(super) fn lmax(case: Case, spectrum: Spectrum, frequency_hz: f64) -> Lmax {
    let four = match (case, spectrum) {
        (Case::D | Case::E, _) => return Lmax::L64,
        (Case::C, Spectrum::Unpaired) => frequency_hz < 1.88e9,
        _ => frequency_hz <= 3e9,
    };
    if four { Lmax::L4 } else { Lmax::L8 }
}
