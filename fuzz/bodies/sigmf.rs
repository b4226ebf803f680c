//! SigMF reader on arbitrary files: the input up to its first zero byte is the metadata, the rest is
//! the data.

use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};

use recording::{Recording, RecordingError};

static NEXT: AtomicUsize = AtomicUsize::new(0);

thread_local! {
    /// Folder of this thread's files.
    static STEM: PathBuf = {
        let number = NEXT.fetch_add(1, Ordering::Relaxed);
        let name = format!("access-av-fuzz-{}-{number}", std::process::id());
        std::env::temp_dir().join(name)
    };
}

pub fn run(input: &[u8]) {
    let end = input.iter().position(|byte| *byte == 0);
    let (metadata, data) = input.split_at(end.unwrap_or(input.len()));
    STEM.with(|stem| {
        let [meta_file, data_file] =
            ["sigmf-meta", "sigmf-data"].map(|extension| stem.with_extension(extension));
        std::fs::write(&meta_file, metadata).expect("a directory to write to");
        std::fs::write(&data_file, data.get(1..).unwrap_or_default()).expect("the same directory");
        match Recording::open(&meta_file) {
            Ok(mut recording) => read(&mut recording, data.len().saturating_sub(1)),
            Err(error) => assert!(!error.to_string().is_empty()),
        }
        for file in [meta_file, data_file] {
            std::fs::remove_file(file).expect("written above");
        }
    });
}

fn read(recording: &mut Recording, bytes: usize) {
    let channels = recording.channels();
    let length = recording.length();
    let frame = channels * recording.datatype().bytes();
    assert_eq!(length as usize * frame, bytes);
    assert!(recording.sample_rate_hz() > 0.0);
    for warning in recording.warnings() {
        assert!(!warning.to_string().is_empty());
    }
    let mut samples = Vec::new();
    match recording.read(0, length as usize, &mut samples) {
        Ok(()) => {
            assert_eq!(samples.len(), channels);
            assert!(samples.iter().all(|it| it.len() as u64 == length));
            assert!(samples.iter().flatten().all(|x| x.is_finite()));
        }
        Err(RecordingError::NotFinite {
            sample, channel, ..
        }) => {
            assert!(sample < length && channel < channels);
        }
        Err(other) => panic!("{other}"),
    }
    assert!(matches!(
        recording.read(length, 1, &mut samples),
        Err(RecordingError::OutOfRange { .. })
    ));
}
