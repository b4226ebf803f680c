//! Segments of a recording with one centre frequency.

use super::metadata::Capture;

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
}

/// Returns the segments of a recording of `length` samples in order. A capture without a frequency
/// continues the previous segment.
pub fn segments(captures: &[Capture], length: u64) -> Vec<Segment> {
    let first_hz = captures.iter().find_map(|it| it.frequency_hz);
    let mut segments = vec![Segment {
        start: 0,
        length,
        centre_frequency_hz: first_hz,
        capture: 0,
    }];
    for (index, capture) in captures.iter().enumerate() {
        let (Some(hz), Some(last)) = (capture.frequency_hz, segments.last_mut()) else {
            continue;
        };
        let is_same = last
            .centre_frequency_hz
            .is_some_and(|it| (it - hz).abs() < SAME_HZ);
        if is_same {
            continue;
        }
        let start = capture.sample_start.min(length);
        last.length = start - last.start;
        segments.push(Segment {
            start,
            length: length - start,
            centre_frequency_hz: Some(hz),
            capture: index,
        });
    }
    segments.retain(|it| it.length > 0);
    segments
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn segments_begin_where_the_frequency_changes() {
        let capture = |sample_start: u64, frequency_hz: Option<f64>| Capture {
            sample_start,
            frequency_hz,
            ..Capture::default()
        };
        let found = |captures: &[Capture]| -> Vec<(u64, u64, Option<f64>)> {
            let segments = segments(captures, 100).into_iter();
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
}
