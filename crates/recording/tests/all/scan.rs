//! Scans of real recordings and of every kind of unsuitable recording.

use crate::common;
use nr_ssb::diagnose::Fault;
use nr_ssb::{BchPayload, Beam, Burst, Case, Lmax, Mib, Numerology, Ofdm, Pci, SubcarrierSpacing};
use num_complex::{Complex32, Complex64};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use recording::Recording;
use recording::scan::{
    ArraySetup, ChannelFault, SampleBlock, ScanError, ScanSettings, ScannedSsb, SsbSearch,
    SsbSearchConfig, scan,
};
use serde_json::Value;

const SSB_HZ: f64 = 3_700.8e6;
const RATE_HZ: f64 = 7.68e6;

/// Returns the transmitted samples of a cell in 5 ms.
fn burst(pci: u16, ssb_index: u8) -> Vec<Complex32> {
    let burst = Burst {
        pci: Pci::new(pci).unwrap(),
        case: Case::C,
        lmax: Lmax::L8,
        payload: BchPayload::new(Mib::default(), 12, false, 0).unwrap(),
        beams: vec![Beam::new(ssb_index)],
        ssb_freq_hz: Some(SSB_HZ),
    };
    let numerology = Numerology::from_sample_rate(Case::C.spacing(), RATE_HZ).unwrap();
    burst.iq(&mut Ofdm::new(numerology)).unwrap()
}

/// Returns the noise of four antennas; `snr_db` is the SNR of a resource element of amplitude one.
fn noise(samples: usize, snr_db: f64, rng: &mut ChaCha8Rng) -> Vec<Vec<Complex32>> {
    // A resource element contains the noise of 256 samples.
    let sigma = (0.5 * 10f64.powf(-0.1 * snr_db) / 256.0).sqrt();
    let mut part = || (sigma * rng.sample::<f64, _>(StandardNormal)) as f32;
    (0..4)
        .map(|_| {
            (0..samples)
                .map(|_| Complex32::new(part(), part()))
                .collect()
        })
        .collect()
}

/// Adds a plane wave of the given electrical angle, starting at sample `start`.
fn add(
    antennas: &mut [Vec<Complex32>],
    wave: &[Complex32],
    gain: Complex64,
    phase_rad: f64,
    start: usize,
) {
    for (number, antenna) in antennas.iter_mut().enumerate() {
        let turn = gain * Complex64::cis(phase_rad * number as f64);
        let turn = Complex32::new(turn.re as f32, turn.im as f32);
        for (to, sample) in antenna.iter_mut().skip(start).zip(wave) {
            *to += sample * turn;
        }
    }
}

/// Returns 5 ms of four antennas with an SSB from the given electrical angle at 20 dB per resource
/// element.
fn half_frame(phase_rad: f64, seed: u64) -> Vec<Vec<Complex32>> {
    let sent = burst(7, 2);
    let mut antennas = noise(sent.len(), 20.0, &mut ChaCha8Rng::seed_from_u64(seed));
    add(&mut antennas, &sent, Complex64::ONE, phase_rad, 0);
    antennas
}

fn block(antennas: &[Vec<Complex32>]) -> SampleBlock<'_> {
    SampleBlock {
        antennas: antennas.iter().map(Vec::as_slice).collect(),
        sample_rate_hz: RATE_HZ,
        centre_frequency_hz: Some(SSB_HZ),
    }
}

fn known() -> ScanSettings {
    ScanSettings {
        ssb_freq_hz: Some(SSB_HZ),
        ..ScanSettings::default()
    }
}

#[test]
fn a_generated_burst_is_found_with_its_angle() {
    let antennas = half_frame(0.7, 1);
    let found = scan(&mut block(&antennas), &known()).unwrap();
    assert_eq!((found.ssbs.len(), found.faults.len()), (1, 0));
    let ScannedSsb {
        ssb,
        sample_start,
        angle,
        ..
    } = &found.ssbs[0];
    assert_eq!(
        (ssb.pci.get(), ssb.ssb_index, ssb.payload.unwrap().sfn()),
        (7, 2, 12)
    );
    let numerology = Numerology::from_sample_rate(Case::C.spacing(), RATE_HZ).unwrap();
    let symbol = Case::C.start_symbol(2).unwrap();
    assert!((sample_start - numerology.symbol_start(symbol) as f64).abs() < 0.2);
    let angle = angle.unwrap().from_row().unwrap();
    assert!((angle.phase_rad - 0.7).abs() < 5.0 * angle.phase_sigma_rad);
    // Bound for 20 dB and 830 elements: sigma = 1 / sqrt(2 * 830 * 100 * 5).
    assert!((angle.phase_sigma_rad * (2.0 * 830.0 * 100.0 * 5.0_f64).sqrt() - 1.0).abs() < 0.15);
}

