//! The live pipeline.

use std::collections::VecDeque;

use num_complex::Complex32;

use super::clocks::Clocks;
use super::error::LiveError;
use super::outcome::{HeadStatus, Outcome};
use super::start::starting_at;
use super::status::{Reason, State, Status};
use super::stream::{SampleStream, StreamConfig, StreamCounts};
use super::stream_clock::Continuity;
use super::time_base::ClockStep;
use super::time_check::TimeCheck;
use crate::BoxError;
use crate::burst::{Burst, OfSsb};
use crate::energy::{Energy, EnergyModel};
use crate::geometry::{Pose, wrap_angle};
use crate::localize::{
    self, AngleMeasurement, HISTORY_S, IntegrityState, OdometryVerdict, PoseEstimate, UpdateReason,
};
use crate::monitor::Confirmation;
use crate::observation::{BURST_S, OdometrySample, SensedSsb};
use crate::pipeline::{Custom, OdometryDefect, Onboard};
use crate::radio_head::RadioHead;
use crate::receive::ReceiverConfig;
use crate::settings::{Boundary, Extent, Platform, Site, Vehicle};
use crate::sight::Sight;

/// Outcomes kept until they are asked for.
const OUTCOMES: usize = 256;

/// Angles of a burst at most.
const ANGLES: usize = 64;

/// Odometry that is older does not vouch for a pose (s).
const SILENT_S: f64 = 0.5;

/// Time without an accepted angle that is a reason of its own (s).
const NO_ANGLE_S: f64 = 5.0;

/// How far ahead the next wake-up is looked for (s).
const LOOK_AHEAD_S: f64 = 1.0;

/// Maximum time since the last SSB, in seconds, for which windows are placed by the time of that SSB. A
/// stretch of samples without an SSB, later than this, means that the windows may be misplaced.
const SSB_SILENT_S: f64 = 1.0;

/// SNR (dB) of an angle of which none is stated: good enough for any policy.
const UNSTATED_SNR_DB: f64 = 20.0;

/// An angle that was estimated elsewhere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AngleObservation {
    /// Physical cell identity.
    pub pci: u16,
    /// Index of the SSB in its burst.
    pub ssb_index: u8,
    /// Reception time in seconds.
    pub time_s: f64,
    /// Electrical angle ω = 2π(d/λ)·cos θ between neighbours in a row, or azimuth from the axis of any
    /// other array, in radians.
    pub phase_rad: f64,
    /// Its standard deviation in radians.
    pub sigma_rad: f64,
    /// SNR per antenna in dB, where known.
    pub snr_db: Option<f64>,
    /// Whether the estimator vouches for it: that it is Gaussian with this standard deviation.
    pub resolved: bool,
}

/// What was done since the start, and the energy of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LiveEnergy {
    /// Time since the first that came in, in seconds.
    pub duration_s: f64,
    /// Angles estimated.
    pub executions: usize,
    /// Bursts listened to.
    pub listened: usize,
    /// How long the receiver was to be on for those, as the platform's file has it, in seconds.
    pub on_time_s: f64,
    /// The energy; `None` where the platform says nothing of the vehicle's method.
    pub energy: Option<Energy>,
    /// What its sum counts.
    pub boundary: Option<Boundary>,
}

/// The pipeline on a vehicle, fed as things come in.
pub struct Live {
    site: Site,
    vehicle: Vehicle,
    onboard: Onboard,
    has_own_localizer: bool,
    sight: Sight,
    stream: Option<SampleStream>,
    /// Angles of a burst that is not yet complete.
    angles: Vec<(SensedSsb, AngleMeasurement)>,
    outcomes: VecDeque<Outcome>,
    heads: Vec<HeadStatus>,
    /// Clocks of the sources; all other times here are of the pipeline, but those of `heads` of the odometry's clock.
    clocks: Clocks,
    odometry_step: Option<ClockStep>,
    refused_burst: Option<LiveError>,
    confirmation: Confirmation,
    /// When the localizer found its pose again last.
    recovered_s: Option<f64>,
    last_angle_s: Option<f64>,
    /// The first SSB of the last burst: its sample time and its index.
    last_burst: Option<(f64, u8)>,
    /// Whether samples have come since the last SSB or the end of the last stretch.
    has_samples: bool,
    /// Stretches of samples without an SSB since the last SSB.
    empty_stretches: u32,
    /// Whether samples were interrupted for an unknown time, and no SSB has come since.
    is_resuming: bool,
    energy: Option<EnergyModel>,
    executions: usize,
    listened: usize,
    /// First and newest of all times.
    interval_s: Option<[f64; 2]>,
}

