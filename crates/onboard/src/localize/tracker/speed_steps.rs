//! Steps of the speed: which of them are the noise of its reading, and which are slip.

/// Share of the newest step in the mean square: a larger one is learnt soon, and forgotten slowly.
const RISE: f64 = 0.2;
const FALL: f64 = 0.01;

/// A step this many times the usual one is not of the usual kind.
const UNUSUAL: f64 = 5.0;

/// The usual step of the speed between two samples.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct SpeedSteps {
    /// Mean square of the steps (m²/s²).
    mean_square: f64,
    /// By which share of the speed the newest one leapt; 0 where it is none.
    leapt: f64,
}

impl SpeedSteps {
    /// By which share of the speed the newest step leapt, where it was above the least that leaps and
    /// none of the usual ones; 0 otherwise.
    pub const fn leapt(&self) -> f64 {
        self.leapt
    }

    /// Takes a step, which leaps where it is above `least_mps` and none of the usual ones; see
    /// [`leapt`](Self::leapt).
    pub fn step(&mut self, from_mps: f64, to_mps: f64, least_mps: f64) {
        self.leapt = 0.0;
        let fastest_mps = from_mps.abs().max(to_mps.abs());
        if fastest_mps == 0.0 {
            return; // standing tells nothing of the reading's noise
        }
        let step_mps = (to_mps - from_mps).abs();
        let unusual_mps = UNUSUAL * self.mean_square.sqrt();
        if step_mps > least_mps.max(unusual_mps) {
            self.leapt = step_mps / fastest_mps;
        }
        let square = step_mps * step_mps;
        let share = if square > self.mean_square {
            RISE
        } else {
            FALL
        };
        self.mean_square += share * (square - self.mean_square);
    }
}
