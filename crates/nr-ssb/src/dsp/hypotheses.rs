//! Carrier frequency offsets of the matched filter.

/// Returns offsets from −range to +range with equal spacing of at most `step_hz`, each at the
/// centre of its interval.
pub(crate) fn cfo_hypotheses(range_hz: f64, step_hz: f64) -> Vec<f64> {
    let count = (2.0 * range_hz / step_hz).ceil().max(1.0);
    let width = 2.0 * range_hz / count;
    (0..count as usize)
        .map(|i| width * (i as f64 + 0.5) - range_hz)
        .collect()
}
