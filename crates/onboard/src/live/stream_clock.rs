//! Detection of missing samples in a stream, from the times of its blocks.

/// Maximum relative error of a sample rate with respect to the clock of the times.
const RATE_ERROR: f64 = 1e-4;

/// Minimum time by which a block of a restarted stream precedes the end of the last block (s).
const RESTART_S: f64 = 1.0;

/// Returns the resolution of the time of a block, in seconds: the spacing of floating-point numbers
/// at this time, plus one sample.
fn resolution_s(time_s: f64, rate_hz: f64) -> f64 {
    (2.0 * time_s.abs() * f64::EPSILON).max(1.0 / rate_hz)
}

/// Returns the maximum time in seconds between the end of a block of `length` samples and the start
/// of the next block at `time_s`, if they are contiguous. Unix times have a resolution of one sample
/// at 4 Msps.
fn contiguity_tolerance_s(time_s: f64, rate_hz: f64, length: usize) -> f64 {
    2.0 * resolution_s(time_s, rate_hz) + RATE_ERROR * length as f64 / rate_hz
}

/// Relation of a block of samples to the previous one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Continuity {
    /// First block.
    First,
    /// Contiguous with the previous block.
    Contiguous,
    /// After a gap.
    Gap {
        /// Duration of the gap in seconds.
        lost_s: f64,
    },
    /// The first samples are repetitions, and are ignored.
    Overlap,
    /// Block of another or restarted stream: it begins more than a second before the end of the
    /// previous block.
    Restart,
}

/// Counter of a stream's samples, with the time of each sample.
///
/// The times of the blocks are those of the sample clock, counted or from the radio. They may drift
/// by 100 ppm relative to the configured rate; a larger step means missing or repeated samples.
#[derive(Debug, Clone)]
pub struct StreamClock {
    rate_hz: f64,
    /// Index and time of a sample.
    anchor: (u64, f64),
    /// Index of the next sample; `None` before the first.
    next: Option<u64>,
    /// Length of the last block.
    last_length: usize,
}

impl StreamClock {
    /// Creates a clock for a stream of this rate.
    pub const fn new(rate_hz: f64) -> Self {
        Self {
            rate_hz,
            anchor: (0, 0.0),
            next: None,
            last_length: 0,
        }
    }

    /// Returns the sample rate in samples per second.
    pub const fn rate_hz(&self) -> f64 {
        self.rate_hz
    }

    /// Returns the time of a sample, which need not be an integer.
    pub fn time_s(&self, sample: f64) -> f64 {
        let (number, time_s) = self.anchor;
        time_s + (sample - number as f64) / self.rate_hz
    }

    /// Returns the index of the next sample; the first one is 0.
    pub fn next(&self) -> u64 {
        self.next.unwrap_or(0)
    }

    /// Processes a block that begins at `time_s`. Returns its relation to the previous one, and the
    /// number of samples to ignore. Missing samples are counted like received ones.
    pub fn block(&mut self, time_s: f64, length: usize) -> (Continuity, usize) {
        let Some(next) = self.next else {
            *self = Self {
                anchor: (0, time_s),
                next: Some(length as u64),
                last_length: length,
                ..*self
            };
            return (Continuity::First, 0);
        };
        let late_s = time_s - self.time_s(next as f64);
        let resolution_s = resolution_s(time_s, self.rate_hz);
        let tolerance_s = contiguity_tolerance_s(time_s, self.rate_hz, self.last_length);
        let (continuity, left_out) = if late_s.abs() <= tolerance_s {
            self.keep_to(next, time_s, resolution_s);
            (Continuity::Contiguous, 0)
        } else if late_s > 0.0 {
            let first = next + (late_s * self.rate_hz).round() as u64;
            self.next = Some(first);
            self.keep_to(first, time_s, resolution_s);
            (Continuity::Gap { lost_s: late_s }, 0)
        } else if late_s > -RESTART_S {
            let again = (-late_s * self.rate_hz).round() as usize;
            let left_out = again.min(length);
            // The first new sample is at its expected time.
            self.anchor = (next, time_s + again as f64 / self.rate_hz);
            (Continuity::Overlap, left_out)
        } else {
            *self = Self::new(self.rate_hz);
            let _ = self.block(time_s, length);
            return (Continuity::Restart, 0);
        };
        self.next = Some(self.next() + (length - left_out) as u64);
        self.last_length = length;
        (continuity, left_out)
    }

    /// Sets the anchor to this sample, unless its time agrees with the count.
    fn keep_to(&mut self, sample: u64, time_s: f64, resolution_s: f64) {
        if (time_s - self.time_s(sample as f64)).abs() > resolution_s {
            self.anchor = (sample, time_s);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RATE_HZ: f64 = 3.84e6;

    #[test]
    fn counted_times_are_contiguous_for_any_epoch_and_drift() {
        for (epoch_s, drift) in [
            (0.0, 0.0),
            (1.7e9, 0.0),
            (1_795_722_391.123_456_7, 0.0),
            (1.7e9, 5e-5),
            (12.0, -5e-5),
        ] {
            let mut clock = StreamClock::new(RATE_HZ);
            let mut sent = 0_u64;
            for number in 0..20_000 {
                let length = 4000 + number % 7 * 1000;
                let time_s = epoch_s + sent as f64 / RATE_HZ * (1.0 + drift);
                let (continuity, left_out) = clock.block(time_s, length);
                assert!(
                    matches!(continuity, Continuity::First | Continuity::Contiguous),
                    "{epoch_s} {drift} {number}: {continuity:?}"
                );
                assert_eq!(left_out, 0);
                assert!((clock.time_s(sent as f64) - time_s).abs() < 1.5e-6);
                sent += length as u64;
            }
            assert_eq!(clock.next(), sent);
        }
    }

    #[test]
    fn a_lost_packet_is_a_gap() {
        let mut clock = StreamClock::new(RATE_HZ);
        clock.block(1.7e9, 3840);
        let (continuity, left_out) = clock.block(1.7e9 + 1e-3 + 360.0 / RATE_HZ, 3840);
        assert!(
            matches!(continuity, Continuity::Gap { lost_s } if (lost_s * RATE_HZ - 360.0).abs() < 2.0)
        );
        assert_eq!(left_out, 0);
        assert!(clock.next().abs_diff(2 * 3840 + 360) < 2);
    }

    #[test]
    fn repeated_samples_are_omitted_and_a_stream_may_restart() {
        let mut clock = StreamClock::new(RATE_HZ);
        clock.block(5.0, 3840);
        let (continuity, left_out) = clock.block(5.0 + 0.5e-3, 3840);
        assert_eq!((continuity, left_out), (Continuity::Overlap, 1920));
        assert_eq!(clock.next(), 3840 + 1920);
        assert!((clock.time_s(5760.0) - 5.0015).abs() < 1e-9);
        // The whole block.
        assert_eq!(clock.block(5.0, 3840).1, 3840);
        assert_eq!(clock.next(), 5760);
        assert!((clock.time_s(5760.0) - 5.0015).abs() < 1e-9);
        assert_eq!(clock.block(0.0, 3840), (Continuity::Restart, 0));
        assert_eq!(clock.next(), 3840);
        assert!((clock.time_s(3840.0) - 1e-3).abs() < 1e-12);
    }
}
