//! Monitors of odometry and receive channels. They identify faults that no filter tolerates.
//!
//! [`Pipeline`](crate::Pipeline) uses them if the vehicle has integrity monitoring. During a fault
//! of the odometry, the pose is unavailable until the odometry agrees with the angles again.

mod channels;
mod confirmation;
mod constancy;
mod contradiction;
mod directions;
mod fallback;
mod fault;
mod motion;
mod repetition;
mod stuck;

pub use channels::ChannelMonitor;
pub use confirmation::Confirmation;
pub use constancy::Constancy;
pub use contradiction::Contradiction;
pub use directions::DirectionMonitor;
pub use fallback::Fallback;
pub use fault::{ActiveFault, ActiveFaults, Fault, FaultSource};
pub use motion::MotionMonitor;
pub use stuck::StuckAngles;

use crate::expected_angle::ExpectedAngle;
use crate::geometry::Pose;
use crate::localize::modes::OdometryTest;
use crate::localize::{AngleUpdate, Ekf, Localizer, UpdateReason};
use crate::observation::{OdometrySample, SsbObservation};
use crate::settings::{Site, Vehicle};

/// Change of the localizer that a fault of the odometry requires.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Change {
    /// The odometry is faulty: localize with angles only.
    Begin,
    /// The odometry is valid again.
    End,
}

/// All monitors of a vehicle, and the identified faults.
#[derive(Debug)]
pub struct Monitors {
    contradiction: Contradiction,
    motion: MotionMonitor,
    constancy: Constancy,
    /// Test of a suspicious odometry.
    test: Option<Box<OdometryTest>>,
    stuck: StuckAngles,
    channels: ChannelMonitor,
    directions: DirectionMonitor,
    /// Confirmation of a given pose. Until it is confirmed, every burst is received.
    confirmation: Confirmation,
    distance_m: f64,
    /// Localization without odometry.
    pub fallback: Fallback,
    faults: ActiveFaults,
    /// Whether the current localizer works without odometry.
    is_without_odometry: bool,
}

impl Monitors {
    /// Creates the monitors of a vehicle at a site with this number of radio heads.
    pub fn new(site: &Site, vehicle: &Vehicle, heads: usize) -> Self {
        Self {
            contradiction: Contradiction::default(),
            motion: MotionMonitor::new(ExpectedAngle::new(vehicle), heads),
            constancy: Constancy::default(),
            test: None,
            stuck: StuckAngles::new(heads),
            channels: ChannelMonitor::new(site, vehicle, heads),
            directions: DirectionMonitor::new(site, vehicle, heads),
            confirmation: Confirmation::new(false, heads),
            distance_m: 0.0,
            fallback: Fallback::new(site, vehicle),
            faults: ActiveFaults::default(),
            is_without_odometry: false,
        }
    }

    /// Returns the active faults.
    pub const fn faults(&self) -> &ActiveFaults {
        &self.faults
    }

    /// Whether the current localizer works without odometry.
    pub const fn is_without_odometry(&self) -> bool {
        self.is_without_odometry
    }

    /// Restarts all comparisons after a change of the pose that the odometry does not explain.
    pub fn restart(&mut self) {
        if let Some(fault) = self.faults.of_odometry() {
            self.faults.end(fault);
        }
        self.is_without_odometry = false;
        self.test = None;
        self.motion.restart();
        self.confirmation.restart();
        self.fallback.forget();
    }

    /// Receives every burst until angles have confirmed the pose again.
    pub fn await_confirmation(&mut self) {
        if self.confirmation.is_confirmed() {
            self.confirmation.restart();
        }
    }

    /// Restarts all monitors of the odometry, whose clock or distance has restarted.
    pub fn forget_odometry(&mut self) {
        self.contradiction = Contradiction::default();
        self.constancy = Constancy::default();
        self.motion.forget();
        self.restart();
    }

    /// Processes an odometry sample. Returns the sample for the localizer.
    pub fn odometry(&mut self, sample: &OdometrySample) -> OdometrySample {
        if let Some(fault) = self.motion.odometry(sample)
            && self.faults.of_odometry().is_none()
        {
            self.faults.begin(fault, sample.time_s);
        }
        self.distance_m = sample.distance_m;
        self.constancy.odometry(sample);
        if !self.constancy.is_suspicious() {
            self.test = None;
        } else if let Some(test) = &mut self.test {
            test.odometry(sample);
        }
        if self.contradiction.odometry(sample) {
            self.faults
                .begin(Fault::OdometryContradictory, sample.time_s);
        } else {
            self.faults.end(Fault::OdometryContradictory);
        }
        if self.is_without_odometry {
            // On a road, a wrong yaw rate would displace the pose to where the road turns like it.
            let has_yaw_rate = !self.faults.contains(Fault::YawRateReversed);
            let followed = self.fallback.odometry(sample);
            OdometrySample {
                yaw_rate_radps: followed.yaw_rate_radps.filter(|_| has_yaw_rate),
                ..followed
            }
        } else {
            *sample
        }
    }

