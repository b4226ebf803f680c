//! What is wrong with single receive channels: clipped, silent, swapped.

use std::f64::consts::TAU;
use std::fmt;

use num_complex::{Complex32, Complex64};

use super::array_view::View;

/// A channel this far below the strongest is silent, in dB.
const SILENT_DB: f64 = 60.0;
/// Share of samples at the largest magnitude from which a channel is clipped.
const CLIPPED_SHARE: f64 = 1e-3;
/// Channels are judged swapped only on SSBs of at least this SNR per symbol, in dB.
const SWAP_SNR_DB: f64 = 10.0;
/// Power that must be gained by changing two channels back, as a share of all power.
const SWAP_GAIN: f64 = 0.1;
/// Share of the power in one direction that right channels have at least.
const RIGHT_SHARE: f64 = 0.9;

/// What is wrong with the channels.
#[derive(Debug, Clone, PartialEq)]
pub enum ChannelFault {
    /// Samples stand at the converter's limit.
    Clipped {
        /// The channel.
        channel: usize,
        /// Share of its samples at the limit.
        share: f64,
    },
    /// Nothing, or next to nothing, comes from it.
    Silent {
        /// The channel.
        channel: usize,
    },
    /// The array's response makes sense with these two exchanged, and not as they are.
    Swapped {
        /// One channel.
        first: usize,
        /// The other.
        second: usize,
    },
}

impl fmt::Display for ChannelFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Clipped { channel, share } => {
                write!(
                    f,
                    "channel {channel} is clipped: {:.2} % of its samples",
                    share * 100.0
                )
            }
            Self::Silent { channel } => write!(f, "channel {channel} is silent"),
            Self::Swapped { first, second } => {
                write!(f, "channels {first} and {second} look exchanged")
            }
        }
    }
}

/// Faults that the samples alone show: clipped and silent channels.
pub fn diagnose_channels(antennas: &[Vec<Complex32>]) -> Vec<ChannelFault> {
    let mut watch = ChannelWatch::new(antennas.len());
    watch.samples(antennas);
    watch.faults()
}

/// Watches channels over a whole recording.
#[derive(Debug, Clone, Default)]
pub(super) struct ChannelWatch {
    channels: Vec<Level>,
    /// Votes of SSBs: as they are, or with a pair exchanged.
    right: usize,
    swapped: Vec<((usize, usize), usize)>,
}

#[derive(Debug, Clone, Copy, Default)]
struct Level {
    samples: u64,
    energy: f64,
    largest: f32,
    at_largest: u64,
}

impl ChannelWatch {
    pub fn new(channels: usize) -> Self {
        Self {
            channels: vec![Level::default(); channels],
            ..Self::default()
        }
    }

    pub fn samples(&mut self, antennas: &[Vec<Complex32>]) {
        for (level, samples) in self.channels.iter_mut().zip(antennas) {
            for sample in samples {
                level.add(*sample);
            }
        }
    }

    /// An SSB as the array saw it.
    pub fn response(&mut self, view: &View) {
        if view.estimate.snr_db < SWAP_SNR_DB {
            return;
        }
        let antennas = self.channels.len();
        // Neighbours first: of four antennas, exchanging the inner two looks like exchanging the
        // outer two in a mirror, and only a clearly better pair replaces a nearer one.
        let pairs = (1..antennas).flat_map(|apart| (apart..antennas).map(move |j| (j - apart, j)));
        let as_it_is = share_in_one_direction(&view.blocks, None);
        let best = pairs.fold((0.0, (0, 0)), |best, pair| {
            let share = share_in_one_direction(&view.blocks, Some(pair));
            if share > best.0 + 0.01 {
                (share, pair)
            } else {
                best
            }
        });
        match best {
            (share, pair) if share > RIGHT_SHARE && share > as_it_is + SWAP_GAIN => {
                match self.swapped.iter_mut().find(|(other, _)| *other == pair) {
                    Some((_, votes)) => *votes += 1,
                    None => self.swapped.push((pair, 1)),
                }
            }
            _ => self.right += 1,
        }
    }

    pub fn faults(&self) -> Vec<ChannelFault> {
        let powers = self.channels.iter().map(Level::power);
        let strongest = powers.fold(0.0, f64::max);
        let floor = strongest * 10f64.powf(-0.1 * SILENT_DB);
        let mut faults = Vec::new();
        for (channel, level) in self.channels.iter().enumerate() {
            let share = level.at_largest as f64 / level.samples.max(1) as f64;
            if level.power() <= floor {
                faults.push(ChannelFault::Silent { channel });
            } else if share > CLIPPED_SHARE && level.at_largest > 8 {
                faults.push(ChannelFault::Clipped { channel, share });
            }
        }
        let votes: usize = self.right + self.swapped.iter().map(|(_, votes)| votes).sum::<usize>();
        if let Some(((first, second), most)) = self.swapped.iter().max_by_key(|(_, votes)| votes)
            && 2 * most > votes
        {
            faults.push(ChannelFault::Swapped {
                first: *first,
                second: *second,
            });
        }
        faults
    }
}

impl Level {
    fn add(&mut self, sample: Complex32) {
        self.samples += 1;
        self.energy += f64::from(sample.norm_sqr());
        let largest = sample.re.abs().max(sample.im.abs());
        if largest > self.largest {
            self.largest = largest;
            self.at_largest = 1;
        } else if largest == self.largest && largest > 0.0 {
            self.at_largest += 1;
        }
    }

    fn power(&self) -> f64 {
        self.energy / self.samples.max(1) as f64
    }
}

/// Largest share of the power that one plane wave explains, with a pair of channels exchanged.
fn share_in_one_direction(blocks: &[Vec<Complex64>], exchanged: Option<(usize, usize)>) -> f64 {
    const DIRECTIONS: usize = 128;
    let mut total = 0.0;
    let mut beams = [0.0; DIRECTIONS];
    for block in blocks {
        let antennas = block.len();
        total += block.iter().map(Complex64::norm_sqr).sum::<f64>();
        for (index, beam) in beams.iter_mut().enumerate() {
            let phase_rad = TAU * index as f64 / DIRECTIONS as f64;
            let channel = |place: usize| match exchanged {
                Some((i, j)) if place == i => j,
                Some((i, j)) if place == j => i,
                _ => place,
            };
            let sum: Complex64 = (0..antennas)
                .filter_map(|place| block.get(channel(place)).map(|gain| (place, gain)))
                .map(|(place, gain)| gain * Complex64::cis(-phase_rad * place as f64))
                .sum();
            *beam += sum.norm_sqr() / antennas as f64;
        }
    }
    beams.iter().copied().fold(0.0, f64::max) / total.max(f64::MIN_POSITIVE)
}