#[test]
fn weaker_cells_have_angles_with_consistent_standard_deviations() {
    let config = SsbSearchConfig::new(RATE_HZ, SSB_HZ, SSB_HZ, Case::C.spacing(), 4);
    let mut search = SsbSearch::new(config).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let trials = 60;
    // Two weaker cells on the same symbols as the first: one with a different PSS, one with an
    // equal PSS.
    let cells = [(7, 0.7, 1.0), (302, -1.9, 0.1), (610, 2.4, 0.15)];
    let sent = cells.map(|(pci, ..)| burst(pci, 2));
    let mut squares = [0.0; 3];
    for trial in 0..trials {
        // The weaker cells have 5 and 8.5 dB.
        let mut antennas = noise(sent[0].len() + 200, 25.0, &mut rng);
        for ((_, phase_rad, amplitude), wave) in cells.iter().zip(&sent) {
            let gain = Complex64::from_polar(*amplitude, 6.2 * rng.random::<f64>());
            // Cells of a network arrive within about one cyclic prefix.
            let start = 100 + rng.random_range(0..40);
            add(&mut antennas, wave, gain, *phase_rad, start);
        }
        let slices: Vec<&[Complex32]> = antennas.iter().map(Vec::as_slice).collect();
        let found = search.search(&slices).unwrap();
        assert_eq!(found.len(), cells.len(), "trial {trial}");
        for ((pci, phase_rad, _), square) in cells.iter().zip(&mut squares) {
            let cell = found.iter().find(|it| it.ssb.pci.get() == *pci).unwrap();
            let angle = cell.angle.unwrap().from_row().unwrap();
            assert!(angle.is_resolved(), "trial {trial}: {pci} {angle:?}");
            *square += ((angle.phase_rad - phase_rad) / angle.phase_sigma_rad).powi(2);
        }
    }
    // The mean square of n Gaussian errors has a relative standard deviation of √(2/n). The limit
    // is four of them.
    let bound = 4.0 * (2.0 / f64::from(trials)).sqrt();
    for ((pci, ..), square) in cells.iter().zip(squares) {
        let mean = square / f64::from(trials);
        println!("cell {pci}: normalised error variance {mean:.2}");
        assert!((mean - 1.0).abs() < bound, "{pci}: {mean}");
    }
}

/// Returns the faults of a scan of four channels after a modification.
fn faults_of(spoil: impl FnOnce(&mut Vec<Vec<Complex32>>)) -> Vec<ChannelFault> {
    let mut antennas = half_frame(1.4, 2);
    spoil(&mut antennas);
    let found = scan(&mut block(&antennas), &known()).unwrap();
    assert_eq!(found.ssbs.len(), 1, "the other channels receive the cell");
    found.faults
}

/// Returns the channel and fault if there is exactly one fault of the samples.
fn only(faults: &[ChannelFault]) -> Option<(usize, Fault)> {
    match faults {
        [ChannelFault::Samples { channel, fault }] => Some((*channel, *fault)),
        _ => None,
    }
}

#[test]
fn healthy_channels_have_no_faults() {
    assert_eq!(faults_of(|_| ()), []);
}

#[test]
fn exchanged_channels_are_detected_by_their_phases() {
    for (first, second) in [(0, 1), (1, 2), (2, 3)] {
        let faults = faults_of(|antennas| antennas.swap(first, second));
        assert_eq!(faults, [ChannelFault::Exchanged { first, second }]);
    }
}

#[test]
fn a_silent_channel_is_reported() {
    let faults = faults_of(|antennas| antennas[3].fill(Complex32::ZERO));
    assert_eq!(only(&faults), Some((3, Fault::Silent)));
}

