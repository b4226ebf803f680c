//! Where the vehicle was, as seen from the end of the drive: a fixed-interval smoother.
//!
//! The smoother of Rauch, Tung and Striebel (1965) over the steps that a filter took, in the form of
//! Bryson and Frazier (Bierman 1973): what the rest of the drive says of a state is carried
//! backwards as a vector λ and a matrix Λ, and the smoothed state is
//! `x − P λ` with covariance `P − P Λ P`. In exact arithmetic that is Rauch's result; but no
//! covariance is inverted, so that states known exactly do no harm, and noise that a filter adds
//! between two steps need not be told.
//!
//! Through a motion with Jacobian `F`: `λ ← Fᵀ λ`, `Λ ← Fᵀ Λ F`. Through a measurement with row `h`,
//! gain `k`, residual `y` and its variance `s`, backwards:
//! `λ ← λ − h (kᵀλ + y/s)`, `Λ ← (I − k h)ᵀ Λ (I − k h) + hᵀh/s`.

use super::gaussian::{Gaussian, Matrix};

/// What a filter did, in order of time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Journal<const N: usize> {
    entries: Vec<Entry<N>>,
}

#[derive(Clone, Debug, PartialEq)]
enum Entry<const N: usize> {
    Moved(Box<Matrix<N>>),
    Measured(Box<Measurement<N>>),
    Asked(Box<(f64, Gaussian<N>)>),
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Measurement<const N: usize> {
    row: [f64; N],
    gain: [f64; N],
    residual: f64,
    variance: f64,
}

impl<const N: usize> Journal<N> {
    /// The state moved by a motion with this Jacobian.
    pub fn moved(&mut self, jacobian: &Matrix<N>) {
        self.entries.push(Entry::Moved(Box::new(*jacobian)));
    }

    /// `before` is about to be updated by a scalar measurement.
    pub fn measured(
        &mut self,
        before: &Gaussian<N>,
        residual: f64,
        row: &[f64; N],
        measurement_variance: f64,
    ) {
        let variance = before.variance_along(row) + measurement_variance;
        if variance <= 0.0 {
            return; // nothing to learn, as in the update itself
        }
        let mut gain = [0.0; N];
        for i in 0..N {
            for j in 0..N {
                gain[i] += before.covariance[i][j] * row[j] / variance;
            }
        }
        self.entries.push(Entry::Measured(Box::new(Measurement {
            row: *row,
            gain,
            residual,
            variance,
        })));
    }

    /// The belief at `time_s` is one that the smoother is to improve.
    pub fn asked(&mut self, time_s: f64, belief: &Gaussian<N>) {
        self.entries.push(Entry::Asked(Box::new((time_s, *belief))));
    }

    /// The beliefs that were asked for and their times in seconds, by everything up to the end.
    pub fn smoothed(&self) -> Vec<(f64, Gaussian<N>)> {
        let mut rest = Rest {
            vector: [0.0; N],
            matrix: [[0.0; N]; N],
        };
        let mut smoothed = Vec::new();
        for entry in self.entries.iter().rev() {
            match entry {
                Entry::Moved(jacobian) => rest.before_motion(jacobian),
                Entry::Measured(measurement) => rest.before_measurement(measurement),
                Entry::Asked(asked) => smoothed.push((asked.0, rest.improve(&asked.1))),
            }
        }
        smoothed.reverse();
        smoothed
    }
}

/// What the rest of the drive says of a state: λ and Λ.
struct Rest<const N: usize> {
    vector: [f64; N],
    matrix: Matrix<N>,
}

impl<const N: usize> Rest<N> {
    fn before_motion(&mut self, jacobian: &Matrix<N>) {
        let mut vector = [0.0; N];
        let mut half = [[0.0; N]; N]; // Λ F
        let mut matrix = [[0.0; N]; N];
        for k in 0..N {
            for j in 0..N {
                // Jacobians of motion are nearly identity: most products are skipped.
                if jacobian[k][j] != 0.0 {
                    vector[j] += jacobian[k][j] * self.vector[k];
                    for i in 0..N {
                        half[i][j] += self.matrix[i][k] * jacobian[k][j];
                    }
                }
            }
        }
        for k in 0..N {
            for i in 0..N {
                if jacobian[k][i] != 0.0 {
                    for j in 0..N {
                        matrix[i][j] += jacobian[k][i] * half[k][j];
                    }
                }
            }
        }
        *self = Self { vector, matrix };
    }

    fn before_measurement(&mut self, seen: &Measurement<N>) {
        let (row, gain) = (&seen.row, &seen.gain);
        let (mut foretold, mut spread) = (0.0, 0.0);
        let mut cross = [0.0; N]; // Λ k
        for i in 0..N {
            foretold += gain[i] * self.vector[i];
            for j in 0..N {
                cross[i] += self.matrix[i][j] * gain[j];
            }
            spread += gain[i] * cross[i];
        }
        let pull = foretold + seen.residual / seen.variance;
        let weight = spread + 1.0 / seen.variance;
        for i in 0..N {
            self.vector[i] -= row[i] * pull;
            for j in 0..N {
                self.matrix[i][j] +=
                    weight * row[i] * row[j] - row[i] * cross[j] - cross[i] * row[j];
            }
        }
    }

    fn improve(&self, belief: &Gaussian<N>) -> Gaussian<N> {
        let covariance = &belief.covariance;
        let mut improved = *belief;
        let mut half = [[0.0; N]; N]; // P Λ
        for i in 0..N {
            for k in 0..N {
                improved.mean[i] -= covariance[i][k] * self.vector[k];
                for j in 0..N {
                    half[i][j] += covariance[i][k] * self.matrix[k][j];
                }
            }
        }
        for i in 0..N {
            for j in i..N {
                let mut less = 0.0;
                for k in 0..N {
                    less += half[i][k] * covariance[k][j];
                }
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

    const STEPS: usize = 7;
    const SIZE: usize = 2 * STEPS;

    /// Inverse by Gauss and Jordan, pivots in place: for positive definite matrices.
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

    #[test]
    fn a_linear_drive_is_smoothed_as_by_least_squares_over_all_of_it() {
        // Place and speed; the speed is disturbed, the place too, and a mixture of both is seen.
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
            // Asked before the measurement of the same time.
            journal.asked(step as f64, &belief);
            let (value, variance) = seen(step);
            let row = [1.0, 0.4];
            let residual = value - row[0] * belief.mean[0] - row[1] * belief.mean[1];
            journal.measured(&belief, residual, &row, variance);
            belief.update(residual, &row, variance);
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
    fn what_nothing_follows_stays_as_it_was() {
        let mut belief = Gaussian::independent([1.0, 2.0], [0.5, 0.0]);
        let mut journal = Journal::default();
        journal.asked(0.0, &belief);
        journal.measured(&belief, 0.3, &[1.0, 1.0], 0.1);
        belief.update(0.3, &[1.0, 1.0], 0.1);
        journal.asked(0.0, &belief);
        let smoothed = journal.smoothed();
        assert_eq!(smoothed[1].1, belief);
        // Nothing moved between: both are one state, and what is known exactly remains so.
        assert!((smoothed[0].1.mean[0] - belief.mean[0]).abs() < 1e-15);
        assert!((smoothed[0].1.covariance[0][0] - belief.covariance[0][0]).abs() < 1e-15);
        assert_eq!(
            (smoothed[0].1.mean[1], smoothed[0].1.covariance[1][1]),
            (2.0, 0.0)
        );
    }
}