impl Live {
    /// The pipeline of a vehicle at a site, at `start`, else where the vehicle's settings say, else in
    /// search of its start. Without `stream` it takes angles only.
    ///
    /// # Errors
    /// [`LiveError`] when site, vehicle, platform and stream do not go together, or a start is
    /// missing and cannot be found.
    pub fn new(
        site: &Site,
        vehicle: &Vehicle,
        platform: &Platform,
        start: Option<Pose>,
        stream: Option<StreamConfig>,
        custom: Custom,
    ) -> Result<Self, LiveError> {
        let (vehicle, start) = starting_at(site, vehicle, start)?;
        let has_own_localizer = custom.localizer.is_some();
        let onboard = Onboard::new(site, &vehicle, platform, start, custom)?;
        let receiver = || ReceiverConfig::new(site, &vehicle);
        let stream = stream.map(|config| SampleStream::new(config, receiver()));
        let heads = RadioHead::heard(site, &vehicle);
        Ok(Self {
            sight: Sight::new(&vehicle),
            stream: stream.transpose()?,
            angles: Vec::with_capacity(ANGLES),
            outcomes: VecDeque::with_capacity(OUTCOMES),
            confirmation: Confirmation::new(!vehicle.start.known, heads.len()),
            heads: heads.into_iter().map(HeadStatus::new).collect(),
            clocks: Clocks::default(),
            odometry_step: None,
            refused_burst: None,
            recovered_s: None,
            last_angle_s: None,
            last_burst: None,
            has_samples: false,
            empty_stretches: 0,
            is_resuming: false,
            energy: EnergyModel::new(&vehicle, platform, Extent::Value)?,
            executions: 0,
            listened: 0,
            interval_s: None,
            has_own_localizer,
            onboard,
            site: site.clone(),
            vehicle,
        })
    }

    /// Sets when the inputs that follow have arrived, in seconds by a monotonic clock, so that their time stamps are
    /// validated against it; without, only against their predecessors.
    pub const fn set_arrival(&mut self, arrival_s: Option<f64>) {
        self.clocks.arrival_s = arrival_s;
    }

    /// Takes in the next samples of every antenna, of any length, the first of which was received at
    /// `time_s` by the sample clock; what became of the SSBs in them is then among the
    /// [`outcomes`](Self::next_outcome). Samples that are missing, there twice, or of a stream that began
    /// anew, are told by that time.
    ///
    /// # Errors
    /// [`LiveError`] for another number of antennas, unequal lengths or a time that is not plausible.
    pub fn samples(
        &mut self,
        time_s: f64,
        antennas: &[&[Complex32]],
    ) -> Result<Continuity, LiveError> {
        let continuity = self.receive(time_s, antennas)?;
        self.hear_before(f64::INFINITY)?;
        Ok(continuity)
    }

    /// As [`samples`](Self::samples), but nothing is heard before [`hear_before`](Self::hear_before) says so: for
    /// recordings, whose odometry is known before it is its turn.
    ///
    /// # Errors
    /// As [`samples`](Self::samples).
    pub fn receive(
        &mut self,
        time_s: f64,
        antennas: &[&[Complex32]],
    ) -> Result<Continuity, LiveError> {
        plausible("samples", time_s)?;
        let stream = self.stream.as_mut().ok_or(LiveError::NoStream)?;
        let continuity = stream.push(time_s, antennas)?;
        self.has_samples = true;
        if let Some(end_s) = stream.next_s() {
            self.see(self.clocks.angles.inside(end_s));
        }
        Ok(continuity)
    }

    /// Hears the bursts that are complete and began before `time_s`.
    ///
    /// # Errors
    /// [`LiveError::Custom`] where the user's own code fails.
    pub fn hear_before(&mut self, time_s: f64) -> Result<(), LiveError> {
        while let Some(stream) = &mut self.stream {
            let burst = stream.burst();
            let number = burst.len();
            let Some(first_s) = burst.first().map(|first| first.ssb().time_s) else {
                break;
            };
            if first_s >= time_s {
                break;
            }
            let newest = self.onboard.newest_odometry();
            let refused = match self.clocks.accept_burst("SSBs", first_s, newest) {
                Ok(inside_s) => {
                    stream.shift(number, inside_s - first_s);
                    None
                }
                Err(error) => Some(error),
            };
            if let Some(error) = refused {
                stream.forget(number);
                self.refused_burst = Some(error);
                continue;
            }
            let heard = hear(&mut self.onboard, stream.first(number));
            stream.forget(number);
            self.book(heard)?;
        }
        Ok(())
    }