#[test]
fn a_weak_channel_is_reported_with_its_level() {
    // 46 dB correspond to a disconnected cable.
    let weaken = |antenna: &mut Vec<Complex32>| antenna.iter_mut().for_each(|x| *x *= 0.005);
    let faults = faults_of(|antennas| weaken(&mut antennas[1]));
    let Some((1, Fault::Weak { below_strongest_db })) = only(&faults) else {
        panic!("{faults:?}")
    };
    assert!(
        (below_strongest_db - 46.02).abs() < 0.5,
        "{below_strongest_db}"
    );
    assert!(
        faults[0].to_string().contains("channel 1 is 46 dB below"),
        "{}",
        faults[0]
    );
    // 20 dB correspond to an antenna in the opposite direction.
    let faults = faults_of(|antennas| antennas[1].iter_mut().for_each(|x| *x *= 0.1));
    assert_eq!(faults, []);
}

#[test]
fn a_clipped_channel_is_reported_with_its_fraction() {
    let limit = 0.05;
    let mut share_beyond = 0.0;
    let faults = faults_of(|antennas| {
        let beyond = |x: &Complex32| x.re.abs() >= limit || x.im.abs() >= limit;
        let count = antennas[0].iter().filter(|x| beyond(x)).count();
        share_beyond = count as f64 / antennas[0].len() as f64;
        for x in &mut antennas[0] {
            *x = Complex32::new(x.re.clamp(-limit, limit), x.im.clamp(-limit, limit));
        }
    });
    let Some((0, Fault::Clipped { share })) = only(&faults) else {
        panic!("{faults:?}")
    };
    // All samples beyond full scale, except the few that any recording has.
    assert!(
        (share / share_beyond - 1.0).abs() < 0.05,
        "{share} {share_beyond}"
    );
}

#[test]
fn a_duplicated_channel_is_reported_with_its_original() {
    let faults = faults_of(|antennas| antennas[2] = antennas[0].clone());
    assert!(
        faults.contains(&ChannelFault::Samples {
            channel: 2,
            fault: Fault::Duplicate { of: 0 }
        }),
        "{faults:?}"
    );
    assert!(
        faults[0].to_string().contains("same samples as channel 0"),
        "{}",
        faults[0]
    );
}

#[test]
fn a_cell_off_the_raster_is_found_at_the_centre_frequency() {
    let antennas = half_frame(0.3, 8);
    let mut source = block(&antennas);
    // 3700.8 MHz is not on the raster 3 GHz + N · 1.44 MHz.
    source.centre_frequency_hz = Some(SSB_HZ);
    let found = scan(&mut source, &ScanSettings::default()).unwrap();
    assert_eq!((found.ssbs.len(), found.ssbs[0].ssb.pci.get()), (1, 7));
}

#[test]
fn a_poor_oscillator_is_found_with_a_sufficient_search_range() {
    // 20 ppm of 3.7 GHz are two and a half subcarriers.
    for ppm in [-20.0, -8.0, 8.0, 20.0] {
        let mut antennas = half_frame(0.3, 12);
        let step = std::f64::consts::TAU * 1e-6 * ppm * SSB_HZ / RATE_HZ;
        for (n, x) in antennas.iter_mut().flat_map(|it| it.iter_mut().enumerate()) {
            let turn = Complex64::cis(step * n as f64);
            *x *= Complex32::new(turn.re as f32, turn.im as f32);
        }
        let allowed = ScanSettings {
            cfo_ppm: Some(20.0),
            ..known()
        };
        let found = scan(&mut block(&antennas), &allowed).unwrap();
        assert_eq!(found.ssbs.len(), 1, "{ppm}");
        assert!((found.ssbs[0].ssb.cfo_hz - 1e-6 * ppm * SSB_HZ).abs() < 50.0);
        assert!(found.ssbs[0].ssb.payload.is_some());
        let found = scan(&mut block(&antennas), &known()).unwrap();
        assert!(found.ssbs.is_empty(), "{ppm}");
    }
    let beyond = ScanSettings {
        cfo_ppm: Some(50.0),
        ..known()
    };
    let error = scan(&mut block(&half_frame(0.3, 12)), &beyond).unwrap_err();
    assert!(error.to_string().contains("5 subcarriers"), "{error}");
}

