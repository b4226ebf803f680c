//! Faults of receive channels: clipped, silent, weak, duplicated or exchanged channels.

use std::f64::consts::TAU;
use std::fmt;

use nr_ssb::Complex32;
use nr_ssb::diagnose::{Fault, diagnose};
use nr_ssb::{Tone, tones};
use num_complex::Complex64;

use onboard::receive::array_view::{FoundAngle, View};

/// Minimum SNR per symbol of an SSB for the detection of exchanged channels, in dB.
const SWAP_SNR_DB: f64 = 10.0;
/// Minimum fraction of the power that the exchange of two channels must add to the beam.
const SWAP_GAIN: f64 = 0.1;
/// Minimum fraction of the power in one direction for channels in correct order.
const RIGHT_SHARE: f64 = 0.9;

/// Maximum frequency of a tone that is called a DC offset, in Hz.
const DC_HZ: f64 = 100.0;
/// Minimum distance of two tones in Hz: a bin of the spectra in which they are detected.
pub(super) const ONE_TONE_HZ: f64 = 15e3;

/// Fault of the receive channels.
#[derive(Debug, Clone, PartialEq)]
pub enum ChannelFault {
    /// Fault that the samples of a channel reveal.
    Samples {
        /// Index of the channel.
        channel: usize,
        /// Kind of fault.
        fault: Fault,
    },
    /// Two channels are exchanged, according to the array's response.
    Exchanged {
        /// Index of the first channel.
        first: usize,
        /// Index of the second channel.
        second: usize,
    },
    /// DC offset, or a tone in the recorded band. It is subtracted before the search for SSBs.
    Tone(Tone),
    /// I and Q are exchanged: SSBs are found only after their exchange.
    IqExchanged,
    /// SSBs are found only with another sample rate, so that the specified one is probably wrong.
    SampleRate {
        /// Specified sample rate in Hz.
        specified_hz: f64,
        /// Sample rate with which SSBs are found, in Hz.
        likely_hz: f64,
    },
}

impl ChannelFault {
    /// Returns the index of the faulty channel; `None` for faults of several channels.
    pub const fn channel(&self) -> Option<usize> {
        match self {
            Self::Samples { channel, .. } => Some(*channel),
            Self::Exchanged { .. }
            | Self::Tone(_)
            | Self::IqExchanged
            | Self::SampleRate { .. } => None,
        }
    }
}

impl fmt::Display for ChannelFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (channel, fault) = match self {
            Self::Exchanged { first, second } => {
                return write!(f, "channels {first} and {second} look exchanged");
            }
            Self::Tone(tone) if tone.frequency_hz.abs() < DC_HZ => {
                return write!(f, "DC offset of {:.1} dBFS: removed", tone.power_dbfs);
            }
            Self::Tone(tone) => {
                return write!(
                    f,
                    "tone {:+.2} kHz from the centre frequency, {:.1} dBFS: removed",
                    1e-3 * tone.frequency_hz,
                    tone.power_dbfs
                );
            }
            Self::IqExchanged => {
                return f.write_str(
                    "I and Q are exchanged (the spectrum is mirrored): SSBs were found with them \
                     exchanged back, and none otherwise",
                );
            }
            Self::SampleRate {
                specified_hz,
                likely_hz,
            } => {
                return write!(
                    f,
                    "no SSB is decoded at the specified sample rate of {specified_hz} Hz, but at {likely_hz} Hz: \
                     correct the sample rate"
                );
            }
            Self::Samples { channel, fault } => (channel, fault),
        };
        match fault {
            Fault::Silent => write!(f, "channel {channel} is silent"),
            Fault::Weak { below_strongest_db } => {
                write!(
                    f,
                    "channel {channel} is {below_strongest_db:.0} dB below the strongest"
                )
            }
            Fault::Clipped { share } => {
                write!(
                    f,
                    "channel {channel} is clipped: {:.2} % of its samples",
                    share * 100.0
                )
            }
            Fault::Duplicate { of } => {
                write!(
                    f,
                    "channel {channel} contains the same samples as channel {of}"
                )
            }
            other => write!(f, "channel {channel}: {other:?}"),
        }
    }
}

/// Returns the faults that the samples reveal.
pub(super) fn faults_of_samples(
    antennas: &[&[Complex32]],
    sample_rate_hz: f64,
) -> Vec<ChannelFault> {
    let diagnoses = diagnose(antennas).into_iter().enumerate();
    let mut faults: Vec<ChannelFault> = diagnoses
        .flat_map(|(channel, it)| {
            it.faults
                .into_iter()
                .map(move |fault| ChannelFault::Samples { channel, fault })
        })
        .collect();
    faults.extend(
        tones(antennas, sample_rate_hz)
            .into_iter()
            .map(ChannelFault::Tone),
    );
    faults
}

/// Adds a tone unless it is already known.
pub(super) fn add_tone(faults: &mut Vec<ChannelFault>, tone: Tone) {
    let same = |fault: &ChannelFault| match fault {
        ChannelFault::Tone(known) => (known.frequency_hz - tone.frequency_hz).abs() < ONE_TONE_HZ,
        _ => false,
    };
    if !faults.iter().any(same) {
        faults.push(ChannelFault::Tone(tone));
    }
}

/// Votes of the SSBs on exchanged channels.
#[derive(Debug, Clone, Default)]
pub(super) struct ExchangeVotes {
    right: usize,
    exchanged: Vec<((usize, usize), usize)>,
}

impl ExchangeVotes {
    /// Adds the vote of an SSB.
    pub fn vote(&mut self, view: &View) {
        // With an array that is not linear, exchanged antennas give a plane wave from another
        // direction.
        let FoundAngle::FromRow(estimate) = view.angle else {
            return;
        };
        if estimate.snr_db < SWAP_SNR_DB {
            return;
        }
        let antennas = view.blocks.first().map_or(0, Vec::len);
        // Adjacent pairs first. With four antennas, the exchange of the inner pair is equivalent to
        // that of the outer pair with a mirrored angle. A distant pair replaces a nearer one only
        // if it is clearly better.
        let pairs = (1..antennas).flat_map(|apart| (apart..antennas).map(move |j| (j - apart, j)));
        let as_it_is = share_in_one_direction(&view.blocks, None);
        let (share, pair) = pairs.fold((0.0, (0, 0)), |best, pair| {
            let share = share_in_one_direction(&view.blocks, Some(pair));
            if share > best.0 + 0.01 {
                (share, pair)
            } else {
                best
            }
        });
        if share <= RIGHT_SHARE || share <= as_it_is + SWAP_GAIN {
            self.right += 1;
        } else {
            self.count(pair, 1);
        }
    }

    /// Adds the votes of another search.
    pub fn add(&mut self, others: &Self) {
        self.right += others.right;
        for (pair, votes) in &others.exchanged {
            self.count(*pair, *votes);
        }
    }

    fn count(&mut self, pair: (usize, usize), votes: usize) {
        if let Some((_, sum)) = self.exchanged.iter_mut().find(|(it, _)| *it == pair) {
            *sum += votes;
        } else {
            self.exchanged.push((pair, votes));
        }
    }

    /// Returns the fault of the majority.
    pub fn fault(&self) -> Option<ChannelFault> {
        let all = self.right + self.exchanged.iter().map(|(_, votes)| votes).sum::<usize>();
        let ((first, second), votes) = *self.exchanged.iter().max_by_key(|(_, votes)| votes)?;
        (2 * votes > all).then_some(ChannelFault::Exchanged { first, second })
    }
}

/// Returns the maximum fraction of the power that one plane wave explains, with a pair of channels
/// exchanged.
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
