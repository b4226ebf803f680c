//! Clock of a cell relative to that of the receiver: time of the next SSB, and its uncertainty.
//!
//! Kalman filter with two states: start of the last SSB, and relative clock drift. Carrier and
//! samples derive from one oscillator, so that a frequency offset of `f` at a carrier `F` implies a
//! drift of `−f/F` immediately; later, the times of SSBs determine the drift. Between SSBs the
//! drift is a random walk, due to oscillators and the Doppler effect of a changing speed.

/// Random walk of the drift per square root of second: oscillator and acceleration.
const WANDER_PER_SQRT_S: f64 = 1e-8;
/// Standard deviation of a drift derived from the frequency offset.
const DRIFT_BY_CFO: f64 = 1e-7;
/// Standard deviation of the drift without a known carrier frequency: the worst oscillators.
const DRIFT_UNKNOWN: f64 = 2e-5;
/// Standard deviation of the time from a search, in samples.
const SEARCHED: f64 = 0.1;
/// Minimum standard deviation of any time, due to changing paths, in samples.
const PATHS: f64 = 0.03;

/// Clock tracking loop of one cell.
#[derive(Debug, Clone)]
pub(super) struct ClockLoop {
    base_rate_hz: f64,
    /// First sample of the last SSB.
    last_start: f64,
    /// Relative drift of the cell's clock, in samples per sample; positive if it is slow.
    drift: f64,
    covariance: Covariance,
}

/// Covariance of start and drift, in samples.
#[derive(Debug, Clone, Copy)]
struct Covariance {
    start: f64,
    both: f64,
    drift: f64,
}

impl ClockLoop {
    /// Creates the loop at an SSB from a search, with its frequency offset if the carrier is known.
    pub(super) fn new(start: f64, cfo_hz: f64, carrier_hz: Option<f64>, base_rate_hz: f64) -> Self {
        let drift_by_cfo = carrier_hz.filter(|hz| *hz > 0.0).map(|hz| -cfo_hz / hz);
        let sigma = drift_by_cfo.map_or(DRIFT_UNKNOWN, |_| DRIFT_BY_CFO);
        Self {
            base_rate_hz,
            last_start: start,
            drift: drift_by_cfo.unwrap_or(0.0),
            covariance: Covariance {
                start: SEARCHED * SEARCHED,
                both: 0.0,
                drift: sigma * sigma,
            },
        }
    }

    /// Returns the start of an SSB that is transmitted `samples` of the cell's clock after the last
    /// one.
    pub(super) fn expected_start(&self, samples: f64) -> f64 {
        self.last_start + samples * (1.0 + self.drift)
    }

    /// Returns the time between the last SSB and one that begins at `start`, in samples of the
    /// cell's clock.
    pub(super) fn sent_after(&self, start: f64) -> f64 {
        (start - self.last_start) / (1.0 + self.drift)
    }

    /// Returns the time since the last SSB, in seconds.
    pub(super) fn elapsed_s(&self, start: f64) -> f64 {
        (start - self.last_start).abs() / self.base_rate_hz
    }

    /// Returns the standard deviation of an SSB's start `expected`, in samples.
    pub(super) fn deviation(&self, expected: f64) -> f64 {
        self.predicted(expected).start.sqrt()
    }

    /// Updates with an SSB that was received `late` samples after its expected start, with the
    /// variance `variance`.
    pub(super) fn follow(&mut self, expected: f64, late: f64, variance: f64) {
        let Covariance { start, both, drift } = self.predicted(expected);
        let total = start + variance + PATHS * PATHS;
        let (time_gain, drift_gain) = (start / total, both / total);
        self.last_start = expected + time_gain * late;
        self.drift += drift_gain * late;
        self.covariance = Covariance {
            start: start * (1.0 - time_gain),
            both: both * (1.0 - time_gain),
            drift: drift - drift_gain * both,
        };
    }

    /// Updates with an SSB from a search, transmitted `samples` of the cell's clock after the last
    /// one; the two determine the drift, whatever its previous estimate.
    pub(super) fn found(&mut self, start: f64, samples: f64) {
        let drift = (start - self.last_start) / samples - 1.0;
        if drift.abs() < 10.0 * DRIFT_UNKNOWN {
            self.drift = drift;
            let variance = 2.0 * SEARCHED * SEARCHED;
            self.covariance.drift = variance / (samples * samples) + WANDER_PER_SQRT_S.powi(2);
        }
        self.last_start = start;
        self.covariance.start = SEARCHED * SEARCHED;
        self.covariance.both = 0.0;
    }

    /// Returns the covariance at the expected start of an SSB.
    fn predicted(&self, expected: f64) -> Covariance {
        let elapsed = expected - self.last_start;
        let wander = WANDER_PER_SQRT_S.powi(2) / self.base_rate_hz * elapsed.abs();
        let Covariance { start, both, drift } = self.covariance;
        Covariance {
            start: start + elapsed * (2.0 * both + elapsed * (drift + wander / 3.0)),
            both: both + elapsed * (drift + 0.5 * wander),
            drift: drift + wander,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RATE: f64 = 7.68e6;
    const PERIOD: f64 = 0.02 * RATE;

    #[test]
    fn clock_drift_is_estimated_from_the_frequency_offset_and_corrected_by_times() {
        let mut clock = ClockLoop::new(1000.0, -7000.0, Some(3.5e9), RATE);
        assert!((clock.expected_start(PERIOD) - 1000.0 - PERIOD * (1.0 + 2e-6)).abs() < 1e-6);
        // The truth is 2.3 ppm.
        let truth = |n: f64| 1000.0 + n * PERIOD * (1.0 + 2.3e-6);
        for n in 1..50 {
            let expected = clock.expected_start(PERIOD);
            clock.follow(expected, truth(f64::from(n)) - expected, 1e-4);
        }
        assert!((clock.drift - 2.3e-6).abs() < 2e-9, "{}", clock.drift);
        // The prediction after ten seconds of sleep is within its own uncertainty.
        let expected = clock.expected_start(500.0 * PERIOD);
        let error = (expected - truth(549.0)).abs();
        assert!(error < 4.0 * clock.deviation(expected), "{error}");
        assert!(clock.deviation(expected) < 4.0);
    }

    #[test]
    fn two_searches_detect_a_clock_drift() {
        let mut clock = ClockLoop::new(0.0, 0.0, Some(3.5e9), RATE);
        clock.found(50.0 * PERIOD * (1.0 - 1e-5), 50.0 * PERIOD);
        assert!((clock.drift + 1e-5).abs() < 1e-12);
        // A jump that no drift explains is a new start.
        clock.found(60.0 * PERIOD, 5.0 * PERIOD);
        assert!((clock.drift + 1e-5).abs() < 1e-12);
    }
}
