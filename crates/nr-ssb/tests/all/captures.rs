//! Real recordings: the raster point, the spacing and every cell that independent receivers found.

use crate::recordings;
use nr_ssb::raster::scan;
use nr_ssb::search::DetectedSsb;
use serde_json::Value;

/// Maximum difference from the recordings' annotations, in Hz.
const CFO_TOLERANCE_HZ: f64 = 20.0;

#[test]
#[ignore = "needs the recordings (ACCESS_AV_DATA)"]
fn every_annotated_ssb_is_found_by_a_blind_search() {
    for recording in recordings::annotated() {
        let name = &recording.name;
        let finds = scan(
            &recording.antennas(),
            recording.rate_hz,
            Some(recording.centre_hz),
        )
        .unwrap();
        let places: Vec<_> = finds.iter().map(|it| (it.point, &it.ssbs)).collect();
        assert_eq!(
            finds.len(),
            1,
            "{name}: one raster point holds cells: {places:?}"
        );
        let find = &finds[0];
        for annotation in &recording.annotations {
            let truth = &annotation["nr:ssb"];
            let number = |key: &str| truth[key].as_f64().unwrap();
            assert_eq!(find.spacing.hz(), number("scs_hz"), "{name}");
            assert!(
                (find.point.ssb_freq_hz - number("ssb_freq_hz")).abs() < 1.0,
                "{name}"
            );
            let start = annotation["core:sample_start"].as_f64().unwrap();
            let ssb = find
                .ssbs
                .iter()
                .find(|ssb| (ssb.sample_start * find.input_per_output - start).abs() < 6.0)
                .unwrap_or_else(|| panic!("{name}: nothing at {start}"));
            assert_eq!(f64::from(ssb.pci.get()), number("pci"), "{name}");
            assert_eq!(f64::from(ssb.ssb_index), number("ssb_index"), "{name}");
            assert_eq!(
                f64::from(ssb.lmax.unwrap().count()),
                number("lmax"),
                "{name}"
            );
            let payload = ssb
                .payload
                .unwrap_or_else(|| panic!("{name}: PBCH not decoded"));
            assert_eq!(f64::from(payload.sfn()), number("sfn"), "{name}");
            assert_eq!(
                f64::from(u8::from(payload.half_frame)),
                number("half_frame"),
                "{name}"
            );
            assert_eq!(
                payload.mib.bit_string(),
                truth["mib_bits_24"].as_str().unwrap(),
                "{name}"
            );
            if let Some(cfo_hz) = truth["cfo_hz"].as_f64() {
                assert!(
                    (ssb.cfo_hz - cfo_hz).abs() < CFO_TOLERANCE_HZ,
                    "{name}: {}",
                    ssb.cfo_hz
                );
            }
        }
        weaker_cells_belong_to_the_network(name, &recording.annotations, &find.ssbs);
    }
}

/// Asserts that weaker cells are cells of the same network. A recording of an operator contains
/// weaker cells in addition to the annotated one. A false cell would have another time or message
/// than the network.
fn weaker_cells_belong_to_the_network(name: &str, annotations: &[Value], ssbs: &[DetectedSsb]) {
    let strong = ssbs.iter().filter(|ssb| ssb.snr_db > 0.0).count();
    assert_eq!(strong, annotations.len(), "{name}");
    let mut messages: Vec<_> = ssbs
        .iter()
        .filter_map(|ssb| ssb.payload)
        .map(|p| (p.sfn(), p.mib))
        .collect();
    messages.dedup();
    assert_eq!(messages.len(), 1, "{name}");
    assert!(ssbs.iter().all(|ssb| ssb.cfo_hz.abs() < 500.0), "{name}");
}
