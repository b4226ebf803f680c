//! Operating bands and synchronization raster.
//!
//! Downlink of TS 38.104 V17 Tables 5.2-1 and 5.2-2, raster entries of Tables 5.4.3.3-1 and
//! 5.4.3.3-2. The entries of n79 and n90 are those of narrow channels, which include those of wide
//! channels. Bands with uplink only and n263, which also has 480 and 960 kHz, are omitted.

use super::operating_band::Entries::{Listed, Steps};
use super::operating_band::Spectrum::{Paired, Unpaired};
use super::operating_band::{Band, Entries, Spectrum};
use crate::standard::numerology::Case::{self, A, B, C, D, E};

const fn band(
    number: u16,
    low_mhz: f64,
    high_mhz: f64,
    spectrum: Spectrum,
    raster: &'static [(Case, Entries)],
) -> Band {
    Band {
        number,
        downlink_mhz: [low_mhz, high_mhz],
        spectrum,
        raster,
    }
}

pub(super) const BANDS: &[Band] = &[
    band(1, 2110.0, 2170.0, Paired, &[(A, Steps(5279, 1, 5419))]),
    band(2, 1930.0, 1990.0, Paired, &[(A, Steps(4829, 1, 4969))]),
    band(3, 1805.0, 1880.0, Paired, &[(A, Steps(4517, 1, 4693))]),
    band(
        5,
        869.0,
        894.0,
        Paired,
        &[(A, Steps(2177, 1, 2230)), (B, Steps(2183, 1, 2224))],
    ),
    band(7, 2620.0, 2690.0, Paired, &[(A, Steps(6554, 1, 6718))]),
    band(8, 925.0, 960.0, Paired, &[(A, Steps(2318, 1, 2395))]),
    band(12, 729.0, 746.0, Paired, &[(A, Steps(1828, 1, 1858))]),
    band(13, 746.0, 756.0, Paired, &[(A, Steps(1871, 1, 1885))]),
    band(14, 758.0, 768.0, Paired, &[(A, Steps(1901, 1, 1915))]),
    band(18, 860.0, 875.0, Paired, &[(A, Steps(2156, 1, 2182))]),
    band(20, 791.0, 821.0, Paired, &[(A, Steps(1982, 1, 2047))]),
    band(
        24,
        1525.0,
        1559.0,
        Paired,
        &[(A, Steps(3818, 1, 3892)), (B, Steps(3824, 1, 3886))],
    ),
    band(25, 1930.0, 1995.0, Paired, &[(A, Steps(4829, 1, 4981))]),
    band(26, 859.0, 894.0, Paired, &[(A, Steps(2153, 1, 2230))]),
    band(28, 758.0, 803.0, Paired, &[(A, Steps(1901, 1, 2002))]),
    band(29, 717.0, 728.0, Paired, &[(A, Steps(1798, 1, 1813))]),
    band(30, 2350.0, 2360.0, Paired, &[(A, Steps(5879, 1, 5893))]),
    band(
        34,
        2010.0,
        2025.0,
        Unpaired,
        &[(A, Listed(&N34_A)), (C, Steps(5036, 1, 5050))],
    ),
    band(
        38,
        2570.0,
        2620.0,
        Unpaired,
        &[(A, Listed(&N38_A)), (C, Steps(6437, 1, 6538))],
    ),
    band(
        39,
        1880.0,
        1920.0,
        Unpaired,
        &[(A, Listed(&N39_A)), (C, Steps(4712, 1, 4789))],
    ),
    band(40, 2300.0, 2400.0, Unpaired, &[(C, Steps(5762, 1, 5989))]),
    band(
        41,
        2496.0,
        2690.0,
        Unpaired,
        &[(A, Steps(6246, 3, 6717)), (C, Steps(6252, 3, 6714))],
    ),
    band(46, 5150.0, 5925.0, Unpaired, &[(C, Listed(&N46_C))]),
    band(48, 3550.0, 3700.0, Unpaired, &[(C, Steps(7884, 1, 7982))]),
    band(50, 1432.0, 1517.0, Unpaired, &[(C, Steps(3590, 1, 3781))]),
    band(51, 1427.0, 1432.0, Unpaired, &[(A, Steps(3572, 1, 3574))]),
    band(53, 2483.5, 2495.0, Unpaired, &[(A, Steps(6215, 1, 6232))]),
    band(65, 2110.0, 2200.0, Paired, &[(A, Steps(5279, 1, 5494))]),
    band(
        66,
        2110.0,
        2200.0,
        Paired,
        &[(A, Steps(5279, 1, 5494)), (B, Steps(5285, 1, 5488))],
    ),
    band(67, 738.0, 758.0, Paired, &[(A, Steps(1850, 1, 1888))]),
    band(70, 1995.0, 2020.0, Paired, &[(A, Steps(4993, 1, 5044))]),
    band(71, 617.0, 652.0, Paired, &[(A, Steps(1547, 1, 1624))]),
    band(74, 1475.0, 1518.0, Paired, &[(A, Steps(3692, 1, 3790))]),
    band(75, 1432.0, 1517.0, Paired, &[(A, Steps(3584, 1, 3787))]),
    band(76, 1427.0, 1432.0, Paired, &[(A, Steps(3572, 1, 3574))]),
    band(77, 3300.0, 4200.0, Unpaired, &[(C, Steps(7711, 1, 8329))]),
    band(78, 3300.0, 3800.0, Unpaired, &[(C, Steps(7711, 1, 8051))]),
    band(79, 4400.0, 5000.0, Unpaired, &[(C, Steps(8475, 1, 8884))]),
    band(85, 728.0, 746.0, Paired, &[(A, Steps(1826, 1, 1858))]),
    band(
        90,
        2496.0,
        2690.0,
        Unpaired,
        &[(A, Steps(6245, 1, 6718)), (C, Steps(6252, 1, 6714))],
    ),
    band(91, 1427.0, 1432.0, Paired, &[(A, Steps(3572, 1, 3574))]),
    band(92, 1432.0, 1517.0, Paired, &[(A, Steps(3584, 1, 3787))]),
    band(93, 1427.0, 1432.0, Paired, &[(A, Steps(3572, 1, 3574))]),
    band(94, 1432.0, 1517.0, Paired, &[(A, Steps(3584, 1, 3787))]),
    band(96, 5925.0, 7125.0, Unpaired, &[(C, Listed(&N96_C))]),
    band(100, 919.4, 925.0, Paired, &[(A, Steps(2303, 1, 2307))]),
    band(
        101,
        1900.0,
        1910.0,
        Unpaired,
        &[(A, Steps(4754, 1, 4768)), (C, Steps(4760, 1, 4764))],
    ),
    band(102, 5925.0, 6425.0, Unpaired, &[(C, Listed(&N102_C))]),
    band(104, 6425.0, 7125.0, Unpaired, &[(C, Steps(9882, 7, 10358))]),
    band(
        257,
        26500.0,
        29500.0,
        Unpaired,
        &[(D, Steps(22388, 1, 22558)), (E, Steps(22390, 2, 22556))],
    ),
    band(
        258,
        24250.0,
        27500.0,
        Unpaired,
        &[(D, Steps(22257, 1, 22443)), (E, Steps(22258, 2, 22442))],
    ),
    band(
        259,
        39500.0,
        43500.0,
        Unpaired,
        &[(D, Steps(23140, 1, 23369)), (E, Steps(23142, 2, 23368))],
    ),
    band(
        260,
        37000.0,
        40000.0,
        Unpaired,
        &[(D, Steps(22995, 1, 23166)), (E, Steps(22996, 2, 23164))],
    ),
    band(
        261,
        27500.0,
        28350.0,
        Unpaired,
        &[(D, Steps(22446, 1, 22492)), (E, Steps(22446, 2, 22490))],
    ),
    band(
        262,
        47200.0,
        48200.0,
        Unpaired,
        &[(D, Steps(23586, 1, 23641)), (E, Steps(23588, 2, 23640))],
    ),
];