#[test]
fn a_scan_reports_its_scope() {
    let antennas = noise(38_400, 20.0, &mut ChaCha8Rng::seed_from_u64(3));
    let mut source = block(&antennas);
    source.centre_frequency_hz = Some(3_699.84e6);
    let scopes = |found: recording::scan::Scan| -> Vec<String> {
        assert!(found.ssbs.is_empty());
        found.searched.iter().map(ToString::to_string).collect()
    };
    let found = scan(&mut source, &ScanSettings::default()).unwrap();
    assert_eq!(
        scopes(found),
        [
            "15 kHz spacing, 3 points of the synchronization raster, the first 5 ms of 4 channels",
            "15 kHz spacing, any frequency from 3697.800 to 3701.880 MHz, the first 5 ms of 1 channel",
            "30 kHz spacing, 1 point of the synchronization raster, the first 5 ms of 4 channels",
            "30 kHz spacing, any frequency from 3699.600 to 3700.080 MHz, the first 5 ms of 1 channel",
        ]
    );
    let settings = ScanSettings {
        spacing: Some(SubcarrierSpacing::Khz30),
        ..known()
    };
    let found = scan(&mut block(&antennas), &settings).unwrap();
    assert_eq!(
        scopes(found),
        ["30 kHz spacing, SSB at 3700.800 MHz ± 15.0 kHz, the first 5 ms of 4 channels"]
    );
}

#[test]
fn unsuitable_recordings_are_rejected_with_a_reason() {
    let antennas = half_frame(0.0, 5);
    let mut source = block(&antennas);
    source.centre_frequency_hz = None;
    let error = scan(&mut source, &known()).unwrap_err();
    assert!(matches!(error, ScanError::NoCentreFrequency { .. }));

    let mut source = block(&antennas);
    source.sample_rate_hz = 5.123_457e6;
    let error = scan(&mut source, &known()).unwrap_err();
    assert!(error.to_string().contains("a fraction of it"), "{error}");

    let far = ScanSettings {
        ssb_freq_hz: Some(SSB_HZ + 3e6),
        ..known()
    };
    assert!(matches!(
        scan(&mut block(&antennas), &far),
        Err(ScanError::FrontEnd { .. })
    ));

    let short: Vec<_> = antennas
        .iter()
        .map(|samples| samples[..500].to_vec())
        .collect();
    for settings in [known(), ScanSettings::default()] {
        let error = scan(&mut block(&short), &settings).unwrap_err();
        assert!(matches!(error, ScanError::Search { .. }), "{error}");
    }

    let array = ArraySetup {
        calibration: Some(vec![Complex64::ONE; 3]),
        ..ArraySetup::default()
    };
    let error = scan(&mut block(&antennas), &ScanSettings { array, ..known() }).unwrap_err();
    assert!(matches!(error, ScanError::Array(_)));

    let mut corrupted = antennas.clone();
    corrupted[2][77].im = f32::NAN;
    let error = scan(&mut block(&corrupted), &known()).unwrap_err();
    assert!(
        error.to_string().contains("sample 77 of channel 2"),
        "{error}"
    );
}

#[test]
fn every_annotated_recording_is_scanned_without_prior_knowledge() {
    let Some(dir) = common::data_dir() else {
        return;
    };
    for entry in std::fs::read_dir(dir.join("captures")).unwrap() {
        let path = entry.unwrap().path();
        if path
            .extension()
            .is_none_or(|extension| extension != "sigmf-meta")
        {
            continue;
        }
        let name = path.file_stem().unwrap().to_string_lossy().into_owned();
        let mut recording = Recording::open(&path).unwrap();
        let annotations = recording.annotations().to_vec();
        if !annotations
            .iter()
            .any(|annotation| annotation.other.contains_key("nr:ssb"))
        {
            continue;
        }
        let found = scan(&mut recording, &ScanSettings::default()).unwrap();
        for annotation in &annotations {
            let truth = &annotation.other["nr:ssb"];
            let near = |found: &&ScannedSsb| {
                // At 46.08 Msps, the annotation has the resolution of the base rate.
                (found.sample_start - annotation.sample_start as f64).abs() < 6.0
            };
            let found = found
                .ssbs
                .iter()
                .find(near)
                .unwrap_or_else(|| panic!("{name}"));
            let payload = found
                .ssb
                .payload
                .unwrap_or_else(|| panic!("{name}: no payload"));
            assert_eq!(truth["pci"], found.ssb.pci.get(), "{name}");
            assert_eq!(truth["ssb_index"], found.ssb.ssb_index, "{name}");
            assert_eq!(truth["sfn"], payload.sfn(), "{name}");
            assert_eq!(truth["mib_bits_24"], payload.mib.bit_string(), "{name}");
            assert_eq!(
                truth["ssb_freq_hz"].as_f64(),
                Some(found.ssb_freq_hz),
                "{name}"
            );
            assert!((found.sample_count - annotation.sample_count.unwrap() as f64).abs() < 1.0);
        }
    }
}

