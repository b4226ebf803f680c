//! Conformity to the standard by vectors that `golden/make.py` generates from the standard's text.
//! They agree with those of three other encoders. `golden/mutate.py` modifies each table and
//! sequence, and checks that these tests fail; it is run manually.

use nr_ssb::burst::ssb_grid;
use nr_ssb::crc::crc24c;
use nr_ssb::dmrs::{dmrs, ibar_ssb};
use nr_ssb::grid::{dmrs_indices, pbch_indices, pss_indices, sss_indices};
use nr_ssb::mib::{DmrsTypeAPosition, SubcarrierSpacingCommon};
use nr_ssb::payload::scramble;
use nr_ssb::pbch::{self, Decoder};
use nr_ssb::pss::pss;
use nr_ssb::raster::synchronization_raster;
use nr_ssb::rate_matching::rate_match;
use nr_ssb::sss::sss;
use nr_ssb::{
    BchPayload, Case, Complex32, Lmax, Mib, Numerology, Pci, SubcarrierSpacing, band, polar,
};

/// Returns the fields of the lines that begin with `name`.
fn lines(name: &str) -> impl Iterator<Item = Vec<&'static str>> {
    let all = include_str!("golden/golden.txt").lines();
    let fields = all.map(|line| line.split_whitespace().collect::<Vec<_>>());
    let named = fields.filter(move |fields| fields[0] == name);
    named.map(|fields| fields[1..].to_vec())
}

fn number<T: std::str::FromStr<Err: std::fmt::Debug>>(text: &str) -> T {
    text.parse().unwrap()
}

fn pci(text: &str) -> Pci {
    Pci::new(number(text)).unwrap()
}

/// Returns the first `count` bits of hexadecimal digits.
fn bits(hex: &str, count: usize) -> Vec<u8> {
    let digits = hex.chars().map(|digit| digit.to_digit(16).unwrap());
    let bits = digits.flat_map(|digit| (0..4).rev().map(move |bit| (digit >> bit & 1) as u8));
    bits.take(count).collect()
}

fn packed(hex: &str, count: usize) -> u32 {
    let bits = bits(hex, count);
    bits.iter().fold(0, |word, bit| word << 1 | u32::from(*bit))
}

/// Returns the signs as bits: 1 for −1.
fn signs(sequence: &[f32]) -> Vec<u8> {
    sequence.iter().map(|x| u8::from(*x < 0.0)).collect()
}

/// Returns QPSK symbols as bits (TS 38.211, 5.1.3).
fn qpsk_bits(symbols: &[Complex32]) -> Vec<u8> {
    for symbol in symbols {
        assert!((symbol.norm() - 1.0).abs() < 1e-6);
        assert!((symbol.re.abs() - symbol.im.abs()).abs() < 1e-6);
    }
    symbols.iter().flat_map(|s| signs(&[s.re, s.im])).collect()
}

#[test]
fn sequences_equal_the_reference_file() {
    for line in lines("pss") {
        assert_eq!(
            signs(&pss(number(line[0]))),
            bits(line[1], 127),
            "{}",
            line[0]
        );
    }
    for line in lines("sss") {
        assert_eq!(signs(&sss(pci(line[0]))), bits(line[1], 127), "{}", line[0]);
    }
    for line in lines("dmrs") {
        let symbols = dmrs(pci(line[0]), number(line[1]));
        assert_eq!(
            qpsk_bits(&symbols),
            bits(line[2], 288),
            "{} {}",
            line[0],
            line[1]
        );
    }
}

#[test]
fn signal_positions_equal_the_reference_file() {
    assert_eq!((pss_indices(), sss_indices()), (56..183, 536..663));
    let used = |indices: &[usize]| {
        assert!(indices.is_sorted());
        let mut used = vec![0; 960];
        for index in indices {
            used[*index] = 1;
        }
        used
    };
    for line in lines("dmrs_index") {
        assert_eq!(used(dmrs_indices(pci(line[0]))), bits(line[1], 960));
    }
    for line in lines("pbch_index") {
        assert_eq!(used(pbch_indices(pci(line[0]))), bits(line[1], 960));
    }
}

#[test]
fn pbch_encoding_and_decoding_equal_the_reference_file() {
    let mut decoder = Decoder::default();
    let mut chains = 0;
    for line in lines("pbch") {
        let pci = pci(line[0]);
        let lmax = match line[1] {
            "4" => Lmax::L4,
            "8" => Lmax::L8,
            _ => Lmax::L64,
        };
        let (index, half_frame): (u8, bool) = (number(line[2]), line[3] == "1");
        let mib = Mib::from_bits(packed(line[6], 24)).unwrap();
        let payload = BchPayload {
            k_ssb_msb: line[5] == "1",
            ..BchPayload::new(mib, number(line[4]), half_frame, index).unwrap()
        };
        let plain = payload.bits(lmax);
        assert_eq!(plain, packed(line[7], 32));
        let scrambled = scramble(plain, pci, lmax);
        assert_eq!(scrambled, packed(line[8], 32));
        assert_eq!(crc24c(scrambled), packed(line[9], 24));
        let codeword = polar::encode(u64::from(scrambled) << 24 | u64::from(crc24c(scrambled)));
        let coded = (0..512).map(|n| (codeword[n / 64] >> (n % 64) & 1) as u8);
        assert!(coded.eq(bits(line[10], 512)));
        assert!(rate_match(&codeword).eq(bits(line[11], 864)));
        let sent = bits(line[12], 864);
        let symbols = pbch::encode(&payload, pci, lmax);
        assert_eq!(qpsk_bits(&symbols), sent);
        // Map to the grid, in order, with the DM-RS of this SSB.
        let grid = ssb_grid(pci, lmax, &payload).unwrap();
        let at = |index: &usize| grid.elements()[*index];
        assert!(pbch_indices(pci).iter().map(at).eq(symbols));
        let pilots = dmrs(pci, ibar_ssb(lmax, index, half_frame));
        assert!(dmrs_indices(pci).iter().map(at).eq(pilots));
        // The decoder decodes the reference symbols.
        let mut llrs = [0.0; 864];
        for (llr, bit) in llrs.iter_mut().zip(&sent) {
            *llr = if *bit == 0 { 4.0 } else { -4.0 };
        }
        let decoded = decoder.decode(&llrs, pci, lmax.index_lsb(index), lmax);
        assert_eq!(decoded.unwrap().unwrap().payload.bits(lmax), plain);
        chains += 1;
    }
    assert_eq!(chains, 6);
}

