//! SigMF: files round-trip, each kind of damage has its own error, and nothing panics.

use crate::common;
use std::fs;
use std::path::{Path, PathBuf};

use num_complex::Complex32;
use proptest::prelude::*;
use recording::{
    Annotation, Datatype, Recording, RecordingError, RecordingWarning, RecordingWriter,
    WriterSettings,
};
use serde_json::{Map, Value, json};

const LENGTH: usize = 70_000; // more than one block of the reader

fn settings(datatype: Datatype, channels: usize) -> WriterSettings {
    WriterSettings {
        datatype,
        channels,
        sample_rate_hz: 7.68e6,
        frequency_hz: 3.7e9,
        description: "a test".to_owned(),
        global: Map::new(),
    }
}

fn ramp(channel: usize) -> Vec<Complex32> {
    (0..LENGTH)
        .map(|index| Complex32::new(index as f32 / LENGTH as f32 - 0.5, channel as f32 / 8.0))
        .collect()
}

/// Writes three channels and an annotation.
fn write(dir: &Path, datatype: Datatype) -> PathBuf {
    let mut writer = RecordingWriter::create(&dir.join("drive"), settings(datatype, 3)).unwrap();
    let channels: Vec<_> = (0..3).map(ramp).collect();
    for part in [0..10, 10..LENGTH] {
        let block: Vec<_> = channels
            .iter()
            .map(|channel| &channel[part.clone()])
            .collect();
        writer.write(&block).unwrap();
    }
    writer.annotate(Annotation {
        sample_start: 3,
        sample_count: Some(4),
        other: Map::from_iter([("nr:ssb".to_owned(), json!({"pci": 7}))]),
        ..Annotation::default()
    });
    writer.finish().unwrap()
}

fn edit(meta: &Path, change: impl FnOnce(&mut Value)) {
    let mut json: Value = serde_json::from_slice(&fs::read(meta).unwrap()).unwrap();
    change(&mut json);
    fs::write(meta, json.to_string()).unwrap();
}

#[test]
fn recordings_round_trip() {
    for datatype in [Datatype::Cf32Le, Datatype::Ci16Le] {
        let meta = write(
            &common::scratch(&format!("sigmf-{}", datatype.name())),
            datatype,
        );
        let mut recording = Recording::open(&meta).unwrap();
        assert_eq!(recording.warnings(), []);
        assert_eq!(
            (recording.channels(), recording.length()),
            (3, LENGTH as u64)
        );
        assert_eq!(recording.sample_rate_hz(), 7.68e6);
        assert_eq!(recording.centre_frequency_hz(), Some(3.7e9));
        assert_eq!(recording.annotations()[0].other["nr:ssb"]["pci"], 7);
        let mut read = Vec::new();
        for (start, count) in [(0, LENGTH), (12_345, 50_000), (LENGTH as u64, 0)] {
            recording.read(start, count, &mut read).unwrap();
            let tolerance = if datatype == Datatype::Cf32Le {
                0.0
            } else {
                2f32.powi(-15)
            };
            for (channel, samples) in read.iter().enumerate() {
                assert_eq!(samples.len(), count);
                let expected = &ramp(channel)[start as usize..][..count];
                for (found, expected) in samples.iter().zip(expected) {
                    assert!((found - expected).norm() <= tolerance);
                }
            }
        }
    }
}

#[test]
fn integers_saturate_at_full_scale() {
    let stem = common::scratch("sigmf-saturate").join("loud");
    let mut writer = RecordingWriter::create(&stem, settings(Datatype::Ci16Le, 1)).unwrap();
    writer.write(&[&[Complex32::new(3.0, -3.0)]]).unwrap();
    let mut read = Vec::new();
    Recording::open(writer.finish().unwrap())
        .unwrap()
        .read(0, 1, &mut read)
        .unwrap();
    assert_eq!(read[0], [Complex32::new(32767.0 / 32768.0, -1.0)]);
}

