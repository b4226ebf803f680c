//! Fixed-interval smoother: states of a drive, given all its measurements.
//!
//! Smoother of Rauch, Tung and Striebel (1965) in the form of Bryson and Frazier (Bierman 1973).
//! The information of later measurements is propagated backwards as a vector λ and a matrix Λ. The
//! smoothed state is `x − P λ` with covariance `P − P Λ P`, which is Rauch's result in exact
//! arithmetic. No covariance is inverted, so that exactly known states are permitted, and process
//! noise between two steps need not be recorded.
//!
//! Through a motion with Jacobian `F`: `λ ← Fᵀ λ`, `Λ ← Fᵀ Λ F`. Through a measurement with row
//! `h`, gain `k`, residual `y` and its variance `s`, backwards: `λ ← λ − h (kᵀλ + y/s)`,
//! `Λ ← (I − k h)ᵀ Λ (I − k h) + hᵀh/s`.
//!
//! Measurement errors that are estimated together with the state extend it, one error for each
//! measurement: `n` states and errors in total, of which motions change the states only.

use super::belief::{Gaussian, Matrix};

/// Steps of a filter, in order of time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Journal<const N: usize> {
    entries: Vec<Entry<N>>,
}

#[derive(Clone, Debug, PartialEq)]
enum Entry<const N: usize> {
    Moved(Box<Matrix<N>>),
    Redrawn(Box<Redrawn<N>>),
    Measured(Box<Measurement<N>>),
    OutputState(Box<OutputState<N>>),
}

#[derive(Clone, Debug, PartialEq)]
struct Measurement<const N: usize> {
    row: [f64; N],
    /// Index of the measurement's error, if it is estimated.
    error: Option<usize>,
    /// Gains of states and errors.
    gain: Vec<f64>,
    residual: f64,
    variance: f64,
}

#[derive(Clone, Debug, PartialEq)]
struct Redrawn<const N: usize> {
    error: usize,
    kept: f64,
    row: [f64; N],
}

#[derive(Clone, Debug, PartialEq)]
struct OutputState<const N: usize> {
    time_s: f64,
    belief: Gaussian<N>,
    /// Covariance of each error with the state.
    errors: Vec<[f64; N]>,
}

impl<const N: usize> Measurement<N> {
    /// Returns the measurement row for states and errors.
    fn whole_row(&self) -> Vec<f64> {
        let mut row = vec![0.0; self.gain.len()];
        for (value, by) in row.iter_mut().zip(self.row) {
            *value = by;
        }
        let error = self.error.and_then(|error| row.get_mut(N + error));
        if let Some(value) = error {
            *value = 1.0;
        }
        row
    }
}

impl<const N: usize> Journal<N> {
    /// Records a motion with this Jacobian.
    pub fn moved(&mut self, jacobian: &Matrix<N>) {
        self.entries.push(Entry::Moved(Box::new(*jacobian)));
    }

    /// Records that an error was propagated: the fraction `kept` of its previous value, plus `row`
    /// times the state.
    pub fn redrawn(&mut self, error: usize, kept: f64, row: &[f64; N]) {
        let row = *row;
        let redrawn = Redrawn { error, kept, row };
        self.entries.push(Entry::Redrawn(Box::new(redrawn)));
    }

    /// Records a scalar measurement update of the state, and of the errors if there are any, with
    /// its gains. The variance is that of the innovation.
    pub fn measured(
        &mut self,
        row: &[f64; N],
        error: Option<usize>,
        gain: impl Iterator<Item = f64>,
        residual: f64,
        variance: f64,
    ) {
        self.entries.push(Entry::Measured(Box::new(Measurement {
            row: *row,
            error,
            gain: gain.collect(),
            residual,
            variance,
        })));
    }

    /// Requests the smoothed state at `time_s`. `errors` are the covariances of the errors with the
    /// state.
    pub fn output(
        &mut self,
        time_s: f64,
        belief: &Gaussian<N>,
        errors: impl Iterator<Item = [f64; N]>,
    ) {
        self.entries.push(Entry::OutputState(Box::new(OutputState {
            time_s,
            belief: *belief,
            errors: errors.collect(),
        })));
    }

