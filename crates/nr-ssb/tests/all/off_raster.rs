//! SSBs off the synchronization raster, and recordings without a centre frequency.

use crate::air;
use crate::recordings;
use nr_ssb::SubcarrierSpacing;
use nr_ssb::raster::{RasterFind, scan, scan_off_raster, scan_raster};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

const RATE_HZ: f64 = 15.36e6;

/// Returns a recording of 3 ms with one SSB `offset_hz` off its centre at 0 dB, and its cell.
fn off_raster(
    spacing: SubcarrierSpacing,
    offset_hz: f64,
    seed: u64,
) -> (air::Cell, Vec<Vec<nr_ssb::Complex32>>) {
    let mut rng = air::rng(seed);
    let mut cell = air::Cell::random(&mut rng, spacing, 1);
    cell.ssb_freq_hz += 135e3;
    cell.ssb_indices = vec![1];
    cell.delay = 200.3;
    cell.cfo_hz *= 0.5;
    (cell.clone(), on_the_air(&cell, offset_hz, 0.0, &mut rng))
}

/// Returns 3 ms of the cell on one antenna, with SSBs `offset_hz` from the centre of the recording.
fn on_the_air(
    cell: &air::Cell,
    offset_hz: f64,
    snr_db: f64,
    rng: &mut ChaCha8Rng,
) -> Vec<Vec<nr_ssb::Complex32>> {
    let spacing = cell.spacing;
    let mut samples = air::silence(1, (3e-3 * spacing.base_rate_hz()) as usize);
    cell.add_to(&mut samples);
    let factor = (RATE_HZ / spacing.base_rate_hz()) as usize;
    let mut raised = vec![air::raised(&samples[0], factor, offset_hz / RATE_HZ)];
    // `raised` keeps amplitudes, so that noise of the same density is stronger.
    air::add_noise(&mut raised, snr_db - 10.0 * (factor as f64).log10(), rng);
    raised
}

#[test]
fn an_ssb_between_the_raster_points_is_found() {
    for (spacing, offset_hz, seed) in [
        (SubcarrierSpacing::Khz15, 15e3 * 373.0, 1),
        (SubcarrierSpacing::Khz15, -15e3 * 391.0, 2),
        (SubcarrierSpacing::Khz30, 15e3 * 55.0, 3),
        (SubcarrierSpacing::Khz30, -15e3 * 262.0, 4),
    ] {
        let (cell, samples) = off_raster(spacing, offset_hz, seed);
        let slices = air::slices(&samples);
        let centre_hz = cell.ssb_freq_hz - offset_hz;
        assert!(scan_raster(&slices, RATE_HZ, centre_hz).unwrap().is_empty());
        for centre_hz in [Some(centre_hz), None] {
            let finds = scan(&slices, RATE_HZ, centre_hz).unwrap();
            assert_eq!(finds.len(), 1);
            let find = &finds[0];
            assert_eq!((find.spacing, find.point.gscn), (spacing, None));
            assert_eq!(find.ssbs.len(), 1);
            let ssb = &find.ssbs[0];
            assert_eq!((ssb.pci.get(), ssb.ssb_index), (cell.pci, 1));
            assert_eq!(ssb.payload.unwrap().sfn(), cell.sfn);
            let found_hz = find.point.ssb_freq_hz - centre_hz.unwrap_or(0.0);
            assert!((found_hz - offset_hz).abs() < 1.0, "{found_hz}");
            // At 0 dB, the phase between PSS and SSS has σ = 0.09 rad over two symbols, 0.7 % of a
            // subcarrier. Without the centre frequency, only the halves of the PSS are usable, with
            // 4 %.
            let tolerance = if centre_hz.is_some() { 0.035 } else { 0.2 };
            let error_hz = ssb.cfo_hz - cell.cfo_hz;
            assert!(error_hz.abs() < tolerance * spacing.hz(), "{error_hz}");
        }
    }
}

