//! A short run of the fuzz target of the SigMF reader: see `fuzz/README.md`.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::print_stdout,
    reason = "this is a test"
)]

use std::path::Path;

#[path = "../../../fuzz/bodies/short_run.rs"]
mod short_run;
#[path = "../../../fuzz/bodies/sigmf.rs"]
mod sigmf;

#[test]
fn no_files_make_the_sigmf_reader_panic() {
    let directory = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/seeds/sigmf");
    let mut files: Vec<_> = std::fs::read_dir(directory)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .collect();
    files.sort();
    let seeds: Vec<_> = files
        .iter()
        .map(|file| std::fs::read(file).unwrap())
        .collect();
    short_run::run(&seeds, 20_000, sigmf::run);
}