    /// Returns the requested times in seconds and smoothed states, given all measurements.
    pub fn smoothed(&self) -> Vec<(f64, Gaussian<N>)> {
        let sizes = self.entries.iter().map(|entry| match entry {
            Entry::Measured(measurement) => measurement.gain.len(),
            _ => N,
        });
        let size = sizes.max().unwrap_or(N);
        let mut rest = Rest {
            vector: vec![0.0; size],
            matrix: vec![vec![0.0; size]; size],
        };
        let mut smoothed = Vec::new();
        for entry in self.entries.iter().rev() {
            match entry {
                Entry::Moved(jacobian) => rest.before_motion(jacobian),
                Entry::Redrawn(redrawn) => rest.before_redrawing(redrawn),
                Entry::Measured(measurement) => rest.before_measurement(measurement),
                Entry::OutputState(output) => smoothed.push((output.time_s, rest.improve(output))),
            }
        }
        smoothed.reverse();
        smoothed
    }
}

/// Information of later measurements about states and errors: λ and Λ.
struct Rest {
    vector: Vec<f64>,
    matrix: Vec<Vec<f64>>,
}

impl Rest {
    fn before_motion<const N: usize>(&mut self, jacobian: &Matrix<N>) {
        let size = self.vector.len();
        let mut vector = [0.0; N];
        let mut half = vec![[0.0; N]; size]; // Λ F
        for k in 0..N {
            for j in 0..N {
                // Jacobians of motion are almost the identity: most products are skipped.
                if jacobian[k][j] != 0.0 {
                    vector[j] += jacobian[k][j] * self.vector[k];
                    for i in 0..size {
                        half[i][j] += self.matrix[i][k] * jacobian[k][j];
                    }
                }
            }
        }
        let mut matrix = [[0.0; N]; N];
        for k in 0..N {
            for i in 0..N {
                if jacobian[k][i] != 0.0 {
                    for j in 0..N {
                        matrix[i][j] += jacobian[k][i] * half[k][j];
                    }
                }
            }
        }
        for i in 0..N {
            self.vector[i] = vector[i];
            self.matrix[i][..N].copy_from_slice(&matrix[i]);
        }
        for i in N..size {
            for j in 0..N {
                self.matrix[i][j] = half[i][j];
                self.matrix[j][i] = half[i][j];
            }
        }
    }

    fn before_redrawing<const N: usize>(&mut self, seen: &Redrawn<N>) {
        let (error, size) = (N + seen.error, self.vector.len());
        // One column of Λ F, and one row of Fᵀ Λ F, at a time.
        for i in 0..size {
            for j in 0..N {
                self.matrix[i][j] += self.matrix[i][error] * seen.row[j];
            }
            self.matrix[i][error] *= seen.kept;
        }
        for j in 0..N {
            self.vector[j] += seen.row[j] * self.vector[error];
            for i in 0..size {
                self.matrix[j][i] += seen.row[j] * self.matrix[error][i];
            }
        }
        self.vector[error] *= seen.kept;
        for i in 0..size {
            self.matrix[error][i] *= seen.kept;
        }
    }

    fn before_measurement<const N: usize>(&mut self, seen: &Measurement<N>) {
        let (row, gain, size) = (seen.whole_row(), &seen.gain, seen.gain.len());
        let (mut gain_projection, mut gain_variance) = (0.0, 0.0);
        let mut cross = vec![0.0; size]; // Λ k
        for i in 0..size {
            gain_projection += gain[i] * self.vector[i];
            for j in 0..size {
                cross[i] += self.matrix[i][j] * gain[j];
            }
            gain_variance += gain[i] * cross[i];
        }
        let vector_weight = gain_projection + seen.residual / seen.variance;
        let weight = gain_variance + 1.0 / seen.variance;
        for i in 0..size {
            self.vector[i] -= row[i] * vector_weight;
            for j in 0..size {
                self.matrix[i][j] +=
                    weight * row[i] * row[j] - row[i] * cross[j] - cross[i] * row[j];
            }
        }
    }