/// The centre of a recording may be any frequency. At 50 dB, noise changes the frequency offset by
/// less than 1 Hz, so that the error is that of the method.
#[test]
fn a_centre_off_all_rasters_gives_correct_frequency_and_offset() {
    use SubcarrierSpacing::{Khz15, Khz30};
    let mut rng = air::rng(5);
    // On the synchronization raster (the first of each band), and 5, 10 kHz or 15 kHz next to it.
    for (spacing, ssb_freq_hz, centre_off_hz, cfo_ppm) in [
        (Khz15, 2_100.05e6, 4.3e3, 0.9),
        (Khz15, 2_100.05e6, 7.0e3, -1.8),
        (Khz15, 2_100.235e6, 4.3e3, -1.1),
        (Khz15, 2_100.240e6, 7.0e3, 1.9),
        (Khz30, 2_100.245e6, -4.3e3, 1.5),
        (Khz15, 3_600.96e6, 7.0e3, 1.0),
        (Khz30, 3_600.0e6, 4.3e3, 2.0),
        (Khz30, 3_600.135e6, 7.0e3, -2.0),
        (Khz30, 3_600.150e6, 4.3e3, 1.0),
        (Khz15, 3_600.165e6, 7.0e3, 1.7),
        // On no raster at all.
        (Khz15, 3_500.0e6, 0.0, 0.6),
        (Khz30, 3_500.0e6, 4.3e3, -0.8),
    ] {
        let mut cell = air::Cell::random(&mut rng, spacing, 1);
        cell.ssb_freq_hz = ssb_freq_hz;
        cell.ssb_indices = vec![1];
        cell.delay = 200.3;
        cell.cfo_hz = 1e-6 * cfo_ppm * ssb_freq_hz;
        let offset_hz = 1.5e6 + centre_off_hz;
        let centre_hz = ssb_freq_hz - offset_hz;
        let samples = on_the_air(&cell, offset_hz, 50.0, &mut rng);
        let finds = scan(&air::slices(&samples), RATE_HZ, Some(centre_hz)).unwrap();
        let find = &finds[0];
        let found_hz = find.point.ssb_freq_hz;
        let cfo_hz = find.ssbs[0].cfo_hz;
        println!("{ssb_freq_hz} {}: {found_hz} {cfo_hz}", cell.cfo_hz);
        assert_eq!((finds.len(), find.spacing), (1, spacing));
        assert!((found_hz - ssb_freq_hz).abs() < 0.1, "{found_hz}");
        assert!((cfo_hz - cell.cfo_hz).abs() < 20.0, "{cfo_hz}");
    }
}

/// With an offset far above the spacing of the raster, the cell is still detected, at a frequency
/// whose phases between symbols agree with the received ones.
#[test]
fn a_cell_with_an_oscillator_error_of_20_ppm_is_detected() {
    let mut rng = air::rng(6);
    for spacing in [SubcarrierSpacing::Khz15, SubcarrierSpacing::Khz30] {
        for ssb_freq_hz in [3_600.96e6, 3_625.175e6, 3_465.626e6, 3_615.599e6] {
            for cfo_ppm in [-20.0, -5.0, 20.0] {
                let mut cell = air::Cell::random(&mut rng, spacing, 1);
                (cell.ssb_freq_hz, cell.ssb_indices) = (ssb_freq_hz, vec![1]);
                cell.delay = 200.3;
                cell.cfo_hz = 1e-6 * cfo_ppm * ssb_freq_hz;
                let samples = on_the_air(&cell, 1.5e6, 10.0, &mut rng);
                for centre_hz in [Some(ssb_freq_hz - 1.5e6), None] {
                    let what = format!("{spacing:?} {ssb_freq_hz} {cfo_ppm} {centre_hz:?}");
                    let finds = scan(&air::slices(&samples), RATE_HZ, centre_hz).unwrap();
                    // An SSB that is not decoded may be noise, in one of a thousand recordings of
                    // 20 ms.
                    let decoded = |find: &&RasterFind| find.ssbs[0].payload.is_some();
                    let decoded: Vec<_> = finds.iter().filter(decoded).collect();
                    assert_eq!(decoded.len(), 1, "{what}");
                    let ssb = &decoded[0].ssbs[0];
                    assert_eq!((ssb.pci.get(), ssb.ssb_index), (cell.pci, 1), "{what}");
                    assert_eq!(ssb.payload.unwrap().sfn(), cell.sfn, "{what}");
                    assert!((ssb.snr_db - 10.0).abs() < 1.0, "{what}: {} dB", ssb.snr_db);
                    let received_hz = decoded[0].point.ssb_freq_hz + ssb.cfo_hz;
                    let transmitted_hz = 1.5e6 + centre_hz.unwrap_or(0.0) + cell.cfo_hz;
                    let error_hz = received_hz - transmitted_hz;
                    assert!(error_hz.abs() < 0.1 * spacing.hz(), "{what}: {error_hz}");
                }
            }
        }
    }
}

