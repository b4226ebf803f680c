//! What an estimate says.

use std::f64::consts::{FRAC_PI_2, PI};

use super::goodness_of_fit::GoodnessOfFit;
use super::verdict::{Reason, Verdict};
use crate::list::List;

/// A direction, and how well it is known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AngleEstimate {
    /// Electrical angle `omega`, in (-pi, pi]: what was measured. Its noise is Gaussian and does not
    /// depend on the direction, so filters should take this one.
    pub phase_rad: f64,
    /// Standard deviation of `phase_rad`: that of noise and, where the model does not fit
    /// ([`GoodnessOfFit::misfit`]), what the misfit displaces.
    pub phase_sigma_rad: f64,
    /// That of noise alone, of the method at the estimated SNR.
    pub phase_noise_sigma_rad: f64,
    /// Angle from the array's axis, 0 to pi.
    pub angle_rad: f64,
    /// Standard deviation of `angle_rad`; near end-fire, where the linear law diverges, the angle
    /// that one standard deviation of `phase_rad` makes there.
    pub sigma_rad: f64,
    /// Estimated SNR per antenna and snapshot. Whatever the sources leave counts as noise.
    pub snr_db: f64,
    /// How well plane waves and white noise explain what was received; of all sources together.
    pub fit: GoodnessOfFit,
    /// Whether noise and geometry leave a doubt of it.
    pub verdict: Verdict,
}

impl AngleEstimate {
    /// Whether the verdict is [`Verdict::Resolved`].
    pub fn is_resolved(&self) -> bool {
        self.verdict == Verdict::Resolved
    }

    /// Why the estimate should not be relied on: it is not resolved, or the model does not fit.
    pub fn doubt(&self) -> Option<Reason> {
        self.verdict.reason().or_else(|| self.fit.misfit())
    }

    /// The estimate of samples of which only the phases were received, all of one modulus.
    ///
    /// Half of the noise, the part along the samples, is missing in the residual: the variance of an angle is twice
    /// of what the residual shows, the SNR is half of it, and the residual is no white noise, so that the fit is not
    /// tested.
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

    /// Whether the estimate may be relied on: it is resolved, and the model fits.
    pub fn is_reliable(&self) -> bool {
        self.doubt().is_none()
    }
}

/// The estimate of who knows nothing: any direction, not resolved.
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

/// Angle estimates of several sources, by ascending angle.
pub type AngleEstimates<const N: usize> = List<AngleEstimate, N>;
