//! Estimate of an angle.

use std::f64::consts::{FRAC_PI_2, PI};

use super::goodness_of_fit::GoodnessOfFit;
use super::verdict::{Reason, Verdict};
use crate::list::List;

/// Estimated direction with its uncertainty.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AngleEstimate {
    /// Electrical angle `omega` in (-pi, pi], the measured quantity. Its noise is Gaussian and does
    /// not depend on the direction, so that filters should use this value.
    pub phase_rad: f64,
    /// Standard deviation of `phase_rad` due to noise and, if the model does not fit
    /// ([`GoodnessOfFit::misfit`]), due to the misfit.
    pub phase_sigma_rad: f64,
    /// Standard deviation of `phase_rad` due to noise only, for the method at the estimated SNR.
    pub phase_noise_sigma_rad: f64,
    /// Angle from the array's axis in rad, 0 to pi.
    pub angle_rad: f64,
    /// Standard deviation of `angle_rad` in rad. Near end-fire, where the linear approximation
    /// diverges, it is the angle that corresponds to one standard deviation of `phase_rad`.
    pub sigma_rad: f64,
    /// Estimated SNR per antenna and snapshot. The whole residual counts as noise.
    pub snr_db: f64,
    /// Goodness of fit of plane waves and white noise, for all sources together.
    pub fit: GoodnessOfFit,
    /// Whether the estimate is resolved with respect to noise and geometry.
    pub verdict: Verdict,
}

impl AngleEstimate {
    /// Whether the verdict is [`Verdict::Resolved`].
    pub fn is_resolved(&self) -> bool {
        self.verdict == Verdict::Resolved
    }

    /// Returns the reason why the estimate is unreliable: it is not resolved, or the model does not
    /// fit. Returns `None` for a reliable estimate.
    pub fn doubt(&self) -> Option<Reason> {
        self.verdict.reason().or_else(|| self.fit.misfit())
    }

    /// Converts the estimate of samples of constant modulus, of which only the phases were
    /// received.
    ///
    /// The noise component along the samples (half of the noise) is missing in the residual.
    /// Therefore, the variance of the angle is doubled and the SNR is halved. The fit is not tested
    /// because the residual is not white.
    #[must_use]
    pub fn of_phases(self) -> Self {
        Self {
            phase_sigma_rad: self.phase_noise_sigma_rad * std::f64::consts::SQRT_2,
            phase_noise_sigma_rad: self.phase_noise_sigma_rad * std::f64::consts::SQRT_2,
            sigma_rad: self.sigma_rad * self.phase_noise_sigma_rad / self.phase_sigma_rad
                * std::f64::consts::SQRT_2,
            snr_db: self.snr_db - 10.0 * std::f64::consts::LOG10_2,
            fit: GoodnessOfFit::default(),
            ..self
        }
    }

    /// Whether the estimate is reliable: it is resolved, and the model fits.
    pub fn is_reliable(&self) -> bool {
        self.doubt().is_none()
    }
}

/// Estimated direction with its uncertainty due to noise, without the goodness of fit, whose
/// computation takes more time than the rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UntestedEstimate {
    /// Electrical angle in (-pi, pi], as in [`AngleEstimate::phase_rad`].
    pub phase_rad: f64,
    /// Standard deviation of `phase_rad` due to noise only, for the method at the estimated SNR.
    pub phase_noise_sigma_rad: f64,
    /// Angle from the array's axis in rad, 0 to pi.
    pub angle_rad: f64,
    /// Standard deviation of `angle_rad` in rad due to noise only.
    pub sigma_rad: f64,
    /// Estimated SNR per antenna and snapshot. The whole residual counts as noise.
    pub snr_db: f64,
    /// Whether the estimate is resolved with respect to noise and geometry. A low SNR due to a
    /// misfit is [`Reason::ThresholdSnr`] or [`Reason::TooFewSnapshots`].
    pub verdict: Verdict,
}

impl UntestedEstimate {
    /// Whether the verdict is [`Verdict::Resolved`]. The result equals that of
    /// [`AngleEstimate::is_resolved`].
    pub fn is_resolved(&self) -> bool {
        self.verdict == Verdict::Resolved
    }
}

/// Estimate without information: any direction, unresolved.
impl Default for UntestedEstimate {
    fn default() -> Self {
        let none = AngleEstimate::default();
        Self {
            phase_rad: none.phase_rad,
            phase_noise_sigma_rad: none.phase_noise_sigma_rad,
            angle_rad: none.angle_rad,
            sigma_rad: none.sigma_rad,
            snr_db: none.snr_db,
            verdict: none.verdict,
        }
    }
}

/// Estimate without information: any direction, unresolved.
impl Default for AngleEstimate {
    fn default() -> Self {
        Self {
            phase_rad: 0.0,
            phase_sigma_rad: PI / 3.0_f64.sqrt(),
            phase_noise_sigma_rad: PI / 3.0_f64.sqrt(),
            angle_rad: FRAC_PI_2,
            sigma_rad: FRAC_PI_2,
            snr_db: f64::NEG_INFINITY,
            fit: GoodnessOfFit::default(),
            verdict: Verdict::Unresolved(Reason::ThresholdSnr),
        }
    }
}

/// Angle estimates of several sources in order of ascending angle.
pub type AngleEstimates<const N: usize> = List<AngleEstimate, N>;