#[test]
fn raw_files_are_read_as_channels() {
    let dir = common::scratch("sigmf-raw");
    let bytes: Vec<u8> = (0..32u32).flat_map(|n| (n as f32).to_le_bytes()).collect();
    let paths = ["a.cf32", "b.cf32"].map(|name| dir.join(name));
    fs::write(&paths[0], &bytes[..64]).unwrap();
    fs::write(&paths[1], &bytes[64..]).unwrap();
    let mut recording = Recording::open_raw(&paths, 3.84e6, Some(3.5e9)).unwrap();
    let mut read = Vec::new();
    recording.read(1, 2, &mut read).unwrap();
    assert_eq!(
        read[0],
        [Complex32::new(2.0, 3.0), Complex32::new(4.0, 5.0)]
    );
    assert_eq!(read[1][0], Complex32::new(18.0, 19.0));

    fs::write(&paths[1], &bytes[72..]).unwrap();
    let error = Recording::open_raw(&paths, 3.84e6, None).unwrap_err();
    assert!(matches!(
        error,
        RecordingError::UnequalChannels {
            samples: 7,
            expected: 8,
            ..
        }
    ));
    let error = Recording::open_raw(&paths, -1.0, None).unwrap_err();
    assert!(matches!(error, RecordingError::Value { ref key, .. } if key.ends_with("sample_rate")));
    let none: [&Path; 0] = [];
    assert!(Recording::open_raw(&none, 3.84e6, None).is_err());
}

#[test]
fn invalid_metadata_is_reported_with_its_key() {
    type Edit = fn(&mut Value);
    let cases: [(&str, Edit); 12] = [
        ("global.core:sample_rate", |json| {
            json["global"]["core:sample_rate"] = json!(0);
        }),
        ("global.core:sample_rate", |json| {
            json["global"]["core:sample_rate"] = json!(-1.5);
        }),
        ("global.core:sample_rate", |json| {
            json["global"]["core:sample_rate"] = json!("fast");
        }),
        ("global.core:sample_rate", |json| {
            json["global"]
                .as_object_mut()
                .unwrap()
                .remove("core:sample_rate");
        }),
        ("global.core:datatype", |json| {
            json["global"]["core:datatype"] = json!("cf64_be");
        }),
        ("global.core:datatype", |json| {
            json["global"]
                .as_object_mut()
                .unwrap()
                .remove("core:datatype");
        }),
        ("global.core:num_channels", |json| {
            json["global"]["core:num_channels"] = json!(0);
        }),
        ("global.core:num_channels", |json| {
            json["global"]["core:num_channels"] = json!(u64::MAX);
        }),
        ("captures[0].core:frequency", |json| {
            json["captures"][0]["core:frequency"] = json!([1]);
        }),
        ("captures[0].core:sample_start", |json| {
            json["captures"][0]["core:sample_start"] = json!(LENGTH);
        }),
        ("annotations[0].core:sample_start", |json| {
            json["annotations"][0]["core:sample_start"] = json!(-4);
        }),
        ("global", |json| *json = json!({})),
    ];
    let meta = write(&common::scratch("sigmf-keys"), Datatype::Cf32Le);
    let good = fs::read(&meta).unwrap();
    for (expected, change) in cases {
        fs::write(&meta, &good).unwrap();
        edit(&meta, change);
        match Recording::open(&meta).unwrap_err() {
            RecordingError::Value {
                file, key, allowed, ..
            }
            | RecordingError::Missing { file, key, allowed } => {
                assert_eq!(key, expected);
                assert!(file.ends_with("drive.sigmf-meta") && !allowed.is_empty());
            }
            other => panic!("{expected}: {other}"),
        }
    }
    fs::write(&meta, "{").unwrap();
    assert!(matches!(
        Recording::open(&meta),
        Err(RecordingError::Syntax { .. })
    ));
}