#[test]
fn the_dmrs_index_depends_on_the_burst_set_size() {
    for index in 0..8 {
        for half_frame in [false, true] {
            let four = (index & 3) + 4 * u8::from(half_frame);
            assert_eq!(ibar_ssb(Lmax::L4, index & 3, half_frame), four);
            assert_eq!(ibar_ssb(Lmax::L8, index, half_frame), index);
            assert_eq!(ibar_ssb(Lmax::L64, 40 + index, half_frame), index);
        }
    }
}

#[test]
fn burst_cases_and_raster_equal_the_reference_file() {
    for line in lines("case") {
        let case = Case::ALL.into_iter().find(|case| case.name() == line[0]);
        for (index, symbol) in (0..).zip(&line[1..]) {
            assert_eq!(
                case.unwrap().start_symbol(index).unwrap(),
                number::<usize>(symbol),
                "{}",
                line[0]
            );
        }
    }
    for line in lines("raster") {
        let hz = 1e3 * number::<f64>(line[1]);
        let here: Vec<_> = synchronization_raster(hz - 1.0, hz + 1.0).collect();
        assert_eq!(here.len(), 1, "{hz}");
        assert_eq!(here[0].gscn, Some(number(line[0])));
    }
}

/// The outermost SSBs of a band are inside the band and near its edges, which excludes large errors
/// of the table. (In the shared spectrum n46 and n96, the first 20 MHz channel begins farther
/// inside.)
#[test]
fn raster_entries_cover_their_bands() {
    for band in band::all() {
        let [low_hz, high_hz] = band.downlink_mhz.map(|mhz| 1e6 * mhz);
        let points: Vec<_> = synchronization_raster(low_hz, high_hz).collect();
        for case in band.cases() {
            let width_hz = 240.0 * case.spacing().hz();
            let hz = |gscn: u16| {
                let here = points.iter().find(|point| point.gscn == Some(gscn));
                here.unwrap().ssb_freq_hz
            };
            let (first, last) = (band.gscn(case).min(), band.gscn(case).max());
            for gap_hz in [hz(first.unwrap()) - low_hz, high_hz - hz(last.unwrap())] {
                let what = format!("n{} {}: {gap_hz}", band.number, case.name());
                assert!(gap_hz > 0.499 * width_hz, "{what}");
                assert!(gap_hz < 3.6 * width_hz, "{what}");
            }
        }
    }
}

#[test]
fn cyclic_prefixes_equal_the_reference_file() {
    for line in lines("prefix") {
        let spacing = SubcarrierSpacing::from_khz(number(line[0])).unwrap();
        let numerology = Numerology::new(spacing, 256).unwrap();
        let symbol = number(line[1]);
        let place = (numerology.symbol_start(symbol), numerology.cp_len(symbol));
        assert_eq!(place, (number(line[2]), number(line[3])), "{line:?}");
    }
}

#[test]
fn mib_fields_equal_the_reference_file() {
    let mut fields = 0;
    for line in lines("mib") {
        let mib = Mib::from_bits(packed(line[2], 24)).unwrap();
        let set = [
            ("systemFrameNumber", mib.sfn_msb),
            (
                "subCarrierSpacingCommon",
                u8::from(mib.subcarrier_spacing_common == SubcarrierSpacingCommon::Scs30Or120),
            ),
            ("ssb-SubcarrierOffset", mib.ssb_subcarrier_offset),
            (
                "dmrs-TypeA-Position",
                u8::from(mib.dmrs_type_a_position == DmrsTypeAPosition::Pos3),
            ),
            ("controlResourceSetZero", mib.control_resource_set_zero()),
            ("searchSpaceZero", mib.search_space_zero()),
            ("cellBarred", u8::from(!mib.cell_barred)),
            (
                "intraFreqReselection",
                u8::from(!mib.intra_freq_reselection),
            ),
            ("spare", u8::from(mib.spare)),
        ];
        for (name, value) in set {
            let expected = if name == line[0] { number(line[1]) } else { 0 };
            assert_eq!(value, expected, "{name} of {}", line[0]);
        }
        assert_eq!(mib.bits(), packed(line[2], 24));
        fields += 1;
    }
    assert_eq!(fields, 9);
}
