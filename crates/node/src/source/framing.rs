//! Conversion of sample bytes to blocks: antennas in their order, with times, within the required
//! windows only.

use std::sync::Arc;

use num_complex::Complex32;

use crate::clock::{ArrivalClock, Finding, unix_s};
use crate::gate::RxWindow;
use crate::inbox::{Block, Inbox, Input};
use crate::settings::{Clock, SampleFormat, Stream};
use crate::statistics::SourceHealth;

/// Maximum number of samples per channel in a block.
const MAX_FRAMES: usize = 1 << 15;
/// Interval in seconds at which dropped samples before a window are reported; the pipeline is idle
/// then.
const REPORT_INTERVAL_S: f64 = 0.02;

impl SampleFormat {
    /// Returns the number of bytes of one complex sample.
    pub const fn bytes(self) -> usize {
        match self {
            Self::Cf32 => 8,
            Self::Ci16 => 4,
            Self::Ci8 => 2,
        }
    }

    /// Decodes the first sample of `bytes`; `None` if it is not finite or if there are too few
    /// bytes.
    fn decode(self, bytes: &[u8]) -> Option<Complex32> {
        let sample = match self {
            Self::Cf32 => {
                let [a, b, c, d, e, f, g, h] = *bytes.first_chunk()?;
                let part = f32::from_le_bytes;
                Complex32::new(part([a, b, c, d]), part([e, f, g, h]))
            }
            Self::Ci16 => {
                let [a, b, c, d] = *bytes.first_chunk()?;
                let part = |bytes| f32::from(i16::from_le_bytes(bytes)) / 32768.0;
                Complex32::new(part([a, b]), part([c, d]))
            }
            Self::Ci8 => {
                let [a, b] = *bytes.first_chunk()?;
                let part = |byte: u8| f32::from(byte.cast_signed()) / 128.0;
                Complex32::new(part(a), part(b))
            }
        };
        (sample.re.is_finite() && sample.im.is_finite()).then_some(sample)
    }
}

/// Samples of one channel within a byte slice.
#[derive(Debug, Clone, Copy)]
pub struct View<'a> {
    /// Bytes from the first sample of the channel.
    pub bytes: &'a [u8],
    /// Number of bytes between consecutive samples of the channel.
    pub stride: usize,
}

/// Converter of a stream to blocks.
pub struct Framing {
    format: SampleFormat,
    rate_hz: f64,
    /// Index of the antenna of each channel.
    antennas: Vec<u8>,
    clock: Times,
    counted: u64,
    gate: Arc<RxWindow>,
    inbox: Arc<Inbox>,
    health: Arc<SourceHealth>,
    defects_reported: bool,
    /// Time up to which dropped samples were reported last.
    reported_s: f64,
    /// Bytes of an incomplete frame (one sample of all channels).
    begun: Vec<u8>,
}

enum Times {
    Arrival(ArrivalClock),
    Counted(f64),
}

impl Framing {
    /// Creates a converter for a stream of the settings.
    pub fn new(
        stream: &Stream,
        format: SampleFormat,
        gate: Arc<RxWindow>,
        inbox: Arc<Inbox>,
        health: Arc<SourceHealth>,
    ) -> Self {
        let rate_hz = stream.rate_msps * 1e6;
        Self {
            format,
            rate_hz,
            antennas: stream.antennas.clone(),
            clock: match stream.clock {
                Clock::Arrival => Times::Arrival(ArrivalClock::new(rate_hz)),
                Clock::StartTimeS(start_s) => Times::Counted(start_s),
            },
            counted: 0,
            gate,
            inbox,
            health,
            defects_reported: false,
            reported_s: f64::NEG_INFINITY,
            begun: Vec::new(),
        }
    }

    /// Returns the number of bytes of one sample of one channel.
    pub const fn sample_bytes(&self) -> usize {
        self.format.bytes()
    }

    /// Returns the duration of `bytes` bytes of one channel in seconds.
    pub fn duration_s(&self, bytes: usize) -> f64 {
        (bytes / self.format.bytes()) as f64 / self.rate_hz
    }

    /// Restarts the sample count and removes incomplete data after the stream was reopened.
    pub fn restart(&mut self) {
        self.begun.clear();
        self.counted = 0;
        self.reported_s = f64::NEG_INFINITY;
        if let Times::Arrival(clock) = &mut self.clock {
            *clock = ArrivalClock::new(self.rate_hz);
        }
    }

