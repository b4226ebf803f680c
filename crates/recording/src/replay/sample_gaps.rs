//! Samples that are missing from a recording, by the times of its SSBs: each cell sends its SSBs
//! with a period that is a whole number of half frames (TS 38.213, 4.1), so that a jump in their
//! phase is time that was not recorded.

use std::collections::BTreeMap;

use super::evidence::HeadId;

/// Half a frame (s).
const HALF_FRAME_S: f64 = 5e-3;

/// How far the times of SSBs may stray, and per second between two by the clocks' rates.
const JITTER_S: f64 = 50e-6;
const CLOCKS: f64 = 1e-4;

/// Time that was not recorded.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SampleGap {
    /// Times (s), by the samples that are there, of the last SSB before it and the first after it.
    pub between_s: [f64; 2],
    /// How long it is, but for whole periods of the SSB (s).
    pub lost_s: f64,
}

/// The gaps that the times of SSBs betray, in order of time. A jump counts that lasts: the SSBs
/// before it, and those after it, keep their period.
pub fn sample_gaps(ssbs: &[(HeadId, f64)]) -> Vec<SampleGap> {
    let mut cells: BTreeMap<HeadId, Vec<f64>> = BTreeMap::new();
    for (cell, time_s) in ssbs {
        cells.entry(*cell).or_default().push(*time_s);
    }
    let mut jumps: Vec<SampleGap> = cells
        .values()
        .flat_map(|times_s| jumps_of(times_s))
        .collect();
    jumps.sort_by(|one, other| one.between_s[1].total_cmp(&other.between_s[1]));
    let mut gaps: Vec<SampleGap> = Vec::new();
    for jump in jumps {
        match gaps.last_mut() {
            // Another cell tells of the same.
            Some(last) if jump.between_s[0] < last.between_s[1] => {
                last.between_s[0] = last.between_s[0].max(jump.between_s[0]);
                last.lost_s = last.lost_s.max(jump.lost_s);
            }
            _ => gaps.push(jump),
        }
    }
    gaps
}

/// Jumps in the phase of one cell's SSBs.
fn jumps_of(times_s: &[f64]) -> Vec<SampleGap> {
    let half_frames = |apart_s: f64| (apart_s / HALF_FRAME_S).round().max(1.0);
    let is_regular = |apart_s: f64, period_s: f64| {
        (apart_s - (apart_s / period_s).round() * period_s).abs() < JITTER_S + CLOCKS * apart_s
    };
    let apart_s: Vec<f64> = times_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let regular = apart_s.iter().filter(|it| is_regular(**it, HALF_FRAME_S));
    let period_s = regular
        .map(|it| half_frames(*it))
        .fold(f64::INFINITY, f64::min)
        * HALF_FRAME_S;
    if !period_s.is_finite() {
        return Vec::new();
    }
    let windows = times_s.windows(4).zip(apart_s.windows(3));
    let jump = |(times_s, apart_s): (&[f64], &[f64])| {
        let (&[_, after_s, before_s, _], &[first_s, second_s, third_s]) = (times_s, apart_s) else {
            return None;
        };
        let keeps = |apart_s| is_regular(apart_s, period_s);
        (keeps(first_s) && !keeps(second_s) && keeps(third_s)).then(|| SampleGap {
            between_s: [after_s, before_s],
            lost_s: (-second_s).rem_euclid(period_s),
        })
    };
    windows.filter_map(jump).collect()
}

/// Time that was lost before a time of the samples that are there.
pub fn lost_before_s(gaps: &[SampleGap], time_s: f64) -> f64 {
    let before = gaps.iter().filter(|gap| gap.between_s[1] <= time_s);
    before.map(|gap| gap.lost_s).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// SSBs of two cells every 20 ms by a clock that is 10 ppm off, without what falls into gaps.
    fn heard(gaps: &[(f64, f64)]) -> Vec<(HeadId, f64)> {
        let mut heard = Vec::new();
        for number in 0..1000 {
            for (pci, offset_s) in [(1, 0.0), (2, 0.0013)] {
                let sent_s = f64::from(number) * 0.02 + offset_s;
                let lost = gaps.iter().filter(|(at_s, _)| *at_s < sent_s);
                let lost_s: f64 = lost.map(|(_, lost_s)| lost_s).sum();
                let is_lost =
                    |(at_s, lost_s): &(f64, f64)| sent_s > *at_s && sent_s < at_s + lost_s;
                // Some are not heard.
                if !gaps.iter().any(is_lost) && (number + i32::from(pci)) % 7 != 0 {
                    heard.push(((pci, 0), (sent_s - lost_s) * (1.0 + 1e-5)));
                }
            }
        }
        heard
    }

    #[test]
    fn what_was_not_recorded_is_found_and_its_length() {
        assert_eq!(sample_gaps(&heard(&[])), []);
        let gaps = sample_gaps(&heard(&[(5.003, 0.007), (10.004, 0.007), (15.0, 0.0115)]));
        let lost: Vec<f64> = gaps.iter().map(|it| it.lost_s).collect();
        assert_eq!(lost.len(), 3, "{gaps:?}");
        for (lost_s, is_s) in lost.iter().zip([0.007, 0.007, 0.0115]) {
            assert!((lost_s - is_s).abs() < 1e-5, "{lost_s} {is_s}");
        }
        assert!((lost_before_s(&gaps, 12.0) - 0.014).abs() < 2e-5);
        assert!(lost_before_s(&gaps, 4.9) < 1e-12);
    }

    #[test]
    fn a_single_false_alarm_is_no_gap() {
        let mut heard = heard(&[]);
        heard[500].1 += 0.0031;
        assert_eq!(sample_gaps(&heard), []);
    }
}
