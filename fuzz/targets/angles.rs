#![no_main]

#[path = "../bodies/angles.rs"]
mod body;

libfuzzer_sys::fuzz_target!(|data: &[u8]| body::run(data));