    /// Whether the burst at `time_s` must be received, independent of the wake-up policy.
    pub fn requests_burst(&self, time_s: f64) -> bool {
        self.faults.has_of_vehicle()
            || !self.confirmation.is_confirmed()
            || self.constancy.is_suspicious()
            || self.motion.requests_burst(time_s)
    }

    /// Records that the burst at `time_s` is received.
    pub const fn received(&mut self, time_s: f64) {
        self.motion.received(time_s);
    }

    /// Processes an SSB as received by the array.
    pub fn ssb(&mut self, observation: &SsbObservation) {
        let (faults, time_s) = (&mut self.faults, observation.ssb.time_s);
        let mut change = |fault, begins| {
            if begins {
                faults.begin(fault, time_s);
            } else {
                faults.end(fault);
            }
        };
        (self.channels).ssb(observation, self.distance_m, &mut change);
        (self.directions).ssb(observation, self.distance_m, &mut change);
    }

    /// Compares the angles of a burst at `time_s` with the previous ones, before the localizer uses them.
    pub fn repetitions(&mut self, time_s: f64, updates: &[AngleUpdate]) {
        if self.stuck.angles(updates, self.distance_m) {
            self.faults.begin(Fault::AnglesStuck, time_s);
        } else {
            self.faults.end(Fault::AnglesStuck);
        }
    }

    /// Processes the angles of a burst at `time_s`. `pose` is the pose at the newer of odometry and
    /// burst, or `None` during a search. `ekf` is the filter of the localizer, if the pose is
    /// known.
    pub fn angles(
        &mut self,
        time_s: f64,
        updates: &[AngleUpdate],
        pose: Option<Pose>,
        ekf: Option<&Ekf>,
    ) {
        for update in updates {
            let verdict = update.verdict;
            if verdict.accepted || verdict.reason == UpdateReason::Outlier {
                self.confirmation.angle(update.head.pci, verdict.accepted);
            }
        }
        let found = (self.motion.angles(updates, pose)).or_else(|| self.test(updates, ekf));
        let by_angles = [
            Fault::OdometryFrozen,
            Fault::OdometryReversed,
            Fault::YawRateReversed,
        ];
        match (self.faults.of_odometry(), found) {
            (None, Some(fault)) => {
                self.faults.begin(fault, time_s);
                self.motion.restart();
                self.constancy.mark_fault();
            }
            (Some(fault), _)
                if by_angles.contains(&fault)
                    && self.motion.is_confirmed(time_s)
                    && !self.constancy.is_suspicious() =>
            {
                self.faults.end(fault);
            }
            _ => {}
        }
    }

    /// Retains a copy of the localizer at a time (s) for the case of a fault, unless the odometry is suspicious.
    pub fn retain(&mut self, time_s: f64, localizer: &dyn Localizer) {
        let is_quiet = self.faults.is_empty() && !self.constancy.is_suspicious();
        if is_quiet && self.confirmation.is_confirmed() {
            self.fallback.retain(time_s, localizer);
        }
    }

    /// Tests a suspicious odometry with the angles of a burst. Returns the detected fault.
    fn test(&mut self, updates: &[AngleUpdate], ekf: Option<&Ekf>) -> Option<Fault> {
        if self.is_without_odometry || !self.constancy.is_suspicious() {
            return None;
        }
        match (&mut self.test, ekf) {
            (Some(test), _) => test.angles(updates),
            (None, Some(ekf)) => self.test = Some(Box::new(OdometryTest::new(ekf))),
            (None, None) => {}
        }
        let is_fault = self.test.as_deref().is_some_and(OdometryTest::is_fault);
        is_fault.then_some(Fault::OdometryFrozen)
    }

    /// Ends the test of the odometry, if it is active. Returns pose and distance along the road of its filter without
    /// odometry.
    pub fn take_free_pose(&mut self) -> Option<(Pose, Option<f64>)> {
        let test = self.test.take()?;
        let free = test.free();
        Some((free.pose(free.time_s()).pose, free.along_m()))
    }

    /// Returns the pending change of the localizer.
    pub fn change(&mut self) -> Option<Change> {
        let is_faulty = self.faults.of_odometry().is_some();
        if is_faulty == self.is_without_odometry {
            return None;
        }
        self.is_without_odometry = is_faulty;
        self.motion.restart();
        Some(if is_faulty {
            Change::Begin
        } else {
            Change::End
        })
    }
}
