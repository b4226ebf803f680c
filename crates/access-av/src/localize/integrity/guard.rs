//! A tracker that mistrusts its sources.
//!
//! Beside the tracker that uses every radio head there runs one without each of them. If one radio
//! head is at fault — seen round a corner, moved, spoofed — the tracker without it is not, so the
//! error of the full solution is at most the distance between the two plus the error of the clean
//! one (solution separation, Brown and McBurney 1988, with the separation as it is and not its
//! threshold). The angles of each radio head are tested against the tracker that does not use them.

use super::quantile::RadialQuantile;
use super::sequence_test::SequenceTest;
use crate::localize::tracker::OdometryVerdict;
use crate::localize::{AngleMeasurement, PoseEstimate, Tracker, UpdateVerdict};
use crate::observation::OdometrySample;
use crate::world::RadioHead;

/// What the guard is to promise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IntegrityConfig {
    /// Probability with which the error may exceed the protection level, no source being at fault.
    pub risk: f64,
    /// The same with one source at fault, which is rare in itself.
    pub risk_under_fault: f64,
    /// Protection level above which the position is not to be relied on (m).
    pub alert_limit_m: f64,
    /// Statistic at which a radio head counts as faulty, in standard deviations.
    pub detection_threshold: f64,
    /// Statistic below which a faulty radio head counts as sound again ...
    pub recovery_threshold: f64,
    /// ... after this time (s).
    pub recovery_s: f64,
}

impl Default for IntegrityConfig {
    fn default() -> Self {
        Self {
            risk: 8e-4,
            risk_under_fault: 1e-2,
            alert_limit_m: 1.5,
            detection_threshold: 5.5,
            recovery_threshold: 3.0,
            recovery_s: 5.0,
        }
    }
}

/// Whether the position can be relied on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum IntegrityState {
    /// The protection level holds and is below the alert limit.
    Ok,
    /// The protection level is above the alert limit, or a fault cannot be pinned down.
    Degraded,
    /// Several sources disagree at once, as when the array itself is at fault.
    Unavailable,
}

impl IntegrityState {
    /// Name for files and messages.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Ok => "ok",
            Self::Degraded => "degraded",
            Self::Unavailable => "unavailable",
        }
    }
}

/// Protection level and state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Integrity {
    /// Horizontal protection level (m).
    pub protection_level_m: f64,
    /// What it amounts to.
    pub state: IntegrityState,
    /// Radio heads found faulty.
    pub faulty: usize,
}

/// One radio head and the tracker that does without it.
#[derive(Clone, Debug)]
struct Witness {
    head: RadioHead,
    without: Tracker,
    test: SequenceTest,
    faulty: bool,
    sound_since_s: f64,
}

/// A tracker with its witnesses.
#[derive(Clone, Debug)]
pub struct Guard {
    config: IntegrityConfig,
    nominal: RadialQuantile,
    under_fault: RadialQuantile,
    main: Tracker,
    witnesses: Vec<Witness>,
    now_s: f64,
}

impl Guard {
    /// Guards a tracker of these radio heads.
    pub fn new(tracker: Tracker, heads: &[RadioHead], config: IntegrityConfig) -> Self {
        let witness = |&head: &RadioHead| {
            let mut without = tracker.clone();
            without.set_excluded(&head, true);
            Witness {
                head,
                without,
                test: SequenceTest::default(),
                faulty: false,
                sound_since_s: f64::NEG_INFINITY,
            }
        };
        Self {
            nominal: RadialQuantile::new(config.risk),
            under_fault: RadialQuantile::new(config.risk_under_fault),
            witnesses: heads.iter().map(witness).collect(),
            main: tracker,
            now_s: f64::NEG_INFINITY,
            config,
        }
    }

    /// The tracker that uses every sound source.
    pub const fn tracker(&self) -> &Tracker {
        &self.main
    }

    /// Moves every tracker.
    pub fn odometry(&mut self, sample: &OdometrySample) -> OdometryVerdict {
        for witness in &mut self.witnesses {
            witness.without.odometry(sample);
        }
        self.main.odometry(sample)
    }