const N34_A: [u16; 3] = [5032, 5043, 5054];
const N38_A: [u16; 10] = [6432, 6443, 6457, 6468, 6479, 6493, 6507, 6518, 6532, 6543];
const N39_A: [u16; 14] = [
    4707, 4715, 4718, 4729, 4732, 4743, 4747, 4754, 4761, 4768, 4772, 4782, 4786, 4793,
];
const N46_C: [u16; 32] = [
    8996, 9010, 9024, 9038, 9051, 9065, 9079, 9093, 9107, 9121, 9218, 9232, 9246, 9260, 9274, 9288,
    9301, 9315, 9329, 9343, 9357, 9371, 9385, 9402, 9416, 9430, 9444, 9458, 9472, 9485, 9499, 9513,
];
const N96_C: [u16; 59] = [
    9548, 9562, 9576, 9590, 9603, 9617, 9631, 9645, 9659, 9673, 9687, 9701, 9714, 9728, 9742, 9756,
    9770, 9784, 9798, 9812, 9826, 9840, 9853, 9867, 9881, 9895, 9909, 9923, 9937, 9951, 9964, 9978,
    9992, 10006, 10020, 10034, 10048, 10062, 10076, 10090, 10103, 10117, 10131, 10145, 10159,
    10173, 10187, 10201, 10214, 10228, 10242, 10256, 10270, 10284, 10298, 10312, 10325, 10339,
    10353,
];
const N102_C: [u16; 25] = [
    9535, 9548, 9562, 9576, 9590, 9603, 9617, 9631, 9645, 9659, 9673, 9687, 9701, 9714, 9728, 9742,
    9756, 9770, 9784, 9798, 9812, 9826, 9840, 9853, 9867,
];