/// Returns the channel gains of the annotation; only their phases matter.
fn calibration(truth: &Value) -> Vec<Complex64> {
    let part = |key: &str| -> Vec<f64> {
        truth[key]
            .as_array()
            .unwrap()
            .iter()
            .map(|value| value.as_f64().unwrap())
            .collect()
    };
    part("channel_calibration_re")
        .into_iter()
        .zip(part("channel_calibration_im"))
        .map(|(re, im)| Complex64::cis(im.atan2(re)))
        .collect()
}

#[test]
fn semi_real_angles_are_as_accurate_as_bartlett_with_perfect_timing() {
    let Some(dir) = common::data_dir() else {
        return;
    };
    let path = dir.join("captures/semireal4_singtel-n1_day1_array1");
    let mut recording = Recording::open(path).unwrap();
    let annotations = recording.annotations().to_vec();
    let (mut estimates, mut bartletts) = (0.0, 0.0);
    for annotation in &annotations {
        let truth = &annotation.other["aoa:truth"];
        let spacing_wavelengths = truth["element_spacing_wavelengths"].as_f64().unwrap();
        let gains = calibration(truth);
        let settings = ScanSettings {
            array: ArraySetup {
                spacing_wavelengths,
                calibration: Some(gains.clone()),
                ..ArraySetup::default()
            },
            ..ScanSettings::default()
        };
        let found = scan(&mut recording, &settings).unwrap();
        let near =
            |found: &&ScannedSsb| (found.sample_start - annotation.sample_start as f64).abs() < 6.0;
        let angle = found.ssbs.iter().find(near).unwrap().angle.unwrap();
        let angle = angle.from_row().unwrap();
        let azimuth_deg = 90.0 - angle.angle_rad.to_degrees();

        // Bartlett estimate from the samples of the annotated SSB.
        let mut samples = Vec::new();
        let count = annotation.sample_count.unwrap() as usize;
        recording
            .read(annotation.sample_start, count, &mut samples)
            .unwrap();
        let power = |azimuth_deg: f64| -> f64 {
            let step = std::f64::consts::TAU * spacing_wavelengths * azimuth_deg.to_radians().sin();
            let weights: Vec<Complex64> = gains
                .iter()
                .enumerate()
                .map(|(k, g)| (g * Complex64::cis(step * k as f64)).conj())
                .collect();
            (0..count)
                .map(|n| {
                    let sum: Complex64 = weights
                        .iter()
                        .zip(&samples)
                        .map(|(w, x)| w * Complex64::new(f64::from(x[n].re), f64::from(x[n].im)))
                        .sum();
                    sum.norm_sqr()
                })
                .sum()
        };
        let bartlett_deg = (-900..=900)
            .map(|tenth| f64::from(tenth) * 0.1)
            .max_by(|a, b| power(*a).total_cmp(&power(*b)))
            .unwrap();
        let true_deg = truth["azimuth_from_broadside_deg"].as_f64().unwrap();
        println!("truth {true_deg:.1}, ours {azimuth_deg:.2}, Bartlett {bartlett_deg:.1}");
        estimates += (azimuth_deg - true_deg).abs();
        bartletts += (bartlett_deg - true_deg).abs();
    }
    assert!(estimates <= 1.3 * bartletts, "{estimates} {bartletts}");
}
