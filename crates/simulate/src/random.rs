//! Random numbers that depend only on the seed, the run and their purpose.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// Purpose of random numbers. Each purpose has its own stream, so that additional draws for one
/// purpose do not change the others.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum Purpose {
    /// Shadowing of a radio head.
    Shadowing = 1,
    /// Directions and phases of a radio head's scatter.
    Scatter = 2,
    /// Signal and noise of a radio head's snapshots.
    Snapshots = 3,
    /// Errors of the sensed SNR of a radio head.
    SensedSnr = 4,
    /// Odometer and gyroscope.
    Odometer = 5,
    /// Lateral wander.
    Wander = 6,
    /// Error of the initial pose.
    Start = 7,
    /// Oscillators and channel gains of the simulated receiver.
    ReceiverHardware = 8,
    /// Noise of the simulated samples.
    SampleNoise = 9,
    /// Oscillator of a radio head.
    HeadOscillator = 10,
    /// Delays of a radio head's scatter.
    ScatterDelay = 11,
    /// Mounting and calibration of the array.
    Array = 12,
    /// Positions and powers of the radio heads.
    Survey = 13,
    /// Blockage of a radio head's line of sight.
    Blockage = 14,
    /// Large-scale parameters of a radio head's channel.
    LargeScale = 15,
    /// Clusters of a radio head's channel.
    Clusters = 16,
    /// Rotation of a radio head's scatter around the forward axis.
    ScatterTurn = 17,
    /// Time offset of the receiver's clock.
    Clock = 18,
    /// Clocks of the radio heads and of the vehicle that one-way delays contain.
    RangingClock = 19,
}

/// Random streams of one run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Streams {
    seed: u64,
    run: u64,
}

impl Streams {
    /// Creates the streams of run number `run` for the seed `seed`.
    pub const fn new(seed: u64, run: u64) -> Self {
        Self { seed, run }
    }

    /// Returns a generator keyed by (seed, run, purpose, index); `index` distinguishes radio heads.
    pub fn generator(self, purpose: Purpose, index: usize) -> ChaCha8Rng {
        let mut key = [0; 32];
        let words = [self.seed, self.run, u64::from(purpose as u32), index as u64];
        for (bytes, word) in key.chunks_exact_mut(8).zip(words) {
            bytes.copy_from_slice(&word.to_le_bytes());
        }
        ChaCha8Rng::from_seed(key)
    }
}

#[cfg(test)]
mod tests {
    use rand::Rng;

    use super::*;

    #[test]
    fn every_component_of_the_key_changes_the_stream() {
        let first = |seed, run, purpose, index| {
            Streams::new(seed, run).generator(purpose, index).next_u64()
        };
        let draws = [
            first(1, 0, Purpose::Shadowing, 0),
            first(2, 0, Purpose::Shadowing, 0),
            first(1, 1, Purpose::Shadowing, 0),
            first(1, 0, Purpose::Scatter, 0),
            first(1, 0, Purpose::Shadowing, 1),
        ];
        for (i, a) in draws.iter().enumerate() {
            assert!(draws.iter().skip(i + 1).all(|b| a != b));
        }
        assert_eq!(draws[0], first(1, 0, Purpose::Shadowing, 0));
    }
}
