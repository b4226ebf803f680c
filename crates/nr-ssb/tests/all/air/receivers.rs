//! Whole recordings through the receivers.

use nr_ssb::receiver::{ReceivedBeam, Receiver, ReceiverConfig, Window, WindowReceiver};
use nr_ssb::{Complex32, Tone};

/// Samples of each block of a stream.
const BLOCK: usize = 10_000;

/// Streams a recording through a receiver, and returns the tones that were reported last.
pub fn stream(
    config: ReceiverConfig,
    [rate_hz, centre_hz]: [f64; 2],
    samples: &[Vec<Complex32>],
    take: &mut dyn FnMut(ReceivedBeam<'_>),
) -> Vec<Tone> {
    let mut receiver = Receiver::new(config, rate_hz, centre_hz).unwrap();
    let mut tones = Vec::new();
    for from in (0..samples[0].len()).step_by(BLOCK) {
        let to = samples[0].len().min(from + BLOCK);
        let block: Vec<&[Complex32]> = samples.iter().map(|it| &it[from..to]).collect();
        receiver.push(&block, take).unwrap();
        if receiver.windows().tones().next().is_some() {
            tones = receiver.windows().tones().collect();
        }
    }
    receiver.finish(take).unwrap();
    tones
}

/// Receives `count` windows of 5 ms, one per 20 ms and the first one from sample `first` on, at the base
/// rate; returns the tones that were reported last.
pub fn windows(
    config: ReceiverConfig,
    (first, count): (usize, usize),
    samples: &[Vec<Complex32>],
    take: &mut dyn FnMut(ReceivedBeam<'_>),
) -> Vec<Tone> {
    let rate_hz = config.search.spacing.base_rate_hz();
    let [length, period] = [0.005, 0.02].map(|it| (it * rate_hz) as usize);
    let mut receiver = WindowReceiver::new(config).unwrap();
    for number in 0..count {
        let start = first + number * period;
        let antennas: Vec<&[Complex32]> = samples
            .iter()
            .map(|it| &it[start..start + length])
            .collect();
        let window = Window {
            start: start as i64,
            antennas: &antennas,
        };
        receiver.receive(&window, take).unwrap();
    }
    receiver.tones().collect()
}
