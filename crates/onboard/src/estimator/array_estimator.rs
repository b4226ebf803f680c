//! Estimators of the `aoa` crate for the vehicle's array.

use std::f64::consts::{PI, TAU};

use aoa::{Array, Covariance, DirectionFinder, Method, Reason, Verdict};

use super::angle_estimator::{AngleEstimator, EstimatedAngle};
use super::likelihood::circular_gaussian;
use crate::BoxError;
use crate::elements::for_elements;
use crate::localize::{AngleMeasurement, MeasurementKind};
use crate::manifold::{ArrayManifold, Measurand};
use crate::observation::{SsbDetection, SsbObservation};
use crate::settings::{EstimatorMethod, Vehicle};

/// Estimation method of the `aoa` crate for a uniform linear array of `N` antennas.
#[derive(Debug, Clone)]
pub struct ArrayEstimator<const N: usize> {
    array: Array<N>,
    method: Method,
    grid_rad: Option<f64>,
}

impl<const N: usize> ArrayEstimator<N> {
    /// Returns the electrical angle of the nearest grid point, if there is a grid.
    fn on_grid(&self, phase_rad: f64) -> f64 {
        let Some(step_rad) = self.grid_rad else {
            return phase_rad;
        };
        let turn = TAU * self.array.spacing_wavelengths();
        let angle_rad = (phase_rad / turn).clamp(-1.0, 1.0).acos();
        turn * ((angle_rad / step_rad).round() * step_rad).min(PI).cos()
    }
}

/// Maximum likelihood in azimuth and elevation for a non-linear array of `N` antennas.
#[derive(Debug, Clone)]
pub struct AzimuthEstimator<const N: usize>(DirectionFinder<ArrayManifold<N>, N>);

/// Returns the estimator of a vehicle's settings.
///
/// # Errors
/// [`aoa::Error`] if the array is invalid.
pub fn built_in(vehicle: &Vehicle) -> Result<Box<dyn AngleEstimator>, aoa::Error> {
    let method = match vehicle.estimator.method {
        EstimatorMethod::Music => Method::Music,
        EstimatorMethod::RootMusic => Method::RootMusic,
        EstimatorMethod::Esprit => Method::EspritLs,
        EstimatorMethod::MaximumLikelihood => Method::MaximumLikelihood,
    };
    let spacing = vehicle.array.spacing_wavelengths;
    let grid_rad = (vehicle.estimator.music_grid_deg)
        .filter(|_| method == Method::Music)
        .map(f64::to_radians);
    for_elements!(vehicle.array.elements, N => Ok(match vehicle.array.manifold::<N>()? {
        None => Box::new(ArrayEstimator::<N> {
            array: Array::new(spacing)?,
            method,
            grid_rad,
        }),
        Some(manifold) => Box::new(AzimuthEstimator(manifold.finder()?)),
    }))
}

impl<const N: usize> AngleEstimator for ArrayEstimator<N> {
    fn estimate(
        &mut self,
        observation: &SsbObservation,
    ) -> Result<Option<EstimatedAngle>, BoxError> {
        let snapshots = observation.snapshots::<N>();
        // The goodness of fit is not used.
        let estimate = if let Some(noise_variance) = observation.noise_variance {
            aoa::maximum_likelihood_pilots_untested(snapshots, Some(noise_variance), &self.array)
        } else {
            Covariance::from_snapshots(snapshots).and_then(|covariance| {
                aoa::estimate_untested(self.method, &covariance, &self.array)
            })
        };
        Ok(estimate.ok().map(|estimate| EstimatedAngle::Angle {
            phase_rad: self.on_grid(estimate.phase_rad),
            // Scatter, which violates the signal model, is part of the site's angle noise.
            phase_sigma_rad: Some(estimate.phase_noise_sigma_rad),
            snr_db: Some(estimate.snr_db),
            resolved: estimate.is_resolved(),
        }))
    }
}

impl<const N: usize> AngleEstimator for AzimuthEstimator<N> {
    fn estimate(
        &mut self,
        observation: &SsbObservation,
    ) -> Result<Option<EstimatedAngle>, BoxError> {
        let (snapshots, noise) = (observation.snapshots::<N>(), observation.noise_variance);
        let estimate = self.0.estimate_pilots(snapshots, noise);
        Ok(estimate.ok().map(|estimate| EstimatedAngle::Angle {
            phase_rad: estimate.direction.azimuth_rad,
            phase_sigma_rad: Some(estimate.noise_covariance[0][0].sqrt()),
            snr_db: Some(estimate.snr_db),
            // Near the horizon only the elevation is uncertain.
            resolved: matches!(
                estimate.verdict,
                Verdict::Resolved | Verdict::Unresolved(Reason::EdgeOfElevations)
            ),
        }))
    }
}

/// Returns the measurement for the localizer; `None` if the estimate contains no angle. `bound_rad`
/// is the standard deviation of an estimate without one, `measurand` the angle that the array
/// measures.
pub fn measurement(
    ssb: &SsbDetection,
    estimated: EstimatedAngle,
    measurand: &Measurand,
    bound_rad: impl FnOnce() -> f64,
) -> Option<AngleMeasurement> {
    let (phase_rad, phase_sigma_rad, snr_db, resolved) = match estimated {
        EstimatedAngle::Angle {
            phase_rad,
            phase_sigma_rad,
            snr_db,
            resolved,
        } => (
            phase_rad,
            phase_sigma_rad.unwrap_or_else(bound_rad),
            snr_db.unwrap_or(ssb.snr_db),
            resolved,
        ),
        EstimatedAngle::LogLikelihood(log) => {
            let (phase_rad, sigma_rad) = circular_gaussian(&log)?;
            (phase_rad, sigma_rad, ssb.snr_db, true)
        }
    };
    Some(AngleMeasurement {
        kind: MeasurementKind::Angle,
        time_s: ssb.time_s,
        phase_rad,
        phase_sigma_rad,
        angle_rad: measurand.angle_rad(phase_rad),
        snr_db,
        resolved,
    })
}