    /// Ends a stretch of samples after which some will be missing, so that its last SSBs are found at once.
    ///
    /// # Errors
    /// [`LiveError::Receive`].
    pub fn end_stretch(&mut self) -> Result<(), LiveError> {
        self.empty_stretches += u32::from(std::mem::take(&mut self.has_samples));
        match &mut self.stream {
            Some(stream) => stream.break_off(),
            None => Ok(()),
        }
    }

    /// Takes in odometry, and returns the localizer's verdict on it. Its speed alone is enough: see
    /// [`OdometrySample::of_speed`]. A message that establishes a new time base resumes the pose, whose covariance grows
    /// by the odometry's error over the elapsed time and distance: see [`take_odometry_step`](Self::take_odometry_step).
    ///
    /// # Errors
    /// [`LiveError::Time`] for a time that is not plausible, [`LiveError::Odometry`] for a value that is not finite.
    pub fn odometry(&mut self, sample: &OdometrySample) -> Result<OdometryVerdict, LiveError> {
        let is_infinite = |value: f64| value.is_infinite();
        if !sample.speed_mps.is_finite()
            || is_infinite(sample.distance_m)
            || sample.yaw_rate_radps.is_some_and(|it| !it.is_finite())
        {
            return Err(OdometryDefect::NotFinite.into());
        }
        let what = "odometry";
        let (sample, step) =
            (self.clocks.odometry(sample)).map_err(|defect| LiveError::Time { what, defect })?;
        if let Some(step) = step {
            self.odometry_step = Some(step);
            self.resumed(&step);
        }
        if let Some((first, _)) = self.angles.first()
            && first.time_s + BURST_S <= sample.time_s
        {
            self.hear_angles()?;
        }
        let sample = self.with_distance(&sample);
        let verdict = self
            .onboard
            .odometry(&sample)
            .map_err(LiveError::Custom)??;
        self.see(sample.time_s);
        Ok(verdict)
    }

    /// The odometry's clock has stepped: its times that were given out are those of the new clock from now on.
    fn resumed(&mut self, step: &ClockStep) {
        for head in &mut self.heads {
            for time_s in [&mut head.last_heard_s, &mut head.last_accepted_s] {
                *time_s = time_s.map(|it| it + step.step_s);
            }
        }
        self.confirmation.restart();
    }

    /// Time of the newest odometry by its clock, in seconds.
    pub fn newest_odometry_s(&self) -> Option<f64> {
        let newest = self.onboard.newest_odometry()?;
        Some(self.clocks.odometry.outside(newest.time_s))
    }

    /// Step of the odometry's clock that was recognized since this was called last; the pose was resumed then.
    pub const fn take_odometry_step(&mut self) -> Option<ClockStep> {
        self.odometry_step.take()
    }

    /// Step of the clock of samples or angles that was recognized since this was called last.
    pub const fn take_angle_step(&mut self) -> Option<ClockStep> {
        self.clocks.take_angle_step()
    }

    /// Cause of the last burst of SSBs whose time was rejected since this was called last.
    pub const fn take_refused_burst(&mut self) -> Option<LiveError> {
        self.refused_burst.take()
    }

    /// Time of angles minus that of odometry, in seconds, where their clocks differ.
    pub fn clock_disagreement_s(&self) -> Option<f64> {
        let newest = self.onboard.newest_odometry()?;
        self.clocks.disagreement_s(newest)
    }

