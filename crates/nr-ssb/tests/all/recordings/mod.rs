//! Reader of the recordings in the tests: SigMF cf32_le with interleaved channels.

use std::path::{Path, PathBuf};

use nr_ssb::Complex32;
use serde_json::Value;

use crate::common::data_dir;

/// A recording, its samples by channel, and its annotations.
pub struct Recording {
    pub name: String,
    pub rate_hz: f64,
    pub centre_hz: f64,
    pub channels: Vec<Vec<Complex32>>,
    pub annotations: Vec<Value>,
}

impl Recording {
    pub fn antennas(&self) -> Vec<&[Complex32]> {
        self.channels.iter().map(Vec::as_slice).collect()
    }
}

/// Returns all recordings with an `nr:ssb` annotation.
pub fn annotated() -> Vec<Recording> {
    let dir = data_dir();
    assert!(dir.is_dir(), "no recordings at {}", dir.display());
    let mut paths: Vec<PathBuf> = std::fs::read_dir(dir.join("captures"))
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| {
            path.extension()
                .is_some_and(|extension| extension == "sigmf-meta")
        })
        .collect();
    paths.sort();
    let all = paths.iter().map(|path| read(path));
    all.filter(|recording| {
        recording
            .annotations
            .iter()
            .any(|a| a.get("nr:ssb").is_some())
    })
    .collect()
}

fn read(meta: &Path) -> Recording {
    let json: Value = serde_json::from_slice(&std::fs::read(meta).unwrap()).unwrap();
    let global = &json["global"];
    let count = global["core:num_channels"].as_u64().unwrap_or(1) as usize;
    let annotations = json["annotations"].as_array().cloned().unwrap_or_default();
    let mut channels = vec![Vec::new(); count];
    if annotations.iter().any(|a| a.get("nr:ssb").is_some()) {
        assert_eq!(global["core:datatype"], "cf32_le");
        let bytes = std::fs::read(meta.with_extension("sigmf-data")).unwrap();
        for (index, sample) in bytes.as_chunks::<8>().0.iter().enumerate() {
            let (re, im) = sample.split_at(4);
            let [re, im] = [re, im].map(|part| f32::from_le_bytes(part.try_into().unwrap()));
            channels[index % count].push(Complex32::new(re, im));
        }
    }
    Recording {
        name: meta.file_stem().unwrap().to_string_lossy().into_owned(),
        rate_hz: global["core:sample_rate"].as_f64().unwrap(),
        centre_hz: json["captures"][0]["core:frequency"].as_f64().unwrap(),
        channels,
        annotations,
    }
}