    /// Takes in an angle: a test of its radio head, and information for whoever trusts that.
    pub fn update(&mut self, head: &RadioHead, measured: &AngleMeasurement) -> UpdateVerdict {
        self.now_s = self.now_s.max(measured.time_s);
        let mut fired = false;
        for witness in &mut self.witnesses {
            if (witness.head.pci, witness.head.ssb_index) != (head.pci, head.ssb_index) {
                witness.without.update(head, measured);
                continue;
            }
            let Some(innovation) = witness.without.rehearse_excluded(head, measured) else {
                continue;
            };
            // While the vehicle stands, scatter is one look however often it is seen.
            if innovation.measurement_variance < 1.0 {
                witness.test.push(&innovation);
                fired |=
                    !witness.faulty && witness.test.statistic() > self.config.detection_threshold;
            }
            if witness.test.statistic() > self.config.recovery_threshold {
                witness.sound_since_s = self.now_s;
            }
        }
        let verdict = self.main.update(head, measured);
        if fired {
            self.exclude_worst();
        }
        self.readmit();
        verdict
    }

    /// Excludes the radio head that disagrees most, where two others remain to agree without it.
    fn exclude_worst(&mut self) {
        let sound = self
            .witnesses
            .iter()
            .filter(|witness| !witness.faulty)
            .count();
        if sound < 3 {
            return;
        }
        let worst = (self.witnesses.iter_mut())
            .filter(|witness| !witness.faulty)
            .max_by(|a, b| a.test.statistic().total_cmp(&b.test.statistic()));
        let Some(worst) = worst else {
            return;
        };
        worst.faulty = true;
        worst.sound_since_s = self.now_s;
        // What the fault did to the full solution goes with it.
        self.main = worst.without.clone();
        for witness in self.witnesses.iter_mut().filter(|witness| !witness.faulty) {
            witness.without = self.main.clone();
            witness.without.set_excluded(&witness.head, true);
            witness.test = SequenceTest::default();
        }
    }

    fn readmit(&mut self) {
        let since_s = self.now_s - self.config.recovery_s;
        for index in 0..self.witnesses.len() {
            let Some(witness) = self.witnesses.get_mut(index) else {
                return;
            };
            if !witness.faulty || witness.sound_since_s > since_s {
                continue;
            }
            witness.faulty = false;
            let head = witness.head;
            self.main.set_excluded(&head, false);
            for (other, witness) in self.witnesses.iter_mut().enumerate() {
                witness.without.set_excluded(&head, other == index);
            }
        }
    }

    /// The pose at `time_s`.
    pub fn pose(&self, time_s: f64) -> PoseEstimate {
        let mut pose = self.main.pose(time_s);
        pose.integrity = Some(self.integrity(time_s));
        pose
    }

    /// Protection level and state at `time_s`.
    pub fn integrity(&self, time_s: f64) -> Integrity {
        let main = self.main.pose(time_s);
        let mut protection_level_m = self.nominal.radius(main.principal_variances());
        for witness in self.witnesses.iter().filter(|witness| !witness.faulty) {
            let clean = witness.without.pose(time_s);
            let separation_m = main.pose.point().distance_m(clean.pose.point());
            let radius_m = self.under_fault.radius(clean.principal_variances());
            protection_level_m = protection_level_m.max(separation_m + radius_m);
        }
        let threshold = self.config.detection_threshold;
        let doubtful = (self.witnesses.iter())
            .filter(|witness| !witness.faulty && witness.test.statistic() > threshold)
            .count();
        let faulty = self
            .witnesses
            .iter()
            .filter(|witness| witness.faulty)
            .count();
        let state = if doubtful + faulty > 1 && 2 * (doubtful + faulty) >= self.witnesses.len() {
            IntegrityState::Unavailable
        } else if doubtful > 0 || protection_level_m > self.config.alert_limit_m {
            IntegrityState::Degraded
        } else {
            IntegrityState::Ok
        };
        Integrity {
            protection_level_m,
            state,
            faulty,
        }
    }
}
