//! Equality with reference vectors of independent encoders: exact for bits, within 1e-6 for
//! samples. The vectors are not part of the project, so that these tests run on demand
//! (`--include-ignored`); `golden.rs` contains the tests that run everywhere.

use crate::common::{self, Vectors, cells, pack};
use nr_ssb::burst::ssb_grid;
use nr_ssb::crc::crc24c;
use nr_ssb::dmrs::{dmrs, ibar_ssb};
use nr_ssb::grid::{dmrs_indices, pbch_indices, pss_indices, sss_indices};
use nr_ssb::payload::scramble;
use nr_ssb::polar;
use nr_ssb::pss::pss;
use nr_ssb::rate_matching::rate_match;
use nr_ssb::sss::sss;
use nr_ssb::{BchPayload, Beam, Burst, Case, Complex32, Gold, Lmax, Numerology, Ofdm, Pci};

fn assert_close(got: &[Complex32], expected: &[Complex32], what: &str) {
    assert_eq!(got.len(), expected.len(), "{what}");
    let pairs = got.iter().zip(expected);
    let worst = pairs.map(|(a, b)| (a - b).norm()).fold(0.0, f32::max);
    assert!(worst <= 1e-6, "{what}: off by {worst}");
}

#[test]
#[ignore = "needs the reference vectors (ACCESS_AV_DATA)"]
fn sequences_equal_the_reference_vectors() {
    let vectors = Vectors::open("sequences.npz");
    let as_i8 = |sequence: [f32; 127]| sequence.map(|x| x as i8);
    let as_i16 = |indices: &[usize]| indices.iter().map(|&i| i as i16).collect::<Vec<_>>();
    for (n_id_2, expected) in (0..).zip(vectors.array::<i8, _>("pss").chunks(127)) {
        assert_eq!(as_i8(pss(n_id_2)), expected);
    }
    assert_eq!(
        as_i16(&pss_indices().collect::<Vec<_>>()),
        vectors.array::<i16, _>("pss_index")
    );
    assert_eq!(
        as_i16(&sss_indices().collect::<Vec<_>>()),
        vectors.array::<i16, _>("sss_index")
    );

    let sss_all = vectors.array::<i8, _>("sss");
    let dmrs_all = vectors.array::<Complex32, _>("dmrs");
    let prbs_all = vectors.array::<u8, _>("pbch_prbs");
    let (dmrs_index, pbch_index) = (
        vectors.array::<i16, _>("dmrs_index"),
        vectors.array::<i16, _>("pbch_index"),
    );
    for (i, pci) in vectors.array::<i16, _>("pcis").into_iter().enumerate() {
        let pci = Pci::new(pci as u16).unwrap();
        assert_eq!(as_i8(sss(pci)), sss_all[127 * i..127 * (i + 1)]);
        assert_eq!(
            as_i16(dmrs_indices(pci)),
            dmrs_index[144 * i..144 * (i + 1)]
        );
        assert_eq!(
            as_i16(pbch_indices(pci)),
            pbch_index[432 * i..432 * (i + 1)]
        );
        for v in 0..8 {
            let row = 8 * i + v;
            assert_close(
                &dmrs(pci, v as u8),
                &dmrs_all[144 * row..144 * (row + 1)],
                "DM-RS",
            );
            let prbs: Vec<u8> = Gold::new(u32::from(pci.get()), 864 * v as u32)
                .take(864)
                .collect();
            assert_eq!(prbs, prbs_all[864 * row..864 * (row + 1)]);
        }
    }
}

#[test]
#[ignore = "needs the reference vectors (ACCESS_AV_DATA)"]
fn every_pbch_stage_equals_the_reference_vectors() {
    let vectors = Vectors::open("pbch.npz");
    let stage = |key, width: usize| -> Vec<Vec<u8>> {
        vectors
            .array::<u8, _>(key)
            .chunks(width)
            .map(<[u8]>::to_vec)
            .collect()
    };
    let (payloads, scrambled) = (stage("payload", 32), stage("payload_scrambled", 32));
    let (crcs, coded, matched) = (
        stage("crc24c", 24),
        stage("polar512", 512),
        stage("ratematched864", 864),
    );
    let ibar = vectors.array::<i32, _>("ibar_ssb");
    for (i, cell) in cells(&vectors).into_iter().enumerate() {
        let bits = cell.payload.bits(cell.lmax);
        assert_eq!(bits, pack(&payloads[i]), "case {i}: payload");
        let back = BchPayload::from_bits(bits, cell.payload.ssb_index, cell.lmax).unwrap();
        assert_eq!(back, cell.payload, "case {i}: payload read back");
        let a = scramble(bits, cell.pci, cell.lmax);
        assert_eq!(a, pack(&scrambled[i]), "case {i}: scrambled payload");
        assert_eq!(crc24c(a), pack(&crcs[i]), "case {i}: CRC");
        let codeword = polar::encode(u64::from(a) << 24 | u64::from(crc24c(a)));
        let natural: Vec<u8> = (0..512)
            .map(|n| (codeword[n / 64] >> (n % 64) & 1) as u8)
            .collect();
        assert_eq!(natural, coded[i], "case {i}: polar code");
        assert!(
            rate_match(&codeword).eq(matched[i].iter().copied()),
            "case {i}: rate matching"
        );
        let index = ibar_ssb(cell.lmax, cell.payload.ssb_index, cell.payload.half_frame);
        assert_eq!(i32::from(index), ibar[i], "case {i}: DM-RS index");
    }
}

