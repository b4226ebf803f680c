//! Resource elements of each signal.

use std::ops::Range;

use crate::standard::pci::Pci;
use crate::standard::sequence::dmrs::DMRS_LEN;
use crate::standard::sequence::m_sequence::SYNC_LEN;

/// Subcarriers of an SSB.
pub const SUBCARRIERS: usize = 240;
/// OFDM symbols of an SSB.
pub const SYMBOLS: usize = 4;
/// Number of PBCH resource elements in one SSB, without DM-RS.
pub const PBCH_LEN: usize = 432;

/// Index ranges of PBCH and DM-RS.
const PBCH_AREAS: [Range<usize>; 4] = [240..480, 480..528, 672..720, 720..960];

const DMRS_INDICES: [[usize; DMRS_LEN]; 4] =
    [pick(0, true), pick(1, true), pick(2, true), pick(3, true)];
const PBCH_INDICES: [[usize; PBCH_LEN]; 4] = [
    pick(0, false),
    pick(1, false),
    pick(2, false),
    pick(3, false),
];

/// Returns the elements of the PBCH areas with k = `v` mod 4 (`dmrs`), or the other elements.
const fn pick<const N: usize>(v: usize, dmrs: bool) -> [usize; N] {
    let mut indices = [0; N];
    let mut n = 0;
    let mut area = 0;
    while area < PBCH_AREAS.len() {
        let mut index = PBCH_AREAS[area].start;
        while index < PBCH_AREAS[area].end {
            // 240 and the bounds of the areas are multiples of 4, so that index mod 4 = k mod 4.
            if (index % 4 == v) == dmrs {
                indices[n] = index;
                n += 1;
            }
            index += 1;
        }
        area += 1;
    }
    indices
}

/// Returns the flat indices of the PSS: k = 56…182, l = 0.
pub const fn pss_indices() -> Range<usize> {
    56..56 + SYNC_LEN
}

/// Returns the flat indices of the SSS: k = 56…182, l = 2.
pub const fn sss_indices() -> Range<usize> {
    let start = 2 * SUBCARRIERS + 56;
    start..start + SYNC_LEN
}

/// Returns the flat indices of the PBCH, in the order of its symbols.
pub fn pbch_indices(pci: Pci) -> &'static [usize; PBCH_LEN] {
    &PBCH_INDICES[usize::from(pci.get() % 4)]
}

/// Returns the flat indices of the PBCH DM-RS, in the order of [`dmrs`](crate::dmrs::dmrs).
pub fn dmrs_indices(pci: Pci) -> &'static [usize; DMRS_LEN] {
    &DMRS_INDICES[usize::from(pci.get() % 4)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn signals_never_overlap_and_leave_only_the_guards() {
        for pci in Pci::all().take(4) {
            let mut uses = [0; SUBCARRIERS * SYMBOLS];
            let all = pss_indices()
                .chain(sss_indices())
                .chain(*pbch_indices(pci))
                .chain(*dmrs_indices(pci));
            for index in all {
                uses[index] += 1;
            }
            for (index, count) in uses.into_iter().enumerate() {
                let (k, l) = (index % SUBCARRIERS, index / SUBCARRIERS);
                let guard = match l {
                    0 => !(56..183).contains(&k),
                    2 => (48..56).contains(&k) || (183..192).contains(&k),
                    _ => false,
                };
                assert_eq!(count, i32::from(!guard), "k {k}, l {l}");
            }
        }
    }
}
