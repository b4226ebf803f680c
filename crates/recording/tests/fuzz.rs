//! Short runs of the fuzz targets of the readers: see `fuzz/README.md`.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::print_stdout,
    reason = "this is a test"
)]

use std::path::Path;

#[path = "../../../fuzz/bodies/mcap.rs"]
mod mcap;
#[path = "../../../fuzz/bodies/short_run.rs"]
mod short_run;
#[path = "../../../fuzz/bodies/sigmf.rs"]
mod sigmf;

#[test]
fn no_files_make_the_sigmf_reader_panic() {
    short_run::run(&seeds("sigmf"), 20_000, sigmf::run);
}

#[test]
fn no_files_make_the_mcap_reader_panic() {
    short_run::run(&seeds("mcap"), 1_000, mcap::run);
}

fn seeds(target: &str) -> Vec<Vec<u8>> {
    let directory = Path::new(env!("CARGO_MANIFEST_DIR"));
    let directory = directory.join("../../fuzz/seeds").join(target);
    let mut files: Vec<_> = std::fs::read_dir(directory)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .collect();
    files.sort();
    let read = files.iter().map(|file| std::fs::read(file).unwrap());
    read.collect()
}