#[test]
#[ignore = "needs the reference vectors (ACCESS_AV_DATA)"]
fn mib_fields_equal_the_reference_vectors() {
    let vectors = Vectors::open("pbch.npz");
    let fields: serde_json::Value = serde_json::from_str(&vectors.text("fields")).unwrap();
    for (cell, expected) in cells(&vectors).iter().zip(fields.as_array().unwrap()) {
        let mib = cell.payload.mib;
        let got = serde_json::json!({
            "choice": 0,
            "sfn": cell.payload.sfn(),
            "scs_common": mib.subcarrier_spacing_common as u8,
            "k_ssb": cell.payload.k_ssb(),
            "dmrs_typeA_pos": mib.dmrs_type_a_position as u8 + 2,
            "coreset0": mib.control_resource_set_zero(),
            "ss0": mib.search_space_zero(),
            "cell_barred": if mib.cell_barred { "barred" } else { "notBarred" },
            "intra_freq": if mib.intra_freq_reselection { "allowed" } else { "notAllowed" },
            "spare": u8::from(mib.spare),
            "hrf": u8::from(cell.payload.half_frame),
        });
        assert_eq!(&got, expected);
    }
}

#[test]
#[ignore = "needs the reference vectors (ACCESS_AV_DATA)"]
fn resource_grids_equal_the_reference_vectors() {
    for name in ["pbch.npz", "pbch_extra.npz"] {
        let vectors = Vectors::open(name);
        let grids = vectors.array::<Complex32, _>("grid");
        for (i, (cell, expected)) in cells(&vectors)
            .into_iter()
            .zip(grids.chunks(960))
            .enumerate()
        {
            let grid = ssb_grid(cell.pci, cell.lmax, &cell.payload).unwrap();
            // The axes of the file are k, l; l varies fastest.
            let got: Vec<_> = (0..960)
                .map(|n| grid.elements()[n / 4 + 240 * (n % 4)])
                .collect();
            assert_close(&got, expected, &format!("{name} case {i}"));
        }
    }
}

#[test]
#[ignore = "needs the reference vectors (ACCESS_AV_DATA)"]
fn k_ssb_equals_the_reference_vectors() {
    let vectors = Vectors::open("pbch_extra.npz");
    let expected = vectors.array::<i64, _>("k_ssb");
    for (cell, expected) in cells(&vectors).iter().zip(expected) {
        assert_eq!(i64::from(cell.payload.k_ssb()), expected);
    }
}

fn burst(cell: &common::Cell, case: Case, indices: impl IntoIterator<Item = u8>) -> Burst {
    Burst {
        pci: cell.pci,
        case,
        lmax: cell.lmax,
        payload: cell.payload,
        beams: indices.into_iter().map(Beam::new).collect(),
        ssb_freq_hz: None,
    }
}

fn iq(burst: &Burst) -> Vec<Complex32> {
    let numerology = Numerology::new(burst.case.spacing(), 256).unwrap();
    burst.iq(&mut Ofdm::new(numerology)).unwrap()
}

#[test]
#[ignore = "needs the reference vectors (ACCESS_AV_DATA)"]
fn modulated_bursts_at_15_khz_equal_the_reference_vectors() {
    let cases = Vectors::open("pbch.npz");
    let vectors = Vectors::open("burst15k_3p84Msps.npz");
    let cells = cells(&cases);
    for (i, cell) in cells.iter().enumerate().take(6) {
        let key = format!("x{i}");
        let one = burst(cell, Case::A, [cell.payload.ssb_index]);
        assert_close(&iq(&one), &vectors.array::<Complex32, _>(&key), &key);
    }
    let all = burst(&cells[2], Case::A, 0..4);
    let expected = vectors.array::<Complex32, _>("x_allbeams_L4_caseA");
    assert_close(&iq(&all), &expected, "all beams");

    let with_phase = Burst {
        ssb_freq_hz: Some(vectors.array::<f64, _>("f0_phase54")[0]),
        ..burst(&cells[2], Case::A, [cells[2].payload.ssb_index])
    };
    let expected = vectors.array::<Complex32, _>("x_case2_phase54");
    assert_close(&iq(&with_phase), &expected, "symbol phase");
}

#[test]
#[ignore = "needs the reference vectors (ACCESS_AV_DATA)"]
fn modulated_bursts_at_30_khz_equal_the_reference_vectors() {
    let cases = Vectors::open("pbch.npz");
    let vectors = Vectors::open("burst30k_7p68Msps.npz");
    let cell = &cells(&cases)[vectors.array::<i64, _>("base_case")[0] as usize];
    assert_eq!(cell.lmax, Lmax::L8);
    for (case, name) in [(Case::B, "B8"), (Case::C, "C8")] {
        let all = burst(cell, case, 0..8);
        let symbols: Vec<i64> = all
            .grids()
            .unwrap()
            .iter()
            .map(|(symbol, _)| *symbol as i64)
            .collect();
        assert_eq!(symbols, vectors.array::<i64, _>(&format!("sym_{name}")));
        let key = format!("x_allbeams_{name}");
        assert_close(&iq(&all), &vectors.array::<Complex32, _>(&key), &key);
    }
}
