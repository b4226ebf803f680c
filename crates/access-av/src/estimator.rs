//! From an SSB's snapshots to an angle: a method of the `aoa` crate, or the user's own.

use aoa::{Array, Covariance, Method};

use crate::BoxError;
use crate::localize::AngleMeasurement;
use crate::observation::{ANTENNAS, Snapshot, SsbObservation};
use crate::scenario::{EstimatorMethod, Scenario};

/// A user's estimator: snapshots in, angle from the array's axis in radians out.
pub trait CustomEstimator: Send {
    /// The angle of arrival in radians, 0..=π.
    ///
    /// # Errors
    /// Whatever the user's code fails with; it ends the run.
    fn angle_rad(&mut self, snapshots: &[Snapshot]) -> Result<f64, BoxError>;
}

/// What turns snapshots into an angle.
pub struct AngleEstimator {
    array: Array<ANTENNAS>,
    method: Method,
    custom: Option<Box<dyn CustomEstimator>>,
}

impl AngleEstimator {
    /// The scenario's estimator, or `custom` in its place.
    ///
    /// # Errors
    /// When the array is not one that the `aoa` crate accepts.
    pub fn new(
        scenario: &Scenario,
        custom: Option<Box<dyn CustomEstimator>>,
    ) -> Result<Self, aoa::Error> {
        let method = match scenario.estimator.method {
            EstimatorMethod::Music => Method::Music {
                grid_deg: scenario.estimator.grid_deg,
                refine: true,
            },
            EstimatorMethod::RootMusic => Method::RootMusic,
            EstimatorMethod::Esprit => Method::EspritLs,
            EstimatorMethod::MaximumLikelihood => Method::MaximumLikelihood,
        };
        Ok(Self {
            array: Array::new(scenario.array.spacing_wavelengths)?,
            method,
            custom,
        })
    }

    /// The angle of an SSB; `None` when its snapshots carry none (all zero, not finite, none).
    ///
    /// # Errors
    /// Only from a user's estimator.
    pub fn estimate(
        &mut self,
        observation: &SsbObservation,
    ) -> Result<Option<AngleMeasurement>, BoxError> {
        let snapshots = observation.snapshots();
        let time_s = observation.ssb.time_s;
        if let Some(custom) = &mut self.custom {
            let angle_rad = custom.angle_rad(snapshots)?;
            return Ok(Some(AngleMeasurement {
                time_s,
                phase_rad: self.array.phase_from_angle(angle_rad),
                phase_sigma_rad: f64::NAN,
                angle_rad,
                snr_db: observation.ssb.snr_db,
                resolved: angle_rad.is_finite(),
            }));
        }
        let estimate = if observation.noise_variance.is_some() {
            aoa::maximum_likelihood_pilots(snapshots, observation.noise_variance, &self.array)
        } else {
            Covariance::from_snapshots(snapshots)
                .and_then(|covariance| aoa::estimate(self.method, &covariance, &self.array))
        };
        Ok(estimate.ok().map(|estimate| AngleMeasurement {
            time_s,
            phase_rad: estimate.phase_rad,
            phase_sigma_rad: estimate.phase_sigma_rad,
            angle_rad: estimate.angle_rad,
            snr_db: estimate.snr_db,
            resolved: estimate.is_resolved(),
        }))
    }
}
