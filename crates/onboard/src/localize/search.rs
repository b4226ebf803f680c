//! The search for the first pose, along the road or in the plane, and the tracker that comes out of it.

use super::initialise::Initialiser;
use super::integrity::IntegrityConfig;
use super::integrity_state::Integrity;
use super::localizer::{Localizer, Recovered, copy_into};
use super::measurement::{AngleMeasurement, UpdateVerdict};
use super::pose_estimate::PoseEstimate;
use super::quantile::RadialQuantile;
use super::recovery::Recovery;
use super::tracker::{OdometryVerdict, Tracker};
use crate::BoxError;
use crate::observation::OdometrySample;
use crate::radio_head::RadioHead;
use crate::road::Road;

/// A localizer that first searches for the vehicle.
pub struct Search {
    initialiser: Initialiser,
    road: Option<Road>,
    integrity: Option<(IntegrityConfig, RadialQuantile)>,
    found: Option<Box<dyn Localizer>>,
    keeps_journal: bool,
}

impl Clone for Search {
    fn clone(&self) -> Self {
        let mut found = None;
        if let Some(localizer) = &self.found {
            localizer.copy_to(&mut found);
        }
        Self {
            initialiser: self.initialiser.clone(),
            road: self.road.clone(),
            integrity: self.integrity.clone(),
            found,
            keeps_journal: self.keeps_journal,
        }
    }

    /// Once the vehicle is found nothing of the search is worth copying.
    fn clone_from(&mut self, source: &Self) {
        match &source.found {
            Some(localizer) => {
                localizer.copy_to(&mut self.found);
            }
            None => *self = source.clone(),
        }
    }
}

impl Search {
    /// A search, from which a tracker comes, guarded or not.
    pub fn new(
        initialiser: Initialiser,
        road: Option<Road>,
        integrity: Option<IntegrityConfig>,
    ) -> Self {
        Self {
            initialiser,
            road,
            integrity: integrity.map(|config| (config, RadialQuantile::new(config.risk))),
            found: None,
            keeps_journal: false,
        }
    }
}

impl Localizer for Search {
    fn odometry(&mut self, sample: &OdometrySample) -> Result<OdometryVerdict, BoxError> {
        match &mut self.found {
            Some(localizer) => localizer.odometry(sample),
            None => Ok(self.initialiser.odometry(sample)),
        }
    }

    fn update(
        &mut self,
        head: &RadioHead,
        measured: &AngleMeasurement,
    ) -> Result<UpdateVerdict, BoxError> {
        if let Some(localizer) = &mut self.found {
            return localizer.update(head, measured);
        }
        let verdict = self.initialiser.update(head, measured);
        if let Some(tracker) = self.initialiser.found() {
            let config = self.integrity.as_ref().map(|(config, _)| *config);
            let (road, heads) = (self.road.clone(), self.initialiser.heads());
            let found_s = Some(measured.time_s);
            let mut localizer: Box<dyn Localizer> =
                Box::new(Recovery::new(tracker, road, heads, config, found_s));
            if self.keeps_journal {
                localizer.keep_journal();
            }
            self.found = Some(localizer);
        }
        Ok(verdict)
    }

    fn pose(&self, time_s: f64) -> Result<PoseEstimate, BoxError> {
        if let Some(localizer) = &self.found {
            return localizer.pose(time_s);
        }
        let mut estimate = self.initialiser.pose(time_s);
        let variances = estimate.principal_variances();
        estimate.integrity = (self.integrity.as_ref())
            .map(|(_, quantile)| Integrity::unavailable(quantile.radius(variances)));
        Ok(estimate)
    }

    fn copy_to(&self, slot: &mut Option<Box<dyn Localizer>>) -> bool {
        copy_into(self, slot)
    }

    fn hypotheses(&self) -> Option<usize> {
        self.found.is_none().then(|| self.initialiser.left())
    }

    fn is_lost(&self) -> bool {
        self.found.as_ref().is_some_and(|found| found.is_lost())
    }

    fn recovered(&self) -> Option<Recovered> {
        self.found.as_ref()?.recovered()
    }

    fn tracker(&self) -> Option<&Tracker> {
        self.found.as_ref()?.tracker()
    }

    fn doubtful(&self) -> Option<&Tracker> {
        self.found.as_ref()?.doubtful()
    }

    fn keep_journal(&mut self) {
        self.keeps_journal = true;
        if let Some(localizer) = &mut self.found {
            localizer.keep_journal();
        }
    }
}