    fn improve<const N: usize>(&self, output: &OutputState<N>) -> Gaussian<N> {
        let size = self.vector.len();
        // Covariance of the state with states and errors.
        let covariance = |i: usize, k: usize| {
            let states = output.belief.covariance[i].get(k);
            let error = || output.errors.get(k - N).map(|with| with[i]);
            states.copied().or_else(error).unwrap_or_default()
        };
        let mut improved = output.belief;
        let mut half = vec![vec![0.0; size]; N]; // P Λ
        for i in 0..N {
            for k in 0..size {
                let p = covariance(i, k);
                improved.mean[i] -= p * self.vector[k];
                for j in 0..size {
                    half[i][j] += p * self.matrix[k][j];
                }
            }
        }
        for i in 0..N {
            for j in i..N {
                let less: f64 = (0..size).map(|k| half[i][k] * covariance(j, k)).sum();
                improved.covariance[i][j] -= less;
                improved.covariance[j][i] = improved.covariance[i][j];
            }
        }
        improved
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gaussian::identity;

    const STEPS: usize = 7;
    const SIZE: usize = 2 * STEPS;

    /// Returns the inverse of a positive definite matrix (Gauss–Jordan in place).
    fn inverse(mut a: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
        let n = a.len();
        for (i, row) in a.iter_mut().enumerate() {
            row.extend((0..n).map(|j| f64::from(u8::from(i == j))));
        }
        for pivot in 0..n {
            let scale = a[pivot][pivot].recip();
            a[pivot].iter_mut().for_each(|value| *value *= scale);
            let pivot_row = a[pivot].clone();
            for (i, row) in a.iter_mut().enumerate() {
                let factor = row[pivot];
                if i != pivot {
                    for (value, other) in row.iter_mut().zip(&pivot_row) {
                        *value -= factor * other;
                    }
                }
            }
        }
        a.iter().map(|row| row[n..].to_vec()).collect()
    }

    /// Adds `rowᵀ row / variance` and `rowᵀ value / variance` to the normal equations.
    fn observe(
        information: &mut [Vec<f64>],
        right: &mut [f64],
        row: &[(usize, f64)],
        value: f64,
        variance: f64,
    ) {
        for &(i, a) in row {
            right[i] += a * value / variance;
            for &(j, b) in row {
                information[i][j] += a * b / variance;
            }
        }
    }

    /// Updates a Gaussian with a measurement, and records it in the journal.
    fn measure<const N: usize>(
        journal: &mut Journal<N>,
        belief: &mut Gaussian<N>,
        residual: f64,
        row: &[f64; N],
        variance: f64,
    ) {
        let total = belief.variance_along(row) + variance;
        let gain = belief.update(residual, row, variance);
        journal.measured(row, None, gain.into_iter(), residual, total);
    }

    #[test]
    fn a_linear_drive_is_smoothed_as_by_least_squares_over_all_of_it() {
        // Position and speed with noise on both; a mixture of both is measured.
        let f = [[1.0, 0.5], [-0.1, 0.9]];
        let q = [[0.04, 0.0], [0.0, 0.3]];
        let prior = Gaussian {
            mean: [1.0, -0.5],
            covariance: [[2.0, 0.0], [0.0, 0.7]],
        };
        let seen = |step: usize| (1.3 * (step as f64 * 1.7).sin(), 0.2 + 0.1 * step as f64);

        let mut information = vec![vec![0.0; SIZE]; SIZE];
        let mut right = vec![0.0; SIZE];
        for i in 0..2 {
            let variance = prior.covariance[i][i];
            observe(
                &mut information,
                &mut right,
                &[(i, 1.0)],
                prior.mean[i],
                variance,
            );
        }
        let mut journal = Journal::default();
        let mut belief = prior;
        for step in 0..STEPS {
            let at = 2 * step;
            if step > 0 {
                journal.moved(&f);
                belief.mean = [
                    f[0][0] * belief.mean[0] + f[0][1] * belief.mean[1],
                    f[1][0] * belief.mean[0] + f[1][1] * belief.mean[1],
                ];
                belief.spread(&f, &q);
                for i in 0..2 {
                    let row = [(at + i, 1.0), (at - 2, -f[i][0]), (at - 1, -f[i][1])];
                    observe(&mut information, &mut right, &row, 0.0, q[i][i]);
                }
            }
            // Requested before the measurement of the same time.
            journal.output(step as f64, &belief, std::iter::empty());
            let (value, variance) = seen(step);
            let row = [1.0, 0.4];
            let residual = value - row[0] * belief.mean[0] - row[1] * belief.mean[1];
            measure(&mut journal, &mut belief, residual, &row, variance);
            let sparse = [(at, row[0]), (at + 1, row[1])];
            observe(&mut information, &mut right, &sparse, value, variance);
        }
        let covariance = inverse(information);
        let smoothed = journal.smoothed();
        assert_eq!(smoothed.len(), STEPS);
        for (step, (time_s, smooth)) in smoothed.iter().enumerate() {
            assert_eq!(*time_s, step as f64);
            for i in 0..2 {
                let row = &covariance[2 * step + i];
                let mean: f64 = row.iter().zip(&right).map(|(a, b)| a * b).sum();
                assert!((smooth.mean[i] - mean).abs() < 1e-9);
                for j in 0..2 {
                    assert!((smooth.covariance[i][j] - row[2 * step + j]).abs() < 1e-9);
                }
            }
        }
    }

    #[test]
    fn correlated_biases_are_smoothed_as_if_they_were_part_of_the_state() {
        let (f, kept, by_state) = ([[1.0, 0.5], [-0.1, 0.9]], 0.8, [-0.2, 0.1]);
        let mut whole = Gaussian::independent([1.0, -0.5, 0.2], [1.4, 0.8, 0.3]);
        let (mut separate, mut within) = (Journal::<2>::default(), Journal::<3>::default());
        for step in 0..STEPS {
            let mut motion = [[0.0; 3]; 3];
            motion[0][..2].copy_from_slice(&f[0]);
            motion[1][..2].copy_from_slice(&f[1]);
            motion[2][2] = 1.0;
            let mut redrawing = identity::<3>();
            redrawing[2] = [by_state[0], by_state[1], kept];
            separate.moved(&f);
            separate.redrawn(0, kept, &by_state);
            for motion in [motion, redrawing] {
                within.moved(&motion);
                let before = whole.mean;
                whole.mean = motion.map(|row| row.iter().zip(before).map(|(f, x)| f * x).sum());
                whole.spread(&motion, &[[0.03, 0.0, 0.0], [0.0; 3], [0.0, 0.0, 0.02]]);
            }
            let state = Gaussian {
                mean: [whole.mean[0], whole.mean[1]],
                covariance: [0, 1].map(|i| [whole.covariance[i][0], whole.covariance[i][1]]),
            };
            let error = [whole.covariance[0][2], whole.covariance[1][2]];
            separate.output(step as f64, &state, std::iter::once(error));
            within.output(step as f64, &whole, std::iter::empty());
            // Alternately with the error and without it.
            let error = (step % 2 == 0).then_some(0);
            let row = [1.0, 0.4, error.map_or(0.0, |_| 1.0)];
            let residual = (step as f64 * 1.7).sin();
            let total = whole.variance_along(&row) + 0.3;
            let gain = whole.update(residual, &row, 0.3);
            separate.measured(&[row[0], row[1]], error, gain.into_iter(), residual, total);
            within.measured(&row, None, gain.into_iter(), residual, total);
        }
        for ((_, one), (_, other)) in separate.smoothed().iter().zip(within.smoothed()) {
            for i in 0..2 {
                assert!((one.mean[i] - other.mean[i]).abs() < 1e-12);
                for j in 0..2 {
                    assert!((one.covariance[i][j] - other.covariance[i][j]).abs() < 1e-12);
                }
            }
        }
    }

    #[test]
    fn the_last_state_is_not_changed_by_smoothing() {
        let mut belief = Gaussian::independent([1.0, 2.0], [0.5, 0.0]);
        let mut journal = Journal::default();
        journal.output(0.0, &belief, std::iter::empty());
        measure(&mut journal, &mut belief, 0.3, &[1.0, 1.0], 0.1);
        journal.output(0.0, &belief, std::iter::empty());
        let smoothed = journal.smoothed();
        assert_eq!(smoothed[1].1, belief);
        // Without a motion in between, both states are equal, and exactly known states are
        // unchanged.
        assert!((smoothed[0].1.mean[0] - belief.mean[0]).abs() < 1e-15);
        assert!((smoothed[0].1.covariance[0][0] - belief.covariance[0][0]).abs() < 1e-15);
        assert_eq!(
            (smoothed[0].1.mean[1], smoothed[0].1.covariance[1][1]),
            (2.0, 0.0)
        );
    }
}
