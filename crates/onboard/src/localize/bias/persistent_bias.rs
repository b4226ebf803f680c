//! Persistent bias of each radio head's angles, in addition to the multipath bias: a radio head that is displaced or
//! received by a reflection for hundreds of metres.
//!
//! The bias is a Gauss–Markov process of the distance driven (Brown and Hwang, Introduction to Random Signals and
//! Applied Kalman Filtering, 2012, 4.6), constant at standstill. The multipath bias cannot represent it: its value is
//! drawn again after a metre, so that the filter would average a constant bias like noise.

use super::multipath_bias::MultipathBias;

/// Standard deviation (rad): an assumption. The results differ little from 0.05 to 0.2 rad (notes/experiments.md).
const STD_RAD: f64 = 0.1;

/// Correlation distance (m): an assumption, about the distance in which a vehicle passes a radio head. With 100 m, three
/// hidden radio heads are covered less well (notes/experiments.md).
const CORRELATION_M: f64 = 300.0;

impl MultipathBias {
    /// Estimates a persistent bias of each radio head from now on, if multipath biases are estimated.
    pub fn expect_persistent(&mut self) {
        if self.is_empty() || self.persistent.is_some() {
            return;
        }
        let first = self.heads.len();
        self.persistent = Some(first);
        self.grow(first + self.biases);
        self.decay_persistent(first, 0.0);
    }

    /// Predicts the persistent biases over a distance.
    pub fn advance_persistent(&mut self, travelled_m: f64) {
        if let Some(first) = self.persistent {
            self.decay_persistent(first, (-travelled_m.abs() / CORRELATION_M).exp());
        }
    }

    /// Retains the fraction `kept` of each persistent bias, of which number `first` is the first, and adds a new
    /// independent part so that a bias with the prior variance keeps it.
    fn decay_persistent(&mut self, first: usize, kept: f64) {
        for bias in self.heads.iter_mut().skip(first) {
            bias.mean_rad *= kept;
            bias.state_covariance = bias.state_covariance.map(|it| kept * it);
        }
        for (number, row) in self.among.chunks_mut(self.heads.len()).enumerate() {
            let is_persistent = number >= first;
            for (other, covariance) in row.iter_mut().enumerate() {
                if is_persistent {
                    *covariance *= kept;
                }
                if other >= first {
                    *covariance *= kept;
                }
            }
            if let (true, Some(variance)) = (is_persistent, row.get_mut(number)) {
                *variance += (1.0 - kept * kept) * STD_RAD * STD_RAD;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::jump_process::Dependence;
    use super::*;
    use crate::localize::ekf::state::{Belief, STATES};

    fn persistent(of: &MultipathBias, head: usize) -> (f64, f64) {
        let (number, bias) = of.persistent(head).unwrap();
        (bias.mean_rad, of.covariance(number, number))
    }

    #[test]
    fn a_bias_keeps_the_prior_variance_over_any_distance() {
        let mut biases = MultipathBias::new(3, 0.75);
        assert!(biases.persistent(0).is_none());
        biases.expect_persistent();
        for travelled_m in [0.0, 1.0, -20.0, 1e4] {
            biases.advance_persistent(travelled_m);
            for head in 0..3 {
                let (mean, variance) = persistent(&biases, head);
                assert!(mean == 0.0 && (variance / (STD_RAD * STD_RAD) - 1.0).abs() < 1e-12);
            }
        }
    }

    /// Angles of a known direction: the constant error is persistent, not multipath.
    #[test]
    fn a_constant_error_of_one_radio_head_is_its_persistent_bias() {
        const STEP_M: f64 = 0.5;
        let dependence = Dependence::of_bias(STEP_M);
        let mut biases = MultipathBias::new(2, 0.75);
        biases.expect_persistent();
        let mut belief = Belief::independent([0.0; STATES], [1e-3; STATES]);
        let mut row = [0.0; STATES];
        row[0] = 1.0;
        for _ in 0..200 {
            biases.advance_persistent(STEP_M);
            for (head, error_rad) in [0.15, 0.0].into_iter().enumerate() {
                let seen = belief.innovation(error_rad - belief.mean[0], &row, 1e-4);
                let jumps = biases
                    .jump_hypotheses(head, &dependence, &seen, &row)
                    .unwrap();
                biases.update_with_angle(&mut belief, head, &dependence, &row, &jumps, None);
            }
        }
        for (head, error_rad) in [0.15, 0.0].into_iter().enumerate() {
            let (mean, variance) = persistent(&biases, head);
            assert!((mean - error_rad).abs() < 0.02, "{head}: {mean}");
            assert!((0.002..0.03).contains(&variance.sqrt()), "{variance}");
        }
        // The estimate decays with the correlation distance.
        biases.advance_persistent(CORRELATION_M);
        let (mean, variance) = persistent(&biases, 0);
        assert!((mean / 0.15 - (-1.0_f64).exp()).abs() < 0.05);
        assert!(variance > 0.8 * STD_RAD * STD_RAD);
    }
}