    /// Takes in an angle that was estimated elsewhere. Those of a burst, of SSBs within half a frame, are
    /// heard together: once odometry, a later angle or [`settle`](Self::settle) says that it is complete.
    ///
    /// # Errors
    /// [`LiveError::Value`] for a value that is not possible, [`LiveError::Time`], [`LiveError::AngleAhead`] and
    /// [`LiveError::AngleRepeated`] for a time that is not plausible.
    pub fn angle(&mut self, angle: &AngleObservation) -> Result<(), LiveError> {
        finite("an angle", angle.phase_rad)?;
        finite("the SNR of an angle", angle.snr_db.unwrap_or_default())?;
        let sigma_rad = angle.sigma_rad;
        if !(sigma_rad > 0.0 && sigma_rad.is_finite()) {
            return Err(LiveError::Value {
                what: "the standard deviation of an angle",
                value: sigma_rad,
                allowed: "it must be positive",
            });
        }
        let newest = self.onboard.newest_odometry();
        let time_s = self.clocks.accept_burst("angle", angle.time_s, newest)?;
        if self.is_repeated(angle, time_s) {
            return Err(LiveError::AngleRepeated { pci: angle.pci });
        }
        if let Some((first, _)) = self.angles.first()
            && ((time_s - first.time_s).abs() >= BURST_S || self.angles.len() == ANGLES)
        {
            self.hear_angles()?;
        }
        let snr_db = angle.snr_db.unwrap_or(UNSTATED_SNR_DB);
        let ssb = SensedSsb {
            pci: angle.pci,
            ssb_index: angle.ssb_index,
            time_s,
            snr_db,
        };
        let measured = AngleMeasurement {
            time_s,
            phase_rad: angle.phase_rad,
            phase_sigma_rad: sigma_rad,
            angle_rad: self.sight.measurand().angle_rad(angle.phase_rad),
            snr_db,
            resolved: angle.resolved,
        };
        self.angles.push((ssb, measured));
        Ok(())
    }

    /// Whether an angle is a copy of the last one of its radio head; `time_s` is its time of the pipeline.
    fn is_repeated(&self, angle: &AngleObservation, time_s: f64) -> bool {
        let is_same = |(ssb, measured): &(SensedSsb, AngleMeasurement)| {
            (ssb.pci, ssb.ssb_index, ssb.time_s) == (angle.pci, angle.ssb_index, time_s)
                && measured.phase_rad == angle.phase_rad
        };
        let heard_s = Some(self.clocks.odometry.outside(time_s));
        self.angles.iter().any(is_same)
            || (self.heads.iter())
                .any(|it| it.head.sends(angle.pci, angle.ssb_index) && it.last_heard_s == heard_s)
    }

    /// Hears what has come of a burst without waiting for more of it, as at the end of a drive.
    ///
    /// # Errors
    /// [`LiveError::Custom`] where the user's own code fails.
    pub fn settle(&mut self) -> Result<(), LiveError> {
        self.end_stretch()?;
        self.hear_before(f64::INFINITY)?;
        self.hear_angles()
    }

    /// What became of the angles since this was asked last, oldest first; beyond 256 the oldest are
    /// forgotten.
    pub fn next_outcome(&mut self) -> Option<Outcome> {
        self.outcomes.pop_front()
    }

    /// The pose is this at `time_s`, with the covariance of (x, y, heading), or as uncertain as the
    /// vehicle's settings say of a start. What was learnt while driving is forgotten.
    ///
    /// # Errors
    /// [`LiveError`] for values that are not possible, for a time more than half a second from the
    /// newest odometry, and where the localizer is the user's own.
    pub fn set_pose(
        &mut self,
        time_s: f64,
        pose: Pose,
        covariance: Option<[[f64; 3]; 3]>,
    ) -> Result<(), LiveError> {
        plausible("set-pose", time_s)?;
        let time_s = self.clocks.odometry.inside(time_s);
        for value in [pose.x_m, pose.y_m, pose.heading_rad] {
            finite("a pose", value)?;
        }
        if self.has_own_localizer {
            return Err(LiveError::OwnLocalizer);
        }
        let mut vehicle = self.vehicle.clone();
        vehicle.start.known = true;
        if let Some(covariance) = covariance {
            let (position_std_m, heading_std_rad) = deviations(&covariance)?;
            vehicle.start.position_std_m = position_std_m;
            vehicle.start.heading_std_rad = heading_std_rad;
        }
        let mut now = pose;
        if let Some(newest) = self.onboard.newest_odometry() {
            let elapsed_s = newest.time_s - time_s;
            if elapsed_s.abs() > HISTORY_S {
                return Err(LiveError::Value {
                    what: "the time of a pose from the newest odometry's",
                    value: -elapsed_s,
                    allowed: "it must be within 0.5 s",
                });
            }
            let turn_rad = newest.yaw_rate_radps.unwrap_or(0.0) * elapsed_s;
            now = pose.along_chord(newest.speed_mps * elapsed_s, turn_rad);
        }
        self.begin_at(&vehicle, now)
    }

