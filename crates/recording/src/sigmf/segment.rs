//! Segments of a recording with one centre frequency and without a gap.

use super::metadata::Capture;
use super::timeline::Position;

/// Maximum difference of equal frequencies (Hz).
const SAME_HZ: f64 = 0.5;

/// Contiguous samples with one centre frequency.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Segment {
    /// Index of the first sample.
    pub start: u64,
    /// Number of samples.
    pub length: u64,
    /// Centre frequency (Hz); `None` if no capture contains it.
    pub centre_frequency_hz: Option<f64>,
    /// Index of the first capture of the segment.
    pub capture: usize,
    /// Number of the first sample since the start of the receiver.
    pub number: u64,
    /// Resolution of the dates (s) that determine the gap before the segment; `None` if `core:global_index` determines
    /// it, or without a gap.
    pub gap_resolution_s: Option<f64>,
}

impl Segment {
    /// Returns the number of a sample of the file since the start of the receiver.
    pub fn number_of(&self, sample: u64) -> u64 {
        self.number
            .saturating_add(sample.saturating_sub(self.start))
    }

    /// Whether another segment has the same centre frequency.
    pub fn has_frequency_of(&self, other: &Self) -> bool {
        match (self.centre_frequency_hz, other.centre_frequency_hz) {
            (Some(a), Some(b)) => (a - b).abs() < SAME_HZ,
            (a, b) => a == b,
        }
    }
}

/// Returns the segments of a recording of `length` samples in order. A capture without a frequency continues the
/// previous segment. A capture whose position differs from the end of the previous samples begins after a gap.
pub fn segments(captures: &[Capture], positions: &[Position], length: u64) -> Vec<Segment> {
    let first_hz = captures.iter().find_map(|it| it.frequency_hz);
    let begin = captures.first().zip(positions.first());
    let mut segments = vec![Segment {
        start: 0,
        length,
        centre_frequency_hz: first_hz,
        capture: 0,
        number: begin.map_or(0, |(it, at)| at.number.saturating_sub(it.sample_start)),
        gap_resolution_s: None,
    }];
    for (index, (capture, position)) in captures.iter().zip(positions).enumerate().skip(1) {
        let start = capture.sample_start.min(length);
        let Some(last) = segments.last_mut() else {
            continue;
        };
        let expected = last.number_of(start);
        let next = Segment {
            start,
            length: length - start,
            centre_frequency_hz: capture.frequency_hz.or(last.centre_frequency_hz),
            capture: index,
            number: position.number,
            gap_resolution_s: position.gap_resolution_s,
        };
        if position.number == expected && next.has_frequency_of(last) {
            continue;
        }
        last.length = start - last.start;
        segments.push(next);
    }
    segments.retain(|it| it.length > 0);
    segments
}

#[cfg(test)]
mod tests {
    use super::super::timeline::positions;
    use super::*;

    fn segments_of_100(captures: &[Capture]) -> Vec<Segment> {
        segments(captures, &positions(captures, 1e6).unwrap(), 100)
    }

    #[test]
    fn segments_begin_where_the_frequency_changes() {
        let capture = |sample_start: u64, frequency_hz: Option<f64>| Capture {
            sample_start,
            frequency_hz,
            ..Capture::default()
        };
        let found = |captures: &[Capture]| -> Vec<(u64, u64, Option<f64>)> {
            let segments = segments_of_100(captures).into_iter();
            segments
                .map(|it| (it.start, it.length, it.centre_frequency_hz))
                .collect()
        };
        let (a, b) = (Some(3.5e9), Some(3.6e9));
        assert_eq!(found(&[]), [(0, 100, None)]);
        assert_eq!(
            found(&[capture(0, a), capture(40, a), capture(70, None)]),
            [(0, 100, a)]
        );
        assert_eq!(
            found(&[capture(0, a), capture(40, b)]),
            [(0, 40, a), (40, 60, b)]
        );
        let hops = [
            capture(0, a),
            capture(40, b),
            capture(60, None),
            capture(80, a),
        ];
        assert_eq!(found(&hops), [(0, 40, a), (40, 40, b), (80, 20, a)]);
        assert_eq!(found(&[capture(0, None), capture(10, b)]), [(0, 100, b)]);
    }

    #[test]
    fn segments_begin_after_gaps() {
        let capture = |sample_start: u64, global_index: Option<u64>| {
            let index = global_index.map(|it| ("core:global_index".to_owned(), it.into()));
            Capture {
                sample_start,
                frequency_hz: Some(3.5e9),
                other: index.into_iter().collect(),
            }
        };
        let found = |captures: &[Capture]| -> Vec<(u64, u64, usize)> {
            let segments = segments_of_100(captures).into_iter();
            segments
                .map(|it| (it.start, it.length, it.capture))
                .collect()
        };
        // A count that begins at any number, and goes on.
        let contiguous = [
            capture(0, Some(7000)),
            capture(40, None),
            capture(60, Some(7060)),
        ];
        assert_eq!(found(&contiguous), [(0, 100, 0)]);
        let gaps = [
            capture(0, Some(7000)),
            capture(40, Some(7041)),
            capture(60, Some(7061)),
            capture(80, Some(9000)),
        ];
        assert_eq!(found(&gaps), [(0, 40, 0), (40, 40, 1), (80, 20, 3)]);
    }
}