/// Frequency-shifted PSS and SSS resemble those of another cell. On the raster, such a ghost may be
/// detected before the cell.
#[test]
fn a_cell_off_the_raster_does_not_mask_cells_on_it() {
    for seed in 1020..1040 {
        let (cell, samples) = off_raster(SubcarrierSpacing::Khz30, 15e3 * 55.0, seed);
        let centre_hz = cell.ssb_freq_hz - 15e3 * 55.0;
        let finds = scan(&air::slices(&samples), RATE_HZ, Some(centre_hz)).unwrap();
        let pcis: Vec<_> = finds.iter().map(|find| find.ssbs[0].pci.get()).collect();
        assert_eq!(pcis, [cell.pci], "seed {seed}");
    }
}

/// A strong cell on the raster does not prevent the detection of a cell off the raster that is 20
/// dB weaker, for any subcarrier spacings.
#[test]
fn a_weak_cell_off_the_raster_is_found_next_to_a_strong_one_on_it() {
    use SubcarrierSpacing::{Khz15, Khz30};
    let mut rng = air::rng(77);
    for spacings in [[Khz30, Khz30], [Khz30, Khz15], [Khz15, Khz30]] {
        let centre_hz = 3_700.8e6;
        let cells = [
            (centre_hz - 1.44e6, 20.0, 0.05e-3),
            (centre_hz + 3.075e6, 0.0, 1.5e-3),
        ];
        let mut received = vec![vec![nr_ssb::Complex32::ZERO; 46_080]];
        let mut sent = Vec::new();
        for (spacing, (ssb_freq_hz, snr_db, delay_s)) in spacings.into_iter().zip(cells) {
            let mut cell = air::Cell::random(&mut rng, spacing, 1);
            cell.ssb_freq_hz = ssb_freq_hz;
            cell.ssb_indices = vec![1];
            cell.delay = delay_s * spacing.base_rate_hz() + 0.3;
            cell.cfo_hz = 1e-6 * ssb_freq_hz;
            let samples = on_the_air(&cell, ssb_freq_hz - centre_hz, f64::INFINITY, &mut rng);
            // A resource element of 30 kHz collects twice the noise of one of 15 kHz.
            let width_db = 10.0 * (spacing.hz() / 30e3).log10();
            let amplitude = 10f64.powf(0.05 * (snr_db + width_db)) as f32;
            for (sum, x) in received[0].iter_mut().zip(&samples[0]) {
                *sum += x * amplitude;
            }
            sent.push((spacing, ssb_freq_hz, cell.pci));
        }
        air::add_noise(&mut received, -3.0, &mut rng);
        let finds = scan(&air::slices(&received), RATE_HZ, Some(centre_hz)).unwrap();
        let found: Vec<_> = finds
            .iter()
            .map(|it| (it.spacing, it.point.ssb_freq_hz, it.ssbs[0].pci.get()))
            .collect();
        assert_eq!(found, sent);
    }
}

