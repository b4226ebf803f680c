//! Short runs of the fuzz targets of the readers; see `fuzz/README.md`.
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
#[path = "../../../fuzz/bodies/tables.rs"]
mod tables;

#[test]
fn the_sigmf_reader_never_panics() {
    short_run::run(&seeds("sigmf"), 20_000, sigmf::run);
}

#[test]
fn the_mcap_reader_never_panics() {
    short_run::run(&seeds("mcap"), 1_000, mcap::run);
}

#[test]
fn the_table_readers_never_panic() {
    let seeds = [
        "\0time_s,distance_m,speed_mps,yaw_rate_radps\n0,0,1,0\n0.02,0.02,1,0.1\n",
        "\x01time_s;left_mps;right_mps\n0;1,0;1,1\n0,02;1,0;1,1\n",
        "\x02time_s,pci,ssb_index,phase_rad,phase_sigma_rad,snr_db,resolved\n0.5,11,0,0.1,0.02,20,1\n",
        "\x03# t x y z qx qy qz qw\n0.0 1.0 2.0 0 0 0 0.0 1.0\n1 2 3 0 0 0 1 0\n",
        "\x04x_m,y_m\n0,0\n10,0\n10,20\n",
        "\x05{\"type\":\"LineString\",\"coordinates\":[[7.1,50.7],[7.2,50.8]]}",
    ];
    let seeds = seeds.map(|it| it.as_bytes().to_vec());
    short_run::run(&seeds, 20_000, tables::run);
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