    /// Processes interleaved bytes of all channels, split at any position.
    pub fn interleaved(&mut self, mut bytes: &[u8]) {
        let (sample, channels) = (self.format.bytes(), self.antennas.len());
        let frame = sample * channels;
        if !self.begun.is_empty() {
            let missing = (frame - self.begun.len()).min(bytes.len());
            let (head, rest) = bytes.split_at(missing);
            self.begun.extend_from_slice(head);
            bytes = rest;
            if self.begun.len() < frame {
                return;
            }
            let begun = std::mem::take(&mut self.begun);
            self.interleaved_whole(&begun, 1);
            self.begun = begun;
            self.begun.clear();
        }
        let frames = bytes.len() / frame;
        let (whole, rest) = bytes.split_at(frames * frame);
        self.interleaved_whole(whole, frames);
        self.begun.extend_from_slice(rest);
    }

    fn interleaved_whole(&mut self, bytes: &[u8], frames: usize) {
        let (sample, channels) = (self.format.bytes(), self.antennas.len());
        let views: Vec<View<'_>> = (0..channels)
            .map(|channel| View {
                bytes: bytes.get(channel * sample..).unwrap_or_default(),
                stride: channels * sample,
            })
            .collect();
        self.take(&views, frames);
    }

    /// Processes `frames` samples of each channel.
    pub fn take(&mut self, channels: &[View<'_>], frames: usize) {
        if frames > 0 {
            let start_s = self.start_s(frames);
            self.cut(frames, start_s, |it, first, count, time_s| {
                it.decode(channels, first, count, time_s);
            });
        }
    }

    /// Returns the number of next samples per channel that are currently not required.
    pub fn unwanted(&self) -> usize {
        self.up_to(|[from_s, _]| from_s)
    }

    /// Returns the number of next samples per channel that need not be processed immediately,
    /// because a window is given to the pipeline at its end.
    pub fn deferrable(&self) -> usize {
        self.up_to(|[_, until_s]| until_s)
    }

    /// Returns the number of samples from the next one to the time `time_s` of the receive window.
    /// All samples are counted if the window is over and the next window is not yet set. 0 if every
    /// sample is required.
    fn up_to(&self, time_s: impl Fn([f64; 2]) -> f64) -> usize {
        let next_s = match &self.clock {
            Times::Counted(zero_s) => Some(zero_s + self.counted as f64 / self.rate_hz),
            Times::Arrival(clock) => clock.next_s(),
        };
        match (next_s, self.gate.wanted()) {
            (Some(next_s), Some([_, until_s])) if next_s >= until_s => MAX_FRAMES,
            (Some(next_s), Some(window_s)) => {
                ((time_s(window_s) - next_s) * self.rate_hz).max(0.0) as usize
            }
            _ => 0,
        }
    }

    /// Counts samples of each channel that were not required and not read.
    pub fn pass_over(&mut self, frames: usize) {
        let start_s = self.start_s(frames);
        self.health.came(frames as u64);
        self.slept(start_s + frames as f64 / self.rate_hz);
    }

    /// Processes equal numbers of samples of each channel; the first was received at `time_s`.
    #[cfg(feature = "soapy")]
    pub fn take_samples(&mut self, channels: &[&[Complex32]], time_s: f64) {
        let frames = channels.first().map_or(0, |samples| samples.len());
        self.cut(frames, time_s, |it, first, count, time_s| {
            let mut antennas = it.inbox.buffers(it.antennas.len());
            for (samples, antenna) in channels.iter().zip(&it.antennas) {
                if let Some(into) = antennas.get_mut(usize::from(*antenna)) {
                    into.clear();
                    into.extend_from_slice(samples.get(first..first + count).unwrap_or_default());
                }
            }
            it.inbox.put(Input::Samples(Block {
                time_s,
                offset_s: None,
                antennas,
            }));
        });
    }

    /// Reports that the radio is off for a duration.
    #[cfg(feature = "soapy")]
    pub fn rests(&self, off: std::time::Duration) {
        let missing = (off.as_secs_f64() * self.rate_hz) as u64;
        self.health.rests(missing, off);
    }

    /// Calls `take` for the required parts of the samples with index, count and time.
    fn cut(
        &mut self,
        frames: usize,
        start_s: f64,
        mut take: impl FnMut(&mut Self, usize, usize, f64),
    ) {
        self.health.came(frames as u64);
        let rate_hz = self.rate_hz;
        let mut first = 0;
        while first < frames {
            let count = MAX_FRAMES.min(frames - first);
            let block_s = start_s + first as f64 / rate_hz;
            let place =
                |time_s: f64| ((time_s - block_s) * rate_hz).clamp(0.0, count as f64) as usize;
            let wanted = self.gate.wanted();
            let [from, until] = wanted.map_or([0, count], |stretch| stretch.map(place));
            if from < until {
                let time_s = block_s + from as f64 / rate_hz;
                take(self, first + from, until - from, time_s);
            }
            if until < count {
                let end_s = block_s + count as f64 / rate_hz;
                self.slept(end_s);
            }
            first += count;
        }
    }

    /// Reports the time up to which samples were dropped: when a window is over, and at intervals.
    fn slept(&mut self, until_s: f64) {
        let is_over = |[_, end_s]: [f64; 2]| until_s >= end_s;
        if until_s - self.reported_s >= REPORT_INTERVAL_S || self.gate.wanted().is_none_or(is_over)
        {
            self.reported_s = until_s;
            self.inbox.put(Input::Slept(until_s));
        }
    }

    fn start_s(&mut self, frames: usize) -> f64 {
        match &mut self.clock {
            Times::Counted(zero_s) => {
                let start_s = *zero_s + self.counted as f64 / self.rate_hz;
                self.counted += frames as u64;
                start_s
            }
            Times::Arrival(clock) => {
                let (start_s, finding) = clock.block(frames, unix_s());
                if let Some(finding) = finding {
                    let text = match finding {
                        Finding::Missing(lost_s) => {
                            format!("samples of {lost_s:.2} s are missing")
                        }
                        Finding::WrongRate(excess) => format!(
                            "{:.2} million samples per second arrive instead of the {:.2} of \
                             samples.stream.rate_msps",
                            1e-6 * self.rate_hz * (1.0 + excess),
                            1e-6 * self.rate_hz
                        ),
                    };
                    let source = self.health.name;
                    self.inbox.put(Input::warning(source, text));
                }
                start_s
            }
        }
    }

    fn decode(&mut self, channels: &[View<'_>], first: usize, count: usize, time_s: f64) {
        let mut antennas = self.inbox.buffers(self.antennas.len());
        let mut all_numbers = true;
        for (view, antenna) in channels.iter().zip(&self.antennas) {
            let bytes = view.bytes.get(first * view.stride..).unwrap_or_default();
            let samples = bytes.chunks(view.stride).take(count);
            let samples = samples.map(|bytes| {
                self.format.decode(bytes).unwrap_or_else(|| {
                    all_numbers = false;
                    Complex32::ZERO
                })
            });
            if let Some(into) = antennas.get_mut(usize::from(*antenna)) {
                into.clear();
                into.extend(samples);
            }
        }
        if !all_numbers {
            self.health.defect();
            if !std::mem::replace(&mut self.defects_reported, true) {
                let text =
                    "samples that are not finite were set to 0; check samples.format".to_owned();
                let source = self.health.name;
                self.inbox.put(Input::warning(source, text));
            }
        }
        let offset_s = match &self.clock {
            Times::Counted(_) => None,
            Times::Arrival(clock) => Some(clock.offset_s()),
        };
        self.inbox.put(Input::Samples(Block {
            time_s,
            offset_s,
            antennas,
        }));
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    fn framing(format: SampleFormat, antennas: &[u8]) -> Framing {
        let stream = Stream {
            rate_msps: 1.0,
            centre_mhz: 3500.0,
            antennas: antennas.to_vec(),
            clock: Clock::StartTimeS(5.0),
        };
        let health = Arc::new(SourceHealth::new("raw"));
        Framing::new(&stream, format, Arc::default(), Arc::default(), health)
    }

    fn blocks(framing: &Framing) -> Vec<Block> {
        std::iter::from_fn(|| framing.inbox.take(Duration::ZERO))
            .filter_map(|(_, input)| match input {
                Input::Samples(block) => Some(block),
                _ => None,
            })
            .collect()
    }

    #[test]
    fn channels_are_assigned_to_antennas_for_any_split_of_the_bytes() {
        // Sample k of channel c is k + 100c + 0i.
        let bytes: Vec<u8> = (0..50_i16)
            .flat_map(|k| [k, 0, k + 100, 0, k + 200, 0])
            .flat_map(i16::to_le_bytes)
            .collect();
        for piece in [1, 5, 12, 13, 600] {
            let mut framing = framing(SampleFormat::Ci16, &[2, 0, 1]);
            bytes.chunks(piece).for_each(|it| framing.interleaved(it));
            let mut antennas = vec![Vec::new(); 3];
            for block in blocks(&framing) {
                let expected_s = 5.0 + antennas[0].len() as f64 * 1e-6;
                assert!((block.time_s - expected_s).abs() < 1e-9);
                for (all, new) in antennas.iter_mut().zip(&block.antennas) {
                    all.extend(new.iter().map(|it| (it.re * 32768.0) as i16));
                }
            }
            for (antenna, first) in [(2, 0), (0, 100), (1, 200)] {
                let expected: Vec<i16> = (first..first + 50).collect();
                assert_eq!(antennas[antenna], expected, "{piece}");
            }
        }
    }

    #[test]
    fn formats_are_decoded_and_non_finite_samples_are_zero() {
        let one = Complex32::new(0.5, -1.0);
        for (format, bytes) in [
            (
                SampleFormat::Cf32,
                [0.5f32.to_le_bytes(), (-1.0f32).to_le_bytes()].concat(),
            ),
            (
                SampleFormat::Ci16,
                [16384i16.to_le_bytes(), (-32768i16).to_le_bytes()].concat(),
            ),
            (SampleFormat::Ci8, vec![64, 128]),
        ] {
            let mut framing = framing(format, &[0]);
            framing.interleaved(&bytes);
            assert_eq!(blocks(&framing)[0].antennas, [[one]]);
        }
        let mut framing = framing(SampleFormat::Cf32, &[0]);
        framing.interleaved(&[f32::NAN.to_le_bytes(), 1f32.to_le_bytes()].concat());
        assert_eq!(blocks(&framing)[0].antennas, [[Complex32::ZERO]]);
        assert_eq!(framing.health.defects(), 1);
    }

    #[test]
    fn only_samples_of_the_receive_window_are_delivered() {
        let mut framing = framing(SampleFormat::Ci8, &[0]);
        framing.gate.set([5.0 + 100e-6, 5.0 + 300e-6]);
        for _ in 0..10 {
            framing.interleaved(&[1; 2 * 64]);
        }
        let found = blocks(&framing);
        let count: usize = found.iter().map(|it| it.antennas[0].len()).sum();
        assert!((199..=201).contains(&count), "{count}");
        assert!((found[0].time_s - (5.0 + 100e-6)).abs() < 1.5e-6);
    }

    #[test]
    fn dropped_samples_are_counted_and_reported_at_the_end_of_a_window() {
        let mut framing = framing(SampleFormat::Ci8, &[0]);
        assert_eq!([framing.unwanted(), framing.deferrable()], [0, 0]);
        framing.gate.set([5.0 + 100.5e-6, 5.0 + 300.5e-6]);
        assert_eq!([framing.unwanted(), framing.deferrable()], [100, 300]);
        framing.pass_over(60);
        framing.pass_over(30);
        assert_eq!([framing.unwanted(), framing.deferrable()], [10, 210]);
        framing.interleaved(&[1; 2 * 210]);
        assert_eq!([framing.unwanted(), framing.deferrable()], [0, 0]);
        framing.pass_over(10);
        assert_eq!(framing.unwanted(), MAX_FRAMES);
        // Expected inputs: the first report, the report before the window, the required samples,
        // and the end of the window.
        let times_s: Vec<f64> = std::iter::from_fn(|| framing.inbox.take(Duration::ZERO))
            .map(|(_, input)| match input {
                Input::Slept(until_s) => until_s,
                Input::Samples(block) => block.time_s,
                other => panic!("{other:?}"),
            })
            .collect();
        for (time_s, expected) in times_s.iter().zip([60.0, 100.0, 310.0]) {
            assert!((time_s - 5.0 - 1e-6 * expected).abs() < 2e-6, "{times_s:?}");
        }
        assert_eq!(times_s.len(), 3);
    }
}