/// Detection limits of a cell on and off the raster, with one SSB in 3 ms on one antenna.
#[test]
fn detection_limits_on_and_off_the_raster_are_similar() {
    let (trials, snr_db) = (25, -4.0);
    let mut found = [0; 2];
    for trial in 0..trials {
        let mut rng = air::rng(4000 + trial);
        let mut cell = air::Cell::random(&mut rng, SubcarrierSpacing::Khz30, 1);
        cell.lmax = nr_ssb::Lmax::L8;
        cell.ssb_indices = vec![1];
        cell.delay = 200.0 + rng.random_range(0.0..1000.0);
        // Oscillators of base station and receiver within 2 ppm.
        cell.cfo_hz = rng.random_range(-7e3..7e3);
        for (place, found) in [3_600.96e6, 3_600.675e6].into_iter().zip(&mut found) {
            cell.ssb_freq_hz = place;
            let offset_hz = 15e3 * 55.0;
            let samples = on_the_air(&cell, offset_hz, snr_db, &mut rng);
            let slices = air::slices(&samples);
            let finds = scan(&slices, RATE_HZ, Some(place - offset_hz)).unwrap();
            let mut ssbs = finds.iter().flat_map(|it| &it.ssbs);
            *found += u32::from(ssbs.any(|it| it.pci.get() == cell.pci));
        }
    }
    let [on, off] = found;
    println!("{snr_db} dB: {on} of {trials} on the raster, {off} off it");
    assert!(found.iter().all(|found| *found >= 22), "{found:?}");
}

#[test]
fn noise_contains_no_cell_at_any_frequency() {
    let mut samples = air::silence(2, 46_080);
    air::add_noise(&mut samples, 0.0, &mut air::rng(9));
    let finds = scan(&air::slices(&samples), RATE_HZ, Some(3.5e9)).unwrap();
    assert!(finds.is_empty());
}

#[test]
fn a_band_narrower_than_an_ssb_contains_no_cell() {
    let samples = air::silence(1, 10_000);
    let finds = scan_off_raster(&air::slices(&samples), 1.92e6, None, &[]).unwrap();
    assert!(finds.is_empty());
}

#[test]
#[ignore = "needs the recordings (ACCESS_AV_DATA)"]
fn recordings_without_centre_frequency_give_equal_cells() {
    for recording in recordings::annotated() {
        let name = &recording.name;
        let first = &recording.annotations[0];
        // Use 2 ms around the first SSB, because the duration of a scan increases with the
        // recording.
        let start = first["core:sample_start"].as_u64().unwrap() as usize;
        let margin = (1e-3 * recording.rate_hz) as usize;
        let antennas = recording.antennas();
        let part: Vec<_> = antennas
            .iter()
            .map(|x| &x[start.saturating_sub(margin)..(start + margin).min(x.len())])
            .take(1)
            .collect();
        let finds = scan(&part, recording.rate_hz, None).unwrap();
        let truth = &first["nr:ssb"];
        let number = |key: &str| truth[key].as_f64().unwrap();
        let find = &finds[0];
        assert_eq!(finds.len(), 1, "{name}");
        assert_eq!(find.spacing.hz(), number("scs_hz"), "{name}");
        let ssb = find
            .ssbs
            .iter()
            .max_by(|a, b| a.snr_db.total_cmp(&b.snr_db))
            .unwrap();
        let offset_hz = number("ssb_freq_hz") - recording.centre_hz;
        let found_hz = find.point.ssb_freq_hz + ssb.cfo_hz;
        assert!(
            (found_hz - offset_hz).abs() < 0.02 * find.spacing.hz(),
            "{name}: {found_hz}"
        );
        assert_eq!(f64::from(ssb.pci.get()), number("pci"), "{name}");
        assert_eq!(f64::from(ssb.ssb_index), number("ssb_index"), "{name}");
        let payload = ssb.payload.unwrap();
        assert_eq!(f64::from(payload.sfn()), number("sfn"), "{name}");
        assert_eq!(
            payload.mib.bit_string(),
            truth["mib_bits_24"].as_str().unwrap(),
            "{name}"
        );
        // With a known centre, the frequency is accurate to 1 Hz.
        let finds =
            scan_off_raster(&part, recording.rate_hz, Some(recording.centre_hz), &[]).unwrap();
        let found_hz = finds[0].point.ssb_freq_hz;
        assert!(
            (found_hz - number("ssb_freq_hz")).abs() < 1.0,
            "{name}: {found_hz}"
        );
    }
}
