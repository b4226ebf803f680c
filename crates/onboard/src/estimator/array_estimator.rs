//! The estimators of the `aoa` crate, for the vehicle's array.

use aoa::{Array, Covariance, Method};

use super::angle_estimator::{AngleEstimator, EstimatedAngle};
use super::likelihood::circular_gaussian;
use crate::BoxError;
use crate::elements::for_elements;
use crate::localize::AngleMeasurement;
use crate::observation::{SensedSsb, SsbObservation};
use crate::settings::{EstimatorMethod, Vehicle};

/// A method of the `aoa` crate on an array of `N` antennas.
#[derive(Debug, Clone)]
pub struct ArrayEstimator<const N: usize> {
    array: Array<N>,
    method: Method,
}

/// The estimator that a vehicle's settings choose.
///
/// # Errors
/// When the array is not one that the `aoa` crate accepts.
pub fn built_in(vehicle: &Vehicle) -> Result<Box<dyn AngleEstimator>, aoa::Error> {
    let method = match vehicle.estimator.method {
        EstimatorMethod::Music => Method::Music,
        EstimatorMethod::RootMusic => Method::RootMusic,
        EstimatorMethod::Esprit => Method::EspritLs,
        EstimatorMethod::MaximumLikelihood => Method::MaximumLikelihood,
    };
    let spacing = vehicle.array.spacing_wavelengths;
    for_elements!(vehicle.array.elements, N => Ok(Box::new(ArrayEstimator::<N> {
        array: Array::new(spacing)?,
        method,
    })))
}

impl<const N: usize> AngleEstimator for ArrayEstimator<N> {
    fn estimate(
        &mut self,
        observation: &SsbObservation,
    ) -> Result<Option<EstimatedAngle>, BoxError> {
        let snapshots = observation.snapshots::<N>();
        let estimate = if observation.noise_variance.is_some() {
            aoa::maximum_likelihood_pilots(snapshots, observation.noise_variance, &self.array)
        } else {
            Covariance::from_snapshots(snapshots)
                .and_then(|covariance| aoa::estimate(self.method, &covariance, &self.array))
        };
        Ok(estimate.ok().map(|estimate| EstimatedAngle::Angle {
            phase_rad: estimate.phase_rad,
            phase_sigma_rad: Some(estimate.phase_sigma_rad),
            snr_db: Some(estimate.snr_db),
            resolved: estimate.is_resolved(),
        }))
    }
}

/// What the localizer takes of an estimate; `bound_rad` is what an estimate without standard
/// deviation gets, `spacing_wavelengths` the array's. `None` where the estimate carries no angle.
pub fn measurement(
    ssb: &SensedSsb,
    estimated: EstimatedAngle,
    spacing_wavelengths: f64,
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
    let cosine = phase_rad / (std::f64::consts::TAU * spacing_wavelengths);
    Some(AngleMeasurement {
        time_s: ssb.time_s,
        phase_rad,
        phase_sigma_rad,
        angle_rad: cosine.clamp(-1.0, 1.0).acos(),
        snr_db,
        resolved,
    })
}
