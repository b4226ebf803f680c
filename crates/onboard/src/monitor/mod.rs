//! Monitors of odometry and receive channels: they identify faults that no filter can tolerate.
//!
//! [`Pipeline`](crate::Pipeline) runs them where the vehicle has an integrity monitor. A fault of the odometry makes the
//! pose unavailable until the odometry agrees with the angles again.

mod channels;
mod confirmation;
mod constancy;
mod contradiction;
mod directions;
mod fallback;
mod fault;
mod motion;

pub use channels::ChannelMonitor;
pub use confirmation::Confirmation;
pub use constancy::Constancy;
pub use contradiction::Contradiction;
pub use directions::DirectionMonitor;
pub use fallback::Fallback;
pub use fault::{ActiveFault, ActiveFaults, Fault, FaultSource};
pub use motion::MotionMonitor;

use crate::expected_angle::ExpectedAngle;
use crate::geometry::Pose;
use crate::localize::modes::OdometryTest;
use crate::localize::{AngleUpdate, Ekf, UpdateReason};
use crate::observation::{OdometrySample, SsbObservation};
use crate::settings::{Site, Vehicle};

/// A change of the localizer that a fault of the odometry requires.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Change {
    /// The odometry is at fault: follow the angles alone.
    Begin,
    /// The odometry is right again.
    End,
}

/// All monitors of a vehicle, and the faults that they have identified.
#[derive(Debug)]
pub struct Monitors {
    contradiction: Contradiction,
    motion: MotionMonitor,
    constancy: Constancy,
    /// Test of a suspicious odometry.
    test: Option<Box<OdometryTest>>,
    channels: ChannelMonitor,
    directions: DirectionMonitor,
    /// Confirmation of a given pose: until then every burst is received.
    confirmation: Confirmation,
    distance_m: f64,
    /// Localization without odometry.
    pub fallback: Fallback,
    faults: ActiveFaults,
    /// Whether the localizer is one without odometry.
    is_without_odometry: bool,
}

impl Monitors {
    /// The monitors of a vehicle at a site with this number of radio heads.
    pub fn new(site: &Site, vehicle: &Vehicle, heads: usize) -> Self {
        Self {
            contradiction: Contradiction::default(),
            motion: MotionMonitor::new(ExpectedAngle::new(vehicle), heads),
            constancy: Constancy::default(),
            test: None,
            channels: ChannelMonitor::new(site, vehicle, heads),
            directions: DirectionMonitor::new(site, vehicle, heads),
            confirmation: Confirmation::new(false, heads),
            distance_m: 0.0,
            fallback: Fallback::new(site, vehicle),
            faults: ActiveFaults::default(),
            is_without_odometry: false,
        }
    }

    /// The active faults.
    pub const fn faults(&self) -> &ActiveFaults {
        &self.faults
    }

    /// Whether the localizer is one without odometry.
    pub const fn is_without_odometry(&self) -> bool {
        self.is_without_odometry
    }

    /// Starts again with another pose, for all that the odometry did before.
    pub fn restart(&mut self) {
        if let Some(fault) = self.faults.of_odometry() {
            self.faults.end(fault);
        }
        self.is_without_odometry = false;
        self.test = None;
        self.motion.restart();
        self.confirmation.restart();
    }

    /// Receives every burst until angles have confirmed the pose again.
    pub fn await_confirmation(&mut self) {
        if self.confirmation.is_confirmed() {
            self.confirmation.restart();
        }
    }

    /// Starts again with another odometry.
    pub fn forget_odometry(&mut self) {
        self.contradiction = Contradiction::default();
        self.constancy = Constancy::default();
        self.motion.forget();
        self.restart();
    }

    /// Takes in an odometry sample. Returns the sample for the localizer.
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
            self.fallback.odometry(sample)
        } else {
            *sample
        }
    }

    /// Whether the burst at a time (s) is to be received, whatever the wake-up policy says.
    pub fn wants(&self, time_s: f64) -> bool {
        self.faults.has_of_vehicle()
            || !self.confirmation.is_confirmed()
            || self.constancy.is_suspicious()
            || self.motion.wants(time_s)
    }

    /// Notes that the burst at a time (s) is received.
    pub const fn received(&mut self, time_s: f64) {
        self.motion.received(time_s);
    }

    /// Takes in an SSB as the array received it.
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

    /// Takes in the angles of a burst at a time (s), given the pose at the newer of odometry and burst, `None` while it is
    /// searched for. `ekf` is the filter of the localizer, if the pose is known.
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
        let by_angles = [Fault::OdometryFrozen, Fault::OdometryReversed];
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

    /// Tests a suspicious odometry by the angles of a burst. Returns the fault that they show.
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

    /// Ends the test of the odometry, if it runs. Returns the pose of its filter that does not depend on the odometry.
    pub fn take_free_pose(&mut self) -> Option<Pose> {
        let test = self.test.take()?;
        let free = test.free();
        Some(free.pose(free.time_s()).pose)
    }

    /// Returns the change of the localizer that is due.
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