    /// Forgets pose, odometry and all that was learnt, and searches for the pose as from the start of a
    /// drive; times may be earlier than before from now on.
    ///
    /// # Errors
    /// [`LiveError::Settings`] where the vehicle cannot be found by searching
    /// ([`set_pose`](Self::set_pose) then), [`LiveError::OwnLocalizer`].
    pub fn reset(&mut self) -> Result<(), LiveError> {
        if self.has_own_localizer {
            return Err(LiveError::OwnLocalizer);
        }
        let mut unknown = self.vehicle.clone();
        unknown.start.pose = None;
        let (unknown, anywhere) = starting_at(&self.site, &unknown, None)?;
        self.onboard.forget_odometry();
        self.clocks.reset();
        self.begin_at(&unknown, anywhere)?;
        (self.last_angle_s, self.last_burst) = (None, None);
        (self.has_samples, self.empty_stretches) = (false, 0);
        self.interval_s = None;
        (self.executions, self.listened) = (0, 0);
        Ok(())
    }

    /// The vehicle by its settings.
    pub(super) const fn vehicle(&self) -> &Vehicle {
        &self.vehicle
    }

    /// Whether the odometry counts the distance.
    pub(super) fn has_distance(&self) -> bool {
        self.clocks.has_distance()
    }

    /// Replaces the localizer by that of a vehicle at a start.
    pub(super) fn begin_at(&mut self, vehicle: &Vehicle, start: Pose) -> Result<(), LiveError> {
        let localizer = localize::built_in(&self.site, vehicle, start)?;
        self.confirmation = Confirmation::new(!vehicle.start.known, self.heads.len());
        self.angles.clear();
        self.onboard
            .replace_localizer(localizer)
            .map_err(LiveError::Custom)
    }

    /// Leaves a cell out from now on.
    ///
    /// # Errors
    /// [`LiveError::UnknownCell`].
    pub fn exclude(&mut self, pci: u16) -> Result<(), LiveError> {
        self.set_excluded(pci, true)
    }

    /// Takes a cell in again that was left out.
    ///
    /// # Errors
    /// [`LiveError::UnknownCell`].
    pub fn readmit(&mut self, pci: u16) -> Result<(), LiveError> {
        self.set_excluded(pci, false)
    }

    fn set_excluded(&mut self, pci: u16, excluded: bool) -> Result<(), LiveError> {
        if !self.onboard.exclude(pci, excluded) {
            return Err(LiveError::UnknownCell { pci });
        }
        for status in self.heads.iter_mut().filter(|it| it.head.pci == pci) {
            status.is_excluded = excluded;
        }
        Ok(())
    }

    /// What is known of each radio head that the vehicle listens to.
    pub fn heads(&self) -> &[HeadStatus] {
        &self.heads
    }

    /// What has come of the samples.
    pub fn stream_counts(&self) -> StreamCounts {
        let counts = self.stream.as_ref().map(SampleStream::counts);
        counts.unwrap_or_default()
    }

    /// The pipeline, to ask it for calibration and findings.
    pub const fn onboard(&self) -> &Onboard {
        &self.onboard
    }

    /// How the vehicle stands at `now_s`. A pose is told for half a second beyond the newest odometry at
    /// most.
    ///
    /// # Errors
    /// [`LiveError::Value`] for a time that is not finite, [`LiveError::Custom`].
    pub fn status(&self, now_s: f64) -> Result<Status, LiveError> {
        finite("the time of a status", now_s)?;
        let now_s = self.clocks.odometry.inside(now_s);
        let mut status = self.status_inside(now_s)?;
        let clock = &self.clocks.odometry;
        status.time_s = clock.outside(status.time_s);
        status.last_angle_s = status.last_angle_s.map(|it| clock.outside(it));
        Ok(status)
    }

    /// The status at a time of the pipeline, with times of the pipeline.
    fn status_inside(&self, now_s: f64) -> Result<Status, LiveError> {
        let newest = self.onboard.newest_odometry();
        let age_s = newest.map(|it| now_s - it.time_s);
        let end_s = self.stream.as_ref().and_then(SampleStream::next_s);
        let mut status = Status {
            time_s: now_s,
            pose: None,
            covariance: None,
            speed_mps: newest.map_or(0.0, |it| it.speed_mps),
            yaw_rate_radps: newest.and_then(|it| it.yaw_rate_radps),
            state: State::Waiting,
            reason: Reason::NoOdometry,
            protection_level_m: None,
            faulty: 0,
            last_angle_s: self.last_angle_s,
            odometry_age_s: age_s,
            samples_age_s: end_s.map(|end_s| now_s - self.clocks.angles.inside(end_s)),
            tracked: self.stream.as_ref().map_or(0, SampleStream::tracked),
            faults: *self.onboard.faults(),
        };
        let (Some(newest), Some(age_s)) = (newest, age_s) else {
            return Ok(status);
        };
        status.time_s = newest.time_s + age_s.clamp(0.0, SILENT_S);
        if (0.0..=SILENT_S).contains(&age_s) {
            status.time_s = now_s;
        }
        let estimate = self
            .onboard
            .pose(status.time_s)
            .map_err(LiveError::Custom)?;
        // The filter's heading is continuous over several turns.
        status.pose = Some(Pose {
            heading_rad: wrap_angle(estimate.pose.heading_rad),
            ..estimate.pose
        });
        status.covariance = estimate.covariance;
        let integrity = estimate.integrity;
        status.protection_level_m = integrity.map(|it| it.protection_level_m);
        status.faulty = integrity.map_or(0, |it| it.faulty);
        (status.state, status.reason) = if age_s > SILENT_S {
            (State::Unavailable, Reason::OdometrySilent { age_s })
        } else if let Some(offset_s) = self.clocks.disagreement_s(newest) {
            (State::Unavailable, Reason::ClocksDisagree { offset_s })
        } else {
            self.judge(&estimate, now_s)
        };
        Ok(status)
    }

