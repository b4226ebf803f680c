//! Evidence of a hypothesis: likelihood of the innovations of a localizer.

use std::collections::{BTreeMap, BTreeSet};

use onboard::gaussian::with_outliers;
use onboard::geometry::Pose;
use onboard::localize::Localizer;

use super::error::ReplayError;
use super::hypotheses::Drive;
use super::innovations::{InnovationRecord, Step, plain_filter, replay_angles};
use super::stated::with_phase;
use crate::angle_log::LoggedAngle;

/// Fraction of outliers with a uniform distribution, for example due to reflections, assumed in the
/// diagnosis. The other angles are Gaussian.
pub const OUTLIERS: f64 = 0.1;

/// Time within which angles to one radio head count as one independent angle (s).
const INDEPENDENT_S: f64 = 1.0;

/// Maximum squared Mahalanobis distance of a fitting angle: three standard deviations.
const FITS: f64 = 9.0;

/// Relative log-likelihood of an angle that the filter cannot use, equal to that of an outlier.
const UNUSABLE: f64 = -8.0;

/// Radio head, identified by PCI and SSB index.
pub type HeadId = (u16, u8);

pub fn head_of(angle: &LoggedAngle) -> HeadId {
    (angle.ssb.pci, angle.ssb.ssb_index)
}

/// Numbers of angles in total, rejected, and deviating from the prediction.
#[derive(Debug, Clone, Copy, Default)]
pub struct Count {
    pub angles: usize,
    pub refused: usize,
    pub misfits: usize,
}

impl Count {
    pub fn refused_share(&self) -> f64 {
        self.refused as f64 / self.angles.max(1) as f64
    }

    pub fn misfit_share(&self) -> f64 {
        self.misfits as f64 / self.angles.max(1) as f64
    }
}

/// Result of the evaluation of a drive.
pub struct Evidence {
    /// Log-likelihood of the angles, in which dependent angles count as one.
    pub log_likelihood: f64,
    /// Log-likelihood relative to exactly predicted angles, with the independence that the
    /// variances imply. It is comparable between hypotheses that differ in the times of the angles
    /// only, because the times change the number of independent angles.
    pub relative_log_likelihood: f64,
    pub all: Count,
    pub heads: BTreeMap<HeadId, Count>,
    /// Estimated pose at each angle.
    pub path: Vec<Option<Pose>>,
}

impl Evidence {
    /// Evaluates a drive with a localizer; `None` if the localizer is lost for long.
    ///
    /// # Errors
    /// Errors of [`replay_angles`].
    pub fn by(
        localizer: &mut dyn Localizer,
        drive: &Drive<'_>,
    ) -> Result<Option<Self>, ReplayError> {
        let Drive { site, vehicle, .. } = drive;
        let (odometry, angles) = (&drive.odometry, &drive.angles);
        let steps = replay_angles(localizer, site, vehicle, odometry, angles, None)?;
        if steps.len() < angles.len() {
            return Ok(None);
        }
        let measurand = vehicle.array.measurand();
        let mut evidence = Self {
            log_likelihood: 0.0,
            relative_log_likelihood: 0.0,
            all: Count::default(),
            heads: BTreeMap::new(),
            path: steps.iter().map(|step| step.pose).collect(),
        };
        for (Step { met, .. }, logged) in steps.iter().zip(angles.iter()) {
            let sigma_rad = with_phase(logged, &measurand).measured.phase_sigma_rad;
            evidence.log_likelihood += log_likelihood(met.as_ref(), sigma_rad);
            let relative = met.as_ref().map(|it| it.evidence.relative_log_likelihood);
            evidence.relative_log_likelihood += relative.unwrap_or(UNUSABLE);
            let misfits = |met: &InnovationRecord| met.evidence.innovation.mahalanobis2() > FITS;
            let head = evidence.heads.entry(head_of(logged)).or_default();
            for count in [&mut evidence.all, head] {
                count.angles += 1;
                count.refused += usize::from(met.is_none_or(|met| !met.used));
                count.misfits += usize::from(met.as_ref().is_none_or(misfits));
            }
        }
        evidence.log_likelihood *= information_fraction(angles);
        Ok(Some(evidence))
    }
}

/// Returns the log-likelihood of an angle in units of its standard deviation, so that it does not
/// depend on the unit of the angle.
fn log_likelihood(met: Option<&InnovationRecord>, sigma_rad: f64) -> f64 {
    let density = met.map_or(0.0, |met| met.evidence.innovation.density());
    (sigma_rad * with_outliers(density, OUTLIERS)).ln()
}

/// Returns the fraction of the angles that count as independent.
fn information_fraction(angles: &[LoggedAngle]) -> f64 {
    let apart = |it: &LoggedAngle| {
        let time = (it.measured.time_s / INDEPENDENT_S).floor() as i64;
        (head_of(it), time)
    };
    let independent: BTreeSet<_> = angles.iter().map(apart).collect();
    independent.len() as f64 / angles.len().max(1) as f64
}

/// Evaluates a drive with a plain filter, which suffices to rank hypotheses; `None` if the filter is lost.
///
/// # Errors
/// Errors of [`plain_filter`].
pub fn screened(drive: &Drive<'_>) -> Result<Option<Evidence>, ReplayError> {
    Evidence::by(&mut plain_filter(&drive.site, &drive.vehicle)?, drive)
}
