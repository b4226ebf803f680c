//! A short fuzz run without libFuzzer, for the ordinary tests: the same bodies, on seeds and on
//! pseudo-random changes of the seeds that are equal in every run.

use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Special floating-point values.
const AWKWARD: [f32; 8] = [
    f32::NAN,
    f32::INFINITY,
    f32::NEG_INFINITY,
    f32::MAX,
    f32::MIN_POSITIVE,
    1e-45,
    -0.0,
    1e20,
];
const LONGEST: usize = 4096;

/// Prints the input with which a body panics.
struct Report<'a>(&'a [u8]);

impl Drop for Report<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            println!("input: {:?}", self.0);
        }
    }
}

/// Runs `body` on the seeds and on `count` changed inputs; changes accumulate.
pub fn run(seeds: &[Vec<u8>], count: usize, body: fn(&[u8])) {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut corpus = seeds.to_vec();
    for seed in seeds {
        let _report = Report(seed);
        body(seed);
    }
    for _ in 0..count {
        let origin = rng.random_range(0..corpus.len());
        let mut input = corpus[origin].clone();
        for _ in 0..rng.random_range(1..8) {
            change(&mut input, &corpus, &mut rng);
        }
        input.truncate(LONGEST);
        let report = Report(&input);
        body(&input);
        drop(report);
        if rng.random_range(0..8) == 0 {
            let place = rng.random_range(0..corpus.len() + 1);
            if corpus.len() < 64 {
                corpus.push(input);
            } else if place >= seeds.len() && place < corpus.len() {
                corpus[place] = input;
            }
        }
    }
}

fn change(input: &mut Vec<u8>, corpus: &[Vec<u8>], rng: &mut impl Rng) {
    let place = rng.random_range(0..input.len() + 1);
    match rng.random_range(0..7) {
        0 => input.insert(place, rng.random()),
        1 => input.truncate(place),
        2 => {
            let bytes: [u8; 8] = std::array::from_fn(|_| rng.random());
            input.extend(bytes);
        }
        3 => {
            let value = AWKWARD[rng.random_range(0..AWKWARD.len())];
            let end = (place + 4).min(input.len());
            input[place..end].copy_from_slice(&value.to_le_bytes()[..end - place]);
        }
        4 => {
            let other = &corpus[rng.random_range(0..corpus.len())];
            let from = rng.random_range(0..other.len() + 1);
            let to = rng.random_range(from..other.len() + 1);
            let kept = input.split_off(place);
            input.extend(&other[from..to]);
            input.extend(kept);
        }
        5 => {
            let end = rng.random_range(place..input.len() + 1);
            input.drain(place..end);
        }
        _ => {
            if let Some(byte) = input.get_mut(place) {
                *byte ^= 1 << rng.random_range(0..8);
            }
        }
    }
}