    /// State and reason of a pose with odometry behind it.
    fn judge(&self, estimate: &PoseEstimate, now_s: f64) -> (State, Reason) {
        if let Some(places) = self.onboard.searching() {
            let reason = match self.last_angle_s {
                None => Reason::NoAngle,
                Some(_) => Reason::SeveralPlaces { places },
            };
            return (State::Searching, reason);
        }
        let faults = self.onboard.faults();
        if let Some(fault) = faults.of_odometry().or_else(|| faults.of_angles()) {
            return (State::Unavailable, Reason::SensorFault(fault));
        }
        if self.onboard.is_lost() {
            return (State::Lost, Reason::AnglesElsewhere);
        }
        let Some(integrity) = estimate.integrity else {
            return (State::Unmonitored, Reason::NotMonitored);
        };
        let faulty = integrity.faulty;
        match integrity.state {
            IntegrityState::Ok | IntegrityState::Degraded if !self.confirmation.is_confirmed() => {
                (State::Unavailable, Reason::Unconfirmed)
            }
            IntegrityState::Ok if faulty > 0 => (State::Ok, Reason::FaultyHeads { heads: faulty }),
            IntegrityState::Ok => (State::Ok, Reason::Nominal),
            IntegrityState::Unavailable => (State::Unavailable, Reason::SourcesDisagree),
            IntegrityState::Degraded => {
                let level_m = integrity.protection_level_m;
                let monitor = self.vehicle.integrity_monitor().unwrap_or_default();
                let limit_m = monitor.alert_limit_m;
                let silent_s = self.last_angle_s.map(|last_s| now_s - last_s);
                let reason = match silent_s {
                    _ if level_m <= limit_m && faulty > 0 => Reason::FaultyHeads { heads: faulty },
                    _ if level_m <= limit_m => Reason::FaultSuspected,
                    None => Reason::NoAngle,
                    Some(age_s) if age_s > NO_ANGLE_S => Reason::AnglesSilent { age_s },
                    Some(_) => Reason::LevelAboveLimit { level_m, limit_m },
                };
                (State::Degraded, reason)
            }
        }
    }

    /// Whether the burst at `time_s` is wanted, as things stand now.
    ///
    /// # Errors
    /// [`LiveError::Custom`] where the user's own policy fails.
    pub fn listens(&mut self, time_s: f64) -> Result<bool, LiveError> {
        finite("the time of a burst", time_s)?;
        let time_s = self.clocks.angles.inside(time_s);
        self.onboard.listens(time_s).map_err(LiveError::Custom)
    }

    /// When the receiver has to be on next, after `now_s`: at the beginning of the next burst that is
    /// wanted if the vehicle drives on as it does. Where none is within a second, when to ask again. `now_s`
    /// itself while no SSB is known, while the place is searched for, after
    /// [`samples_resumed`](Self::samples_resumed), and where stretches of samples had no SSB for a second.
    /// Both are times of the samples, without [`time_offset_s`](Self::time_offset_s).
    ///
    /// # Errors
    /// As [`listens`](Self::listens).
    pub fn next_wake_up_s(&mut self, now_s: f64) -> Result<f64, LiveError> {
        finite("the time of a wake-up", now_s)?;
        let untracked = self.stream.as_ref().is_some_and(|it| it.tracked() == 0);
        let is_searching = self.onboard.searching().is_some() || self.onboard.is_lost();
        let is_silent = |last_s: f64| self.empty_stretches > 0 && now_s - last_s >= SSB_SILENT_S;
        let is_open = untracked || is_searching || self.is_resuming;
        let last_burst = self
            .last_burst
            .filter(|(last_s, _)| !is_open && !is_silent(*last_s));
        let Some((last_s, _)) = last_burst else {
            return Ok(now_s);
        };
        let offset_s = self.time_offset_s();
        let period_s = self.site.ssb.period_s();
        let first = ((now_s - last_s) / period_s).floor() + 1.0;
        let mut burst_s = last_s + first * period_s;
        let mut ahead = 1.0;
        while burst_s < now_s + LOOK_AHEAD_S && !self.listens(burst_s + offset_s)? {
            burst_s = last_s + (first + ahead) * period_s;
            ahead += 1.0;
        }
        Ok(burst_s)
    }