#[test]
fn kinds_of_damage_are_distinguished() {
    let dir = common::scratch("sigmf-damage");
    let meta = write(&dir, Datatype::Cf32Le);
    let data = dir.join("drive.sigmf-data");
    let good = fs::read(&data).unwrap();

    fs::write(&data, &good[..good.len() - 1]).unwrap();
    let error = Recording::open(&meta).unwrap_err();
    assert!(matches!(
        error,
        RecordingError::PartialFrame {
            frame_bytes: 24,
            channels: 3,
            ..
        }
    ));
    fs::write(&data, []).unwrap();
    assert!(matches!(
        Recording::open(&meta),
        Err(RecordingError::PartialFrame { .. })
    ));

    // Truncated after five samples: readable with a warning.
    fs::write(&data, &good[..5 * 24]).unwrap();
    let warnings = Recording::open(&meta).unwrap().warnings().to_vec();
    assert!(matches!(
        warnings[..],
        [
            RecordingWarning::AnnotationBeyondEnd {
                annotation: 0,
                length: 5
            },
            RecordingWarning::ChecksumMismatch { .. }
        ]
    ));

    let mut corrupted = good.clone();
    corrupted[24 * 2 + 8..][..4].copy_from_slice(&f32::NAN.to_le_bytes());
    fs::write(&data, &corrupted).unwrap();
    let mut recording = Recording::open(&data).unwrap();
    assert!(matches!(
        recording.warnings(),
        [RecordingWarning::ChecksumMismatch { .. }]
    ));
    let mut read = Vec::new();
    let error = recording.read(1, 9, &mut read).unwrap_err();
    assert!(matches!(
        error,
        RecordingError::NotFinite {
            sample: 2,
            channel: 1,
            ..
        }
    ));
    let error = recording.read(LENGTH as u64 - 1, 2, &mut read).unwrap_err();
    assert!(matches!(error, RecordingError::OutOfRange { count: 2, .. }));
    assert!(recording.read(u64::MAX, 2, &mut read).is_err());

    fs::remove_file(&data).unwrap();
    let error = Recording::open(&meta).unwrap_err();
    assert!(
        matches!(error, RecordingError::HalfMissing { ref missing, .. } if missing.ends_with("-data"))
    );
    fs::write(&data, &good).unwrap();
    fs::remove_file(&meta).unwrap();
    let error = Recording::open(&data).unwrap_err();
    assert!(
        matches!(error, RecordingError::HalfMissing { ref missing, .. } if missing.ends_with("-meta"))
    );
    fs::remove_file(&data).unwrap();
    let error = Recording::open(dir.join("drive")).unwrap_err();
    assert!(matches!(error, RecordingError::NoSuchRecording { .. }));
}

#[test]
fn samples_of_wrong_shape_are_rejected() {
    let stem = common::scratch("sigmf-misfit").join("misfit");
    assert!(RecordingWriter::create(&stem, settings(Datatype::Cf32Le, 0)).is_err());
    let mut writer = RecordingWriter::create(&stem, settings(Datatype::Cf32Le, 2)).unwrap();
    let samples = ramp(0);
    assert!(writer.write(&[&samples]).is_err());
    assert!(writer.write(&[&samples, &samples[1..]]).is_err());
    assert_eq!(writer.length(), 0);
}

#[test]
fn real_recordings_are_read() {
    let Some(dir) = common::data_dir() else {
        return;
    };
    let mut count = 0;
    for entry in fs::read_dir(dir.join("captures")).unwrap() {
        let path = entry.unwrap().path();
        if path
            .extension()
            .is_some_and(|extension| extension == "sigmf-meta")
        {
            let mut recording = Recording::open(&path).unwrap();
            assert_eq!(recording.warnings(), [], "{}", path.display());
            assert!(recording.centre_frequency_hz().unwrap() > 9e8);
            let mut samples = Vec::new();
            recording
                .read(0, recording.length() as usize, &mut samples)
                .unwrap();
            let named = |key| {
                recording
                    .annotations()
                    .iter()
                    .any(|it| it.other.contains_key(key))
            };
            assert!(named("nr:ssb") || named("aoa:truth"));
            count += 1;
        }
    }
    assert!(count > 0);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    /// Any damage to either file gives an error or a readable recording, never a panic.
    #[test]
    fn damaged_files_never_cause_a_panic(
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
        cut in prop::option::of(any::<prop::sample::Index>()),
        in_meta in any::<bool>(),
    ) {
        let dir = common::scratch("sigmf-fuzz");
        let stem = dir.join("fuzz");
        let mut writer = RecordingWriter::create(&stem, settings(Datatype::Ci16Le, 2)).unwrap();
        let samples = &ramp(0)[..20];
        writer.write(&[samples, samples]).unwrap();
        let meta = writer.finish().unwrap();
        let victim = if in_meta { meta.clone() } else { dir.join("fuzz.sigmf-data") };
        let mut bytes = fs::read(&victim).unwrap();
        for (place, value) in changes {
            let place = place.index(bytes.len());
            bytes[place] = value;
        }
        if let Some(cut) = cut {
            bytes.truncate(cut.index(bytes.len()));
        }
        fs::write(&victim, bytes).unwrap();
        if let Ok(mut recording) = Recording::open(&meta) {
            let mut read = Vec::new();
            let count = recording.length() as usize;
            let _ = recording.read(0, count, &mut read);
        }
    }
}
