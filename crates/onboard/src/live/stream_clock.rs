//! Which samples of a stream are missing, by the times of its blocks.

/// Largest error of a sample rate beside the clock that gives the times, relative.
const RATE_ERROR: f64 = 1e-4;

/// A block that begins so much before the end of the last one (s) is of a stream that began anew.
const RESTART_S: f64 = 1.0;

/// How a block of samples goes on from the one before.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Continuity {
    /// The first of all.
    First,
    /// Where the last one ended.
    Contiguous,
    /// After so many seconds of which there are no samples.
    Gap {
        /// Length of the gap in seconds.
        lost_s: f64,
    },
    /// So many of its first seconds were there already and are left out.
    Overlap {
        /// Length of what is left out in seconds.
        again_s: f64,
    },
    /// It is of another stream, or of the same that began anew: from more than a second before.
    Restart,
}

/// Counts a stream's samples and knows the time of each.
///
/// The times of blocks are those of the sample clock: by counting, or a radio's own. They may drift by
/// 100 ppm against the stated rate; a step beyond that is samples that are missing, or there twice.
#[derive(Debug, Clone)]
pub struct StreamClock {
    rate_hz: f64,
    /// Number and time of a sample.
    anchor: (u64, f64),
    /// Number of the next one; `None` before the first.
    next: Option<u64>,
    /// Length of the last block.
    last_length: usize,
}

impl StreamClock {
    /// Before the first block of a stream of this rate.
    pub const fn new(rate_hz: f64) -> Self {
        Self {
            rate_hz,
            anchor: (0, 0.0),
            next: None,
            last_length: 0,
        }
    }

    /// Samples per second.
    pub const fn rate_hz(&self) -> f64 {
        self.rate_hz
    }

    /// Time of a sample, which need not be a whole number.
    pub fn time_s(&self, sample: f64) -> f64 {
        let (number, time_s) = self.anchor;
        time_s + (sample - number as f64) / self.rate_hz
    }

    /// Number of the next sample; the first of all is 0.
    pub fn next(&self) -> u64 {
        self.next.unwrap_or(0)
    }

    /// Takes in a block that begins at `time_s`: how it goes on, and how many of its samples are to be
    /// left out. Those that are missing are counted as if they had come.
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
        // What the time's own digits and a sample leave open.
        let resolution_s = (2.0 * time_s.abs() * f64::EPSILON).max(1.0 / self.rate_hz);
        let drift_s = RATE_ERROR * self.last_length as f64 / self.rate_hz;
        let (continuity, left_out) = if late_s.abs() <= 2.0 * resolution_s + drift_s {
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
            // The first that is new comes where it is expected.
            self.anchor = (next, time_s + again as f64 / self.rate_hz);
            let again_s = left_out as f64 / self.rate_hz;
            (Continuity::Overlap { again_s }, left_out)
        } else {
            *self = Self::new(self.rate_hz);
            let _ = self.block(time_s, length);
            return (Continuity::Restart, 0);
        };
        self.next = Some(self.next() + (length - left_out) as u64);
        self.last_length = length;
        (continuity, left_out)
    }

    /// Counts from this sample on, unless its time is what counting says.
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
    fn times_by_counting_are_contiguous_whatever_the_epoch_and_the_drift() {
        for (epoch_s, drift) in [(0.0, 0.0), (1.7e9, 0.0), (1.7e9, 5e-5), (12.0, -5e-5)] {
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
    fn a_packet_of_a_radio_that_is_lost_is_a_gap() {
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
    fn what_was_there_already_is_left_out_and_a_stream_may_begin_anew() {
        let mut clock = StreamClock::new(RATE_HZ);
        clock.block(5.0, 3840);
        let (continuity, left_out) = clock.block(5.0 + 0.5e-3, 3840);
        assert!(
            matches!(continuity, Continuity::Overlap { .. }),
            "{continuity:?}"
        );
        assert_eq!((left_out, clock.next()), (1920, 3840 + 1920));
        assert!((clock.time_s(5760.0) - 5.0015).abs() < 1e-9);
        // All of it.
        assert_eq!(clock.block(5.0, 3840).1, 3840);
        assert_eq!(clock.next(), 5760);
        assert!((clock.time_s(5760.0) - 5.0015).abs() < 1e-9);
        assert_eq!(clock.block(0.0, 3840), (Continuity::Restart, 0));
        assert_eq!(clock.next(), 3840);
        assert!((clock.time_s(3840.0) - 1e-3).abs() < 1e-12);
    }
}