    /// Time minus sample time, in seconds: as set by [`set_time_offset_s`](Self::set_time_offset_s), else the
    /// gaps that the sample times did not report.
    pub fn time_offset_s(&self) -> f64 {
        (self.stream.as_ref()).map_or(0.0, SampleStream::correction_s)
    }

    /// Sets time minus sample time, in seconds, where samples are counted and their arrival is measured:
    /// counting keeps the times of SSBs exact while the offset may drift or step. `None` derives it from
    /// the SSBs.
    pub const fn set_time_offset_s(&mut self, offset_s: Option<f64>) {
        if let Some(stream) = &mut self.stream {
            stream.set_offset_s(offset_s);
        }
    }

    /// Adds an interruption of the samples, in seconds, that their times do not report: whole periods of the
    /// SSB, because the SSBs tell the rest.
    pub fn add_interruption(&mut self, lost_s: f64) {
        if let Some(stream) = &mut self.stream {
            stream.add_interruption(lost_s);
        }
    }

    /// Notes that samples resumed after an interruption of unknown length:
    /// [`next_wake_up_s`](Self::next_wake_up_s) wants every sample until an SSB is received.
    pub const fn samples_resumed(&mut self) {
        self.is_resuming = true;
    }

    /// Index of the first SSB of the last burst, whose times [`next_wake_up_s`](Self::next_wake_up_s) goes
    /// on from.
    pub fn last_ssb_index(&self) -> Option<u8> {
        self.last_burst.map(|(_, ssb_index)| ssb_index)
    }

    /// What was done since the start or the last reset, and the energy of it by the platform's model.
    pub fn energy(&self) -> LiveEnergy {
        let duration_s = self
            .interval_s
            .map_or(0.0, |[first_s, last_s]| last_s - first_s);
        let (executions, listened) = (self.executions, self.listened);
        let model = self.energy.as_ref();
        LiveEnergy {
            duration_s,
            executions,
            listened,
            on_time_s: model.map_or(0.0, |model| listened as f64 * model.on_time_s),
            energy: model.map(|model| model.of_run(executions, listened, duration_s)),
            boundary: model.map(|model| model.boundary),
        }
    }

    /// Notes a time that came in.
    fn see(&mut self, time_s: f64) {
        let [first_s, last_s] = self.interval_s.unwrap_or([time_s; 2]);
        self.interval_s = Some([first_s.min(time_s), last_s.max(time_s)]);
    }

    /// A sample whose distance is not known drives on by its speed.
    fn with_distance(&self, sample: &OdometrySample) -> OdometrySample {
        if !sample.distance_m.is_nan() {
            return *sample;
        }
        let distance_m = self.onboard.newest_odometry().map_or(0.0, |last| {
            let elapsed_s = sample.time_s - last.time_s;
            last.distance_m + 0.5 * (last.speed_mps + sample.speed_mps) * elapsed_s
        });
        OdometrySample {
            distance_m,
            ..*sample
        }
    }

    fn hear_angles(&mut self) -> Result<(), LiveError> {
        if self.angles.is_empty() {
            return Ok(());
        }
        let heard = hear(&mut self.onboard, &self.angles);
        self.angles.clear();
        self.book(heard)
    }

