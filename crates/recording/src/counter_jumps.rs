//! Impossible steps of a distance counter: overflows, resets and spikes.
//!
//! A speed derived from an impossible step would be wrong as well. The step is replaced by the
//! speed of its neighbours, so that distance, speed and yaw rate remain correct.

/// Number of steps on each side that determine the usual speed.
const NEIGHBOURS: usize = 3;
/// Maximum acceleration of a vehicle (m/s²), which limits the change of speed across the
/// neighbours.
const MAX_ACCELERATION_MPS2: f64 = 10.0;
/// Maximum deviation (m) that is attributed to the resolution of a counter.
const RESOLUTION_M: f64 = 0.1;
/// Minimum ratio of a jump to the 95th percentile of all nonzero steps, so that a counter of coarse
/// resolution has no jumps.
const TIMES_USUAL: f64 = 3.0;

/// Replaced step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Jump {
    /// Index of the sample at the end of the step.
    pub index: usize,
    /// Step in the file (m).
    pub step_m: f64,
    /// Speed of the neighbouring steps (m/s), used instead.
    pub speed_mps: f64,
}

/// Replaces the jumps of a distance (m) at strictly increasing times in place. A distance without
/// jumps is not changed.
pub fn replace_jumps(times_s: &[f64], distances_m: &mut [f64]) -> Vec<Jump> {
    let steps: Vec<(f64, f64)> = times_s
        .windows(2)
        .zip(distances_m.windows(2))
        .filter_map(|(times, distances)| match (times, distances) {
            ([t0, t1], [d0, d1]) => Some((t1 - t0, d1 - d0)),
            _ => None,
        })
        .collect();
    let lengths_m = steps.iter().map(|step| step.1.abs());
    let mut sorted_m: Vec<f64> = lengths_m.filter(|it| *it > 0.0).collect();
    sorted_m.sort_by(f64::total_cmp);
    let usual_m = sorted_m
        .get(sorted_m.len() * 95 / 100)
        .copied()
        .unwrap_or(0.0);
    let mut jumps = Vec::new();
    for (k, &(step_s, step_m)) in steps.iter().enumerate() {
        let Some(speed_mps) = neighbours_mps(&steps, k) else {
            continue;
        };
        let max_change_mps = MAX_ACCELERATION_MPS2 * NEIGHBOURS as f64 * step_s;
        let max_m = RESOLUTION_M + max_change_mps * step_s;
        if (step_m - speed_mps * step_s).abs() > max_m && step_m.abs() > TIMES_USUAL * usual_m {
            jumps.push(Jump {
                index: k + 1,
                step_m,
                speed_mps,
            });
        }
    }
    let mut jump = jumps.iter().peekable();
    let mut offset_m = 0.0;
    for (index, distance_m) in distances_m.iter_mut().enumerate() {
        if let Some(it) = jump.next_if(|it| it.index == index) {
            let step_s = steps.get(index - 1).map_or(0.0, |step| step.0);
            offset_m += it.speed_mps * step_s - it.step_m;
        }
        if offset_m != 0.0 {
            *distance_m += offset_m;
        }
    }
    jumps
}

/// Returns the median speed of the neighbouring steps (m/s); `None` if there are too few.
fn neighbours_mps(steps: &[(f64, f64)], k: usize) -> Option<f64> {
    let around = k.saturating_sub(NEIGHBOURS)..=k + NEIGHBOURS;
    let near = steps
        .iter()
        .enumerate()
        .filter(|(index, _)| around.contains(index) && *index != k);
    let mut speeds_mps: Vec<f64> = near.map(|(_, (step_s, step_m))| step_m / step_s).collect();
    if speeds_mps.len() < NEIGHBOURS {
        return None;
    }
    speeds_mps.sort_by(f64::total_cmp);
    let middle = speeds_mps.len() / 2;
    let pair = speeds_mps
        .get(middle)
        .zip(speeds_mps.get(middle.saturating_sub(1)));
    let pair = pair.map(|(a, b)| (*a, *b));
    pair.map(|(a, b)| {
        if speeds_mps.len() % 2 == 1 {
            a
        } else {
            0.5 * (a + b)
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns times and distances of a vehicle that starts, drives at 1 m/s, stops and reverses.
    fn driven(rate_hz: f64) -> (Vec<f64>, Vec<f64>) {
        let times_s: Vec<f64> = (0..400).map(|k| f64::from(k) / rate_hz).collect();
        let speed = |time_s: f64| match (time_s * rate_hz) as usize {
            0..50 | 200..230 => 0.0,
            50..200 => 1.0,
            _ => -1.0,
        };
        let mut distance_m = 0.0;
        let add = |time_s: &f64| {
            distance_m += speed(*time_s) / rate_hz;
            distance_m
        };
        let distances_m = times_s.iter().map(add).collect();
        (times_s, distances_m)
    }

    #[test]
    fn a_drive_without_jumps_is_not_changed() {
        for rate_hz in [1.0, 5.0, 20.0, 100.0] {
            let (times_s, given_m) = driven(rate_hz);
            for tick_m in [1e-9, 0.01, 0.25, 1.0] {
                let ticks: Vec<f64> = given_m
                    .iter()
                    .map(|it| (it / tick_m).round() * tick_m)
                    .collect();
                let mut distances_m = ticks.clone();
                assert_eq!(
                    replace_jumps(&times_s, &mut distances_m),
                    [],
                    "{rate_hz} Hz, {tick_m} m"
                );
                assert_eq!(distances_m, ticks);
            }
        }
    }

    #[test]
    fn overflows_resets_and_spikes_are_replaced() {
        type Spoil = fn(usize, f64) -> f64;
        let faults: [Spoil; 4] = [
            |k, it| if k >= 120 { it - 65.536 } else { it },
            |k, it| if k >= 120 { it - 12.0 } else { it },
            |k, it| if k == 120 { it + 40.0 } else { it },
            |k, it| if k >= 300 { it + 4.0 } else { it },
        ];
        for rate_hz in [5.0, 20.0, 100.0] {
            let (times_s, given_m) = driven(rate_hz);
            for (number, spoil) in faults.iter().enumerate() {
                let corrupted = given_m.iter().enumerate().map(|(k, it)| spoil(k, *it));
                let mut distances_m: Vec<f64> = corrupted.collect();
                let jumps = replace_jumps(&times_s, &mut distances_m);
                assert_eq!(
                    jumps.len(),
                    if number == 2 { 2 } else { 1 },
                    "{rate_hz} Hz, {number}"
                );
                for (found, given) in distances_m.iter().zip(&given_m) {
                    assert!((found - given).abs() < 1e-6, "{rate_hz} Hz, {number}");
                }
            }
        }
    }
}
