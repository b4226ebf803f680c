//! Time stamps that are not times of the drive.

/// Minimum time in seconds that is interpreted as seconds since 1970 (the year 1973) instead of
/// since the start of a clock.
const EPOCH_S: f64 = 1e8;
/// Minimum gap in seconds after a leading time of 0 that was not set.
const MIN_GAP_S: f64 = 1.0;
/// Minimum gap after a leading time of 0 that was not set, in median time steps.
const MIN_GAP_STEPS: f64 = 5.0;

/// Defect of a time stamp.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TimeFault {
    /// The time is before the clock was set: 0 before the first time, or a small number before
    /// times since 1970.
    NotSet,
    /// The time is far ahead of the previous and following times.
    Ahead,
}

/// Returns the defect of each time of a file in order. Times that are not finite have no defect
/// here.
pub fn time_faults(times_s: &[f64]) -> Vec<Option<TimeFault>> {
    let mut faults = vec![None; times_s.len()];
    let gap_s = MIN_GAP_S.max(MIN_GAP_STEPS * usual_step_s(times_s));
    let unset = leading_unset(times_s, gap_s);
    for fault in faults.iter_mut().take(unset) {
        *fault = Some(TimeFault::NotSet);
    }
    let later = times_s.iter().enumerate().skip(unset);
    let finite: Vec<(usize, f64)> = later
        .map(|(k, it)| (k, *it))
        .filter(|it| it.1.is_finite())
        .collect();
    for around in finite.windows(3) {
        let &[(_, before_s), (index, time_s), (_, after_s)] = around else {
            continue;
        };
        let is_between = after_s > before_s && after_s - before_s < gap_s;
        if is_between
            && time_s - before_s > gap_s
            && time_s - after_s > gap_s
            && let Some(fault) = faults.get_mut(index)
        {
            *fault = Some(TimeFault::Ahead);
        }
    }
    faults
}

/// Returns the number of leading times from before the clock was set; 0 if they are more than half
/// of all.
fn leading_unset(times_s: &[f64], gap_s: f64) -> usize {
    let is_before = |times: &&f64| times.abs() < EPOCH_S || times.is_nan();
    let mut count = times_s.iter().take_while(is_before).count();
    if count == times_s.len() {
        count = times_s.iter().take_while(|it| **it == 0.0).count();
        if times_s.get(count).is_none_or(|first_s| *first_s < gap_s) {
            return 0;
        }
    }
    // Times since 1970 occur in sequence; a single one is a defect itself.
    let since_1970 = times_s.iter().filter(|it| **it >= EPOCH_S).count();
    let is_single = 0 < since_1970 && 2 * since_1970 < times_s.len();
    if 2 * count > times_s.len() || is_single {
        0
    } else {
        count
    }
}

/// Returns the median of the positive differences of successive times (s).
fn usual_step_s(times_s: &[f64]) -> f64 {
    let steps = times_s.windows(2).filter_map(|pair| match pair {
        [a, b] => Some(b - a),
        _ => None,
    });
    let mut steps_s: Vec<f64> = steps.filter(|it| *it > 0.0).collect();
    steps_s.sort_by(f64::total_cmp);
    steps_s.get(steps_s.len() / 2).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn faulty(times_s: &[f64]) -> Vec<(usize, TimeFault)> {
        let faults = time_faults(times_s).into_iter().enumerate();
        faults.filter_map(|(k, fault)| Some((k, fault?))).collect()
    }

    #[test]
    fn times_before_the_clock_was_set_are_detected() {
        let since_1970 = |k: i32| 1.7e9 + 0.1 * f64::from(k);
        let mut times_s: Vec<f64> = (0..50).map(since_1970).collect();
        assert_eq!(faulty(&times_s), []);
        times_s.splice(0..0, [0.0, 0.0, 3.5]);
        let unset = |k| (k, TimeFault::NotSet);
        assert_eq!(faulty(&times_s), [unset(0), unset(1), unset(2)]);
        // The clock of a simulator starts at any time.
        let mut times_s: Vec<f64> = (0..50).map(|k| 7.0 + 0.1 * f64::from(k)).collect();
        times_s.splice(0..0, [0.0, 0.0]);
        assert_eq!(faulty(&times_s), [unset(0), unset(1)]);
    }

    #[test]
    fn drives_that_start_at_zero_have_no_defects() {
        for step_s in [0.001, 0.05, 0.5, 50.0] {
            let times_s: Vec<f64> = (0..50).map(|k| step_s * f64::from(k)).collect();
            assert_eq!(faulty(&times_s), [], "{step_s}");
        }
        assert_eq!(faulty(&[]), []);
        assert_eq!(faulty(&[0.0; 9]), []);
    }

    #[test]
    fn a_single_time_far_ahead_is_detected() {
        for ahead_s in [4e9, 5.0] {
            let mut times_s: Vec<f64> = (0..50).map(|k| 0.1 * f64::from(k)).collect();
            times_s[20] += ahead_s;
            assert_eq!(faulty(&times_s), [(20, TimeFault::Ahead)], "{ahead_s}");
        }
    }
}