    /// Writes down what became of a burst.
    fn book(&mut self, heard: Result<Heard, BoxError>) -> Result<(), LiveError> {
        let Heard {
            time_s,
            ssb_index,
            listened,
        } = heard.map_err(LiveError::Custom)?;
        self.see(time_s);
        let burst_s = self.clocks.angles.outside(time_s) - self.time_offset_s();
        self.last_burst = Some((burst_s, ssb_index));
        (self.has_samples, self.empty_stretches) = (false, 0);
        self.is_resuming = false;
        self.listened += usize::from(listened);
        let newest_s = self.onboard.newest_odometry().map(|it| it.time_s);
        let after_s = newest_s.unwrap_or(time_s).max(time_s);
        let after = self.onboard.pose(after_s).map_err(LiveError::Custom)?;
        let (odometry, angles) = (&self.clocks.odometry, &self.clocks.angles);
        let mut found = after;
        found.time_s = odometry.outside(after.time_s);
        if let Some(recovered) = self.onboard.recovered()
            && self.recovered_s.is_none_or(|it| it < recovered.time_s)
        {
            self.recovered_s = Some(recovered.time_s);
            self.confirmation.confirm();
        }
        for &execution in self.onboard.executions() {
            self.executions += 1;
            let (ssb, verdict) = (execution.ssb, execution.verdict);
            let sends = |it: &&mut HeadStatus| it.head.sends(ssb.pci, ssb.ssb_index);
            let mut status = self.heads.iter_mut().find(sends);
            let residual_rad = (status.as_ref())
                .zip(execution.measured)
                .map(|(it, measured)| {
                    let value_rad = measured.phase_rad;
                    self.sight.residual_rad(after.pose, &it.head, value_rad)
                });
            if verdict.accepted {
                self.last_angle_s = Some(ssb.time_s);
            }
            let is_judged = verdict.accepted || verdict.reason == UpdateReason::Outlier;
            if is_judged && self.clocks.agree() {
                self.confirmation.angle(ssb.pci, verdict.accepted);
            }
            let heard_s = odometry.outside(ssb.time_s);
            if let Some(status) = &mut status {
                status.is_faulty = !status.is_excluded && verdict.reason == UpdateReason::Excluded;
                status.snr_db = Some(ssb.snr_db);
                status.last_heard_s = Some(heard_s);
                status.residual_rad = residual_rad;
                status.accepted += u64::from(verdict.accepted);
                status.refused += u64::from(!verdict.accepted);
                if verdict.accepted {
                    status.last_accepted_s = Some(heard_s);
                }
            }
            if self.outcomes.len() == OUTCOMES {
                self.outcomes.pop_front();
            }
            let mut execution = execution;
            execution.ssb.time_s = angles.outside(ssb.time_s);
            if let Some(measured) = &mut execution.measured {
                measured.time_s = angles.outside(measured.time_s);
            }
            self.outcomes.push_back(Outcome {
                execution,
                residual_rad,
                after: found,
            });
        }
        if !self.confirmation.is_confirmed() {
            self.onboard.await_confirmation();
        }
        Ok(())
    }
}

/// Time and index of a burst's first SSB, and whether it was listened to.
struct Heard {
    time_s: f64,
    ssb_index: u8,
    listened: bool,
}

fn hear<T: OfSsb>(onboard: &mut Onboard, burst: &[T]) -> Result<Heard, BoxError> {
    let first = burst.first().map(OfSsb::ssb);
    let (time_s, ssb_index) = first.map_or((0.0, 0), |it| (it.time_s, it.ssb_index));
    let listened = onboard.hear(time_s, &mut Burst(burst))?.listened;
    Ok(Heard {
        time_s,
        ssb_index,
        listened,
    })
}

fn finite(what: &'static str, value: f64) -> Result<(), LiveError> {
    let allowed = "it must be a finite number";
    if value.is_finite() {
        return Ok(());
    }
    Err(LiveError::Value {
        what,
        value,
        allowed,
    })
}

/// Checks a time stamp that has no predecessors.
fn plausible(what: &'static str, time_s: f64) -> Result<(), LiveError> {
    TimeCheck::range(time_s).map_err(|defect| LiveError::Time { what, defect })
}

/// Standard deviations of place, the larger of its axes (m), and heading (rad).
fn deviations(covariance: &[[f64; 3]; 3]) -> Result<(f64, f64), LiveError> {
    let variances = PoseEstimate {
        time_s: 0.0,
        pose: Pose::default(),
        covariance: Some(*covariance),
        integrity: None,
    }
    .principal_variances();
    let [.., [.., heading]] = *covariance;
    let [largest, least] = variances;
    for (what, value) in [
        ("the variance of a place in m²", largest),
        ("the variance of a place in m²", least),
        ("the variance of a heading in rad²", heading),
    ] {
        if !(0.0..=1e8).contains(&value) {
            let allowed = "it must be from 0 to 1e8";
            return Err(LiveError::Value {
                what,
                value,
                allowed,
            });
        }
    }
    Ok((largest.sqrt(), heading.sqrt().min(std::f64::consts::PI)))
}
