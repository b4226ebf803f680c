//! Pipeline on the vehicle: from SSBs and odometry to the pose.

use crate::BoxError;
use crate::estimator::{self, AngleEstimator};
use crate::geometry::Pose;
use crate::link_budget::LinkBudget;
use crate::localize::ekf::{EstimatedConstants, RangeState};
use crate::localize::{
    self, AngleMeasurement, AngleUpdate, Ekf, Integrity, IntegrityState, Localizer, OdometryResult,
    OutOfSequenceBuffer, PoseEstimate, RangeUpdate, Recovered, UpdateReason, UpdateResult,
};
use crate::manifold::Measurand;
use crate::monitor::{ActiveFaults, Change, Fallback, Monitors};
use crate::observation::{OdometrySample, SsbDetection, SsbObservation};
use crate::radio_head::RadioHead;
use crate::range::RangeMeasurement;
use crate::settings::{
    Check, Platform, SPEED_OF_LIGHT_MPS, SettingsError, Site, Vehicle, check_together,
};
use crate::thermal::ThermalNoise;
use crate::wake_up::{self, Situation, WakeUpPolicy};
use crate::walls::Walls;

/// Pipeline on the vehicle. It allocates nothing after initialisation.
pub struct Pipeline {
    visibility_model: VisibilityModel,
    thermal: ThermalNoise,
    measurand: Measurand,
    angle_time_offset_s: f64,
    estimator: Box<dyn AngleEstimator>,
    localizer: OutOfSequenceBuffer,
    policy: Box<dyn WakeUpPolicy>,
    wake_up_time_s: f64,
    odometry: Option<OdometrySample>,
    /// Speed of the previous sample if it was rejected as impossible (m/s).
    suspect_speed_mps: Option<f64>,
    top_speed_mps: f64,
    sensed: Vec<SsbDetection>,
    chosen: Vec<bool>,
    aoa_estimates: Vec<AngleResult>,
    /// Updates for the localizer.
    burst: Vec<AngleUpdate>,
    /// Delays, range rates and carrier phases of the burst, if the vehicle uses them.
    ranges: Vec<RangeUpdate>,
    ranging: Option<RangingUse>,
    /// Sensor monitors, if the vehicle has integrity monitoring and a built-in localizer.
    monitors: Option<Box<Monitors>>,
    faults: ActiveFaults,
    keeps_journal: bool,
}

/// Use of the receiver's delays, range rates and carrier phases.
#[derive(Debug, Clone, Copy)]
struct RangingUse {
    range_rate: bool,
    carrier_phase: bool,
    wavelength_m: f64,
}

/// Number of measurements per SSB in addition to the angle.
const RANGES_PER_SSB: usize = 3;

/// Radio heads that can be used at a position: not excluded, and in line of sight.
struct VisibilityModel {
    heads: Vec<RadioHead>,
    /// Radio heads that the user has excluded.
    excluded: Vec<RadioHead>,
    walls: Walls,
    /// Radio heads in line of sight of the estimated position, if the site has walls.
    seen: Vec<RadioHead>,
    budget: LinkBudget,
    height_m: f64,
}

impl VisibilityModel {
    /// Updates the radio heads that are in line of sight of the estimated position.
    fn update(&mut self, time_s: f64, localizer: &OutOfSequenceBuffer) -> Result<(), BoxError> {
        if self.walls.is_empty() || is_searching(localizer.localizer()) {
            return Ok(());
        }
        let place = localizer.localizer().pose(time_s)?.pose.point();
        self.seen.clear();
        let heads = self.heads.iter();
        self.seen
            .extend(heads.filter_map(|head| self.walls.seen(head, place)));
        Ok(())
    }

    /// Returns a radio head that can be used.
    ///
    /// # Errors
    /// [`UpdateReason::Excluded`], [`UpdateReason::UnknownRadioHead`].
    fn head(&self, pci: u16, ssb_index: u8) -> Result<&RadioHead, UpdateReason> {
        let sends = |head: &&RadioHead| head.sends(pci, ssb_index);
        let is_excluded = self.excluded.iter().any(|head| sends(&head));
        (self.heads.iter().find(sends)).ok_or(if is_excluded {
            UpdateReason::Excluded
        } else {
            UpdateReason::UnknownRadioHead
        })
    }

    fn at<'a>(
        &'a self,
        time_s: f64,
        odometry: Option<OdometrySample>,
        localizer: &'a OutOfSequenceBuffer,
    ) -> Situation<'a> {
        let newest_s = odometry.map_or(time_s, |sample| sample.time_s);
        Situation {
            time_s,
            now_s: newest_s.max(time_s),
            speed_mps: odometry.map_or(0.0, |sample| sample.speed_mps),
            localizer: localizer.localizer(),
            heads: if self.walls.is_empty() {
                &self.heads
            } else {
                &self.seen
            },
            budget: &self.budget,
            height_m: self.height_m,
        }
    }
}

/// User code that replaces parts of the pipeline.
#[derive(Default)]
pub struct Custom {
    /// Replaces the angle estimator.
    pub estimator: Option<Box<dyn AngleEstimator>>,
    /// Replaces the localizer.
    pub localizer: Option<Box<dyn Localizer>>,
    /// Replaces the wake-up policy.
    pub policy: Option<Box<dyn WakeUpPolicy>>,
}

/// SSB burst as an input of the pipeline.
pub trait SsbSource {
    /// Appends the SSBs of the burst, without angle estimates; the receiver must be on.
    ///
    /// # Errors
    /// Errors of the source; an error ends the drive.
    fn sense(&mut self, sensed: &mut Vec<SsbDetection>) -> Result<(), BoxError>;

    /// Returns the SSB number `index` of the burst.
    ///
    /// # Errors
    /// Errors of the source; an error ends the drive.
    fn observe(&mut self, index: usize) -> Result<SsbInput<'_>, BoxError>;
}

/// SSB with snapshots, or with an angle that was estimated elsewhere.
#[derive(Debug, Clone, Copy)]
pub enum SsbInput<'a> {
    /// Snapshots of the array.
    Snapshots(&'a SsbObservation),
    /// Angle that was estimated elsewhere.
    Angle(AngleMeasurement),
}

/// Result of a burst.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BurstResult<'a> {
    /// Whether the burst was received.
    pub receiver_on: bool,
    /// Estimated angles.
    pub aoa_estimates: &'a [AngleResult],
    /// Whether the error remains below the policy's target until the next burst, if there is one.
    pub keeps_bound: Option<bool>,
}

/// Estimated angle and its result.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AngleResult {
    /// The SSB.
    pub ssb: SsbDetection,
    /// Angle; `None` if the snapshots contain none.
    pub measured: Option<AngleMeasurement>,
    /// Verdict of the localizer.
    pub verdict: UpdateResult,
    /// Wake-up time at this SSB, in seconds.
    pub wake_up_time_s: f64,
}

/// Maximum acceleration of a vehicle (m/s²) with a margin, for impossible speeds.
const MAX_ACCELERATION_MPS2: f64 = 30.0;
/// Maximum deviation of a speed that is attributed to noise and resolution (m/s).
const SPEED_NOISE_MPS: f64 = 0.5;
/// Minimum ratio of an impossible speed to the vehicle's top speed.
const TIMES_TOP_SPEED: f64 = 2.0;

/// Reason for the rejection of an odometry sample; the state is unchanged.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum OdometryDefect {
    /// The time is not after that of the previous sample.
    #[error("its time is not after the last sample's")]
    TimeReversed,
    /// A value is not finite.
    #[error("a value is not a finite number")]
    NotFinite,
    /// A value is so large that sums of it lose their resolution.
    #[error("a value is beyond 1e8 m, 1e6 m/s or 1e6 rad/s")]
    OutOfRange,
    /// The speed is impossible after that of the previous sample. It is accepted if the next sample
    /// confirms it.
    #[error(
        "its speed is impossible after the previous one, and far above vehicle.top_speed_kmh; check its unit"
    )]
    SpeedSpike,
}

/// Whether the pose is being searched for, so that every angle is used.
fn is_searching(localizer: &dyn Localizer) -> bool {
    localizer.hypotheses().is_some() || localizer.is_lost()
}

impl Pipeline {
    /// Creates the pipeline of a vehicle at a site, at 0 s and `start`, or with a search if the
    /// vehicle's settings specify an unknown start.
    ///
    /// # Errors
    /// [`SettingsError`] if the vehicle cannot operate at the site, or the platform lacks a
    /// required value.
    pub fn new(
        site: &Site,
        vehicle: &Vehicle,
        platform: &Platform,
        start: Pose,
        custom: Custom,
    ) -> Result<Self, SettingsError> {
        let check = Check {
            file: &vehicle.name,
        };
        check_together(site, vehicle, check)?;
        let estimator = match custom.estimator {
            Some(estimator) => estimator,
            None => estimator::built_in(vehicle).map_err(|error| {
                let key = "array.spacing_wavelengths";
                check.error(key, vehicle.array.spacing_wavelengths, &error.to_string())
            })?,
        };
        let is_monitored = custom.localizer.is_none() && vehicle.integrity_monitor().is_some();
        let localizer = match custom.localizer {
            Some(localizer) => localizer,
            None => localize::built_in(site, vehicle, start)?,
        };
        let policy = match custom.policy {
            Some(policy) => policy,
            None => wake_up::built_in(site, vehicle, platform)?,
        };
        let heads = RadioHead::received_by(site, vehicle);
        let [_, _, height_m] = vehicle.array.position_m;
        Ok(Self {
            thermal: ThermalNoise::new(site, vehicle),
            measurand: vehicle.array.measurand(),
            angle_time_offset_s: vehicle.receiver.angle_time_offset_s,
            estimator,
            localizer: OutOfSequenceBuffer::new(localizer),
            policy,
            wake_up_time_s: 0.0,
            odometry: None,
            suspect_speed_mps: None,
            top_speed_mps: vehicle.top_speed_mps(),
            sensed: Vec::with_capacity(heads.len()),
            chosen: Vec::with_capacity(heads.len()),
            aoa_estimates: Vec::with_capacity(heads.len()),
            burst: Vec::with_capacity(heads.len()),
            ranges: Vec::with_capacity(RANGES_PER_SSB * heads.len()),
            ranging: (vehicle.ranging.filter(|_| vehicle.has_one_way_ranging())).map(|it| {
                RangingUse {
                    range_rate: it.range_rate,
                    carrier_phase: it.carrier_phase,
                    wavelength_m: site.wavelength_m(),
                }
            }),
            monitors: is_monitored.then(|| Box::new(Monitors::new(site, vehicle, heads.len()))),
            faults: ActiveFaults::default(),
            keeps_journal: false,
            visibility_model: VisibilityModel {
                excluded: Vec::with_capacity(heads.len()),
                walls: Walls::new(site),
                seen: Vec::with_capacity(heads.len()),
                heads,
                budget: LinkBudget::new(site, vehicle),
                height_m,
            },
        })
    }

    /// Processes an odometry sample and returns the verdict of the localizer. The first sample
    /// defines the origin of the distance.
    ///
    /// # Errors
    /// Errors of a custom localizer. An invalid sample returns an [`OdometryDefect`] and leaves the
    /// state unchanged.
    pub fn odometry(
        &mut self,
        sample: &OdometrySample,
    ) -> Result<Result<OdometryResult, OdometryDefect>, BoxError> {
        if !sample.is_finite() {
            return Ok(Err(OdometryDefect::NotFinite));
        }
        if !sample.is_in_range() {
            return Ok(Err(OdometryDefect::OutOfRange));
        }
        let is_late = |last: OdometrySample| sample.time_s <= last.time_s;
        if self.odometry.is_some_and(is_late) {
            return Ok(Err(OdometryDefect::TimeReversed));
        }
        if self.is_spike(sample) {
            self.suspect_speed_mps = Some(sample.speed_mps);
            return Ok(Err(OdometryDefect::SpeedSpike));
        }
        self.suspect_speed_mps = None;
        self.odometry = Some(*sample);
        let Some(monitors) = &mut self.monitors else {
            return self.localizer.odometry(sample).map(Ok);
        };
        let sample = monitors.odometry(sample);
        let verdict = self.localizer.odometry(&sample)?;
        self.follow_monitors()?;
        Ok(Ok(verdict))
    }

    /// Whether the speed of a sample is a single impossible value.
    fn is_spike(&self, sample: &OdometrySample) -> bool {
        let Some(last) = self.odometry else {
            return false;
        };
        let possible_mps = MAX_ACCELERATION_MPS2 * (sample.time_s - last.time_s) + SPEED_NOISE_MPS;
        let is_near = |other_mps: f64| (sample.speed_mps - other_mps).abs() <= possible_mps;
        sample.speed_mps.abs() > TIMES_TOP_SPEED * self.top_speed_mps
            && !is_near(last.speed_mps)
            && !self.suspect_speed_mps.is_some_and(is_near)
    }

    /// Changes the localizer at the start and end of odometry faults.
    fn follow_monitors(&mut self) -> Result<(), BoxError> {
        let Some(monitors) = &mut self.monitors else {
            return Ok(());
        };
        self.faults = *monitors.faults();
        let localizer = self.localizer.localizer();
        // A search for the initial pose uses every angle anyway; smoothing needs one filter for the
        // whole drive.
        if localizer.hypotheses().is_some() || self.keeps_journal {
            return Ok(());
        }
        let (Some(change), Some(newest)) = (monitors.change(), self.odometry) else {
            return Ok(());
        };
        let estimate = localizer.pose(newest.time_s)?;
        let (localizer, first) = match change {
            Change::Begin => {
                let along_m = localizer.ekf().and_then(Ekf::along_m);
                let (pose, along_m) =
                    (monitors.take_free_pose()).unwrap_or((estimate.pose, along_m));
                let localizer = monitors.fallback.begin(pose, along_m)?;
                (localizer, monitors.fallback.odometry(&newest))
            }
            Change::End => match monitors.fallback.end(localizer) {
                Some(localizer) => (localizer, newest),
                None => return Ok(()),
            },
        };
        self.localizer = OutOfSequenceBuffer::new(localizer);
        self.localizer.odometry(&first)?;
        Ok(())
    }

    /// Returns the active faults of odometry and receive channels.
    pub const fn faults(&self) -> &ActiveFaults {
        &self.faults
    }

    /// Processes the SSB burst at `time_s`: receives it if the policy requests it, measures its
    /// SSBs, selects SSBs, estimates their angles and updates the localizer. The burst may be older
    /// than the newest odometry.
    ///
    /// # Errors
    /// Errors of the source or of user code.
    pub fn process_burst(
        &mut self,
        time_s: f64,
        source: &mut dyn SsbSource,
    ) -> Result<BurstResult<'_>, BoxError> {
        self.sensed.clear();
        self.aoa_estimates.clear();
        self.burst.clear();
        self.ranges.clear();
        let receiver_on = self.listens(time_s)?;
        let is_wanted = self.is_wanted(time_s);
        let now = self
            .visibility_model
            .at(time_s, self.odometry, &self.localizer);
        let searching = is_searching(now.localizer);
        if receiver_on {
            if let Some(monitors) = &mut self.monitors {
                monitors.received(time_s);
            }
            source.sense(&mut self.sensed)?;
            self.chosen.clear();
            self.chosen.resize(self.sensed.len(), searching);
            if !searching && self.sensed.iter().any(|ssb| now.head(ssb).is_some()) {
                let chosen = &mut self.chosen;
                self.wake_up_time_s = self.policy.decide(&now, &self.sensed, chosen)?;
            }
            if is_wanted {
                self.chosen.fill(true);
            }
            if !searching && !self.visibility_model.walls.is_empty() {
                // The angle of a wave through a wall does not indicate the direction of the radio
                // head.
                for (chosen, ssb) in self.chosen.iter_mut().zip(&self.sensed) {
                    *chosen &= now.head(ssb).is_some();
                }
            }
            for index in 0..self.sensed.len() {
                let (Some(&ssb), Some(true)) = (self.sensed.get(index), self.chosen.get(index))
                else {
                    continue;
                };
                match source.observe(index)? {
                    SsbInput::Snapshots(observation) => self.estimate(observation)?,
                    SsbInput::Angle(measured) => self.collect(ssb, Some(measured)),
                }
            }
            if let Some(monitors) = &mut self.monitors {
                monitors.repetitions(time_s, &self.burst);
            }
            let are_right = |monitors: &Monitors| !monitors.faults().withholds_angles();
            if self.monitors.as_deref().is_none_or(are_right) {
                self.localizer.update(&mut self.burst)?;
                self.localizer.update(&mut self.ranges)?;
                for update in &self.burst {
                    if let Some(angle_result) = self.aoa_estimates.get_mut(update.number) {
                        angle_result.verdict = update.verdict;
                    }
                }
                self.monitor_angles(time_s)?;
            } else {
                // The angles of a faulty array or source would displace the pose; dead reckoning without
                // angles does not.
                self.follow_monitors()?;
            }
        }
        let now = self
            .visibility_model
            .at(time_s, self.odometry, &self.localizer);
        Ok(BurstResult {
            receiver_on,
            aoa_estimates: &self.aoa_estimates,
            keeps_bound: self.policy.keeps_bound(&now),
        })
    }

    /// Returns the delays, range rates and carrier phases of the last received burst, with the
    /// verdict of the localizer; empty unless the vehicle has one-way ranging.
    pub fn ranges(&self) -> &[RangeUpdate] {
        &self.ranges
    }

    /// Updates the localizer with a range to the radio head with this PCI and SSB index.
    ///
    /// # Errors
    /// Errors of a custom localizer.
    pub fn range(
        &mut self,
        pci: u16,
        ssb_index: u8,
        measured: &RangeMeasurement,
    ) -> Result<UpdateResult, BoxError> {
        match self.visibility_model.head(pci, ssb_index) {
            Ok(head) => self.localizer.update_range(head, measured),
            Err(reason) => Ok(UpdateResult::unused(reason)),
        }
    }

    /// Requests every burst until angles have confirmed the pose again.
    pub fn await_confirmation(&mut self) {
        if let Some(monitors) = &mut self.monitors {
            monitors.await_confirmation();
        }
    }

    /// Whether a monitor requests the burst at `time_s`. A vehicle that has left its lane may have a wrong yaw rate,
    /// which only angles show.
    fn is_wanted(&self, time_s: f64) -> bool {
        let has_left_lane = || {
            let ekf = self.localizer.localizer().ekf();
            ekf.is_some_and(Ekf::has_left_lane)
        };
        (self.monitors.as_ref())
            .is_some_and(|monitors| monitors.requests_burst(time_s) || has_left_lane())
    }

    /// Passes the angles of the burst at `time_s` to the monitors.
    fn monitor_angles(&mut self, time_s: f64) -> Result<(), BoxError> {
        let Some(monitors) = &mut self.monitors else {
            return Ok(());
        };
        let localizer = self.localizer.localizer();
        let newest_s = self.odometry.map_or(time_s, |sample| sample.time_s);
        let estimate = localizer.pose(newest_s.max(time_s))?;
        let is_known = localizer.hypotheses().is_none();
        let (pose, ekf) = (is_known.then_some(estimate.pose), localizer.ekf());
        if is_known && !localizer.is_lost() {
            monitors.retain(time_s, localizer);
        }
        monitors.angles(time_s, &self.burst, pose, ekf);
        if monitors.is_without_odometry() {
            monitors.fallback.received(&estimate);
        }
        self.follow_monitors()
    }

    /// Returns the angles of the last received burst.
    pub fn aoa_estimates(&self) -> &[AngleResult] {
        &self.aoa_estimates
    }

    /// Whether the policy currently requests the burst at `time_s`.
    ///
    /// # Errors
    /// Errors of a custom policy.
    pub fn listens(&mut self, time_s: f64) -> Result<bool, BoxError> {
        let is_wanted = self.is_wanted(time_s);
        let newest_s = self.odometry.map_or(time_s, |sample| sample.time_s);
        self.visibility_model
            .update(newest_s.max(time_s), &self.localizer)?;
        let now = self
            .visibility_model
            .at(time_s, self.odometry, &self.localizer);
        Ok(is_wanted || is_searching(now.localizer) || self.policy.listens(&now)?)
    }

    /// Excludes the angles of a cell from now on, or includes them again; returns `false` if the
    /// site does not have the cell.
    pub fn exclude(&mut self, pci: u16, excluded: bool) -> bool {
        let VisibilityModel {
            heads,
            excluded: out,
            ..
        } = &mut self.visibility_model;
        let known = heads.iter().chain(out.iter()).any(|head| head.pci == pci);
        let (from, to) = if excluded { (heads, out) } else { (out, heads) };
        to.extend(from.extract_if(.., |head| head.pci == pci));
        known
    }

    /// Replaces the localizer by another one, which starts at the newest odometry.
    ///
    /// # Errors
    /// Errors of a custom localizer.
    pub fn replace_localizer(&mut self, localizer: Box<dyn Localizer>) -> Result<(), BoxError> {
        self.localizer = OutOfSequenceBuffer::new(localizer);
        if let Some(newest) = &self.odometry {
            self.localizer.odometry(newest)?;
        }
        if let Some(monitors) = &mut self.monitors {
            monitors.restart();
            self.faults = *monitors.faults();
        }
        Ok(())
    }

    /// Discards the odometry state, because the clock or the distance of the odometry has
    /// restarted.
    pub fn forget_odometry(&mut self) {
        self.odometry = None;
        if let Some(monitors) = &mut self.monitors {
            monitors.forget_odometry();
            self.faults = *monitors.faults();
        }
    }

    /// Returns the newest odometry.
    pub const fn newest_odometry(&self) -> Option<&OdometrySample> {
        self.odometry.as_ref()
    }

    /// Estimates the angle of an SSB for the localizer.
    fn estimate(&mut self, observation: &SsbObservation) -> Result<(), BoxError> {
        let ssb = observation.ssb;
        if let Some(monitors) = &mut self.monitors {
            monitors.ssb(observation);
        }
        self.collect_ranges(observation);
        let estimated = self.estimator.estimate(observation)?;
        let bound_rad = || self.thermal.sigma_rad(ssb.snr_db);
        let measured = estimated.and_then(|estimated| {
            estimator::measurement(&ssb, estimated, &self.measurand, bound_rad)
        });
        self.collect(ssb, measured);
        Ok(())
    }

    /// Stores delay, range rate and carrier phase of an SSB for the localizer.
    fn collect_ranges(&mut self, observation: &SsbObservation) {
        let (Some(using), Some(ranging)) = (self.ranging, observation.ranging) else {
            return;
        };
        let ssb = observation.ssb;
        let Ok(&head) = self.visibility_model.head(ssb.pci, ssb.ssb_index) else {
            return;
        };
        let time_s = ssb.time_s - self.angle_time_offset_s;
        let is_first_path_certain = !ranging.is_first_path_uncertain;
        let delay = is_first_path_certain.then(|| {
            let range_m = SPEED_OF_LIGHT_MPS * ranging.delay_s;
            let noise_m = SPEED_OF_LIGHT_MPS * ranging.delay_noise_sigma_s;
            let sigma_m = SPEED_OF_LIGHT_MPS * ranging.delay_sigma_s;
            RangeMeasurement {
                scatter_m: (sigma_m * sigma_m - noise_m * noise_m).max(0.0).sqrt(),
                ..RangeMeasurement::range(time_s, range_m, Some(noise_m))
            }
        });
        // A rate derived from carrier phases contains the same information as the phases.
        let is_new = !(using.carrier_phase && ranging.is_rate_of_phases);
        let rate = (is_first_path_certain && using.range_rate && is_new).then(|| {
            let (rate_mps, sigma_mps) = (ranging.rate_mps, ranging.rate_sigma_mps);
            RangeMeasurement::range_rate(time_s, rate_mps, sigma_mps, ranging.rate_interval_s)
        });
        let phase = using.carrier_phase.then(|| {
            let (phase_rad, sigma_rad) = (ranging.phase_rad, ranging.phase_sigma_rad);
            RangeMeasurement::carrier_phase(time_s, phase_rad, sigma_rad, using.wavelength_m)
        });
        for measured in [rate, delay, phase].into_iter().flatten() {
            self.ranges.push(RangeUpdate {
                number: self.ranges.len(),
                head,
                measured,
                verdict: UpdateResult::unused(UpdateReason::Unusable),
            });
        }
    }

    /// Stores the angle of an SSB for the localizer, which processes those of a burst together.
    fn collect(&mut self, ssb: SsbDetection, measured: Option<AngleMeasurement>) {
        let measured = measured.map(|measured| AngleMeasurement {
            time_s: measured.time_s - self.angle_time_offset_s,
            ..measured
        });
        let head = self.visibility_model.head(ssb.pci, ssb.ssb_index);
        let reason = head.err().unwrap_or(UpdateReason::Unusable);
        let verdict = UpdateResult::unused(reason);
        if let (Ok(&head), Some(measured)) = (head, measured) {
            self.burst.push(AngleUpdate {
                number: self.aoa_estimates.len(),
                head,
                measured,
                verdict,
            });
        }
        self.aoa_estimates.push(AngleResult {
            ssb,
            measured,
            verdict,
            wake_up_time_s: self.wake_up_time_s,
        });
    }

    /// Returns the number of hypotheses during the search for the initial pose; `None` afterwards.
    /// During the search, [`pose`](Self::pose) returns the mean of the hypotheses.
    pub fn searching(&self) -> Option<usize> {
        self.localizer.localizer().hypotheses()
    }

    /// Whether most angles contradict the prediction, so that the pose must not be used.
    pub fn is_lost(&self) -> bool {
        self.localizer.localizer().is_lost()
    }

    /// Returns the last recovery of a lost localizer.
    pub fn recovered(&self) -> Option<Recovered> {
        self.localizer.localizer().recovered()
    }

    /// Returns the estimated pose at `time_s`, which is not before the newest odometry.
    ///
    /// # Errors
    /// Errors of a custom localizer.
    pub fn pose(&self, time_s: f64) -> Result<PoseEstimate, BoxError> {
        let mut estimate = self.localizer.localizer().pose(time_s)?;
        if self.faults.affects_angles()
            && let Some(integrity) = &mut estimate.integrity
        {
            integrity.state = IntegrityState::Unavailable;
        }
        if self.faults.of_odometry().is_some() {
            // The level of a monitored localizer assumes correct odometry.
            let level_m = Fallback::level_m(&estimate);
            estimate.integrity = Some(Integrity::unavailable(level_m));
        }
        Ok(estimate)
    }

    /// Returns the estimated constants of odometer, yaw rate, array and clock, if the localizer
    /// estimates them.
    pub fn constants(&self) -> Option<EstimatedConstants> {
        let mut constants = self.localizer.localizer().ekf()?.constants();
        constants.angle_time_offset_s.stated += self.angle_time_offset_s;
        constants.angle_time_offset_s.found += self.angle_time_offset_s;
        Some(constants)
    }

    /// Returns the estimated offset of the ranges of a radio head (m), if the localizer estimates it.
    pub fn range_offset(&self, pci: u16, ssb_index: u8) -> Option<RangeState> {
        let mut heads = self.visibility_model.heads.iter();
        let head = heads.find(|head| head.sends(pci, ssb_index))?;
        self.localizer.localizer().ekf()?.range_offset(head)
    }

    /// Returns the estimated relative scale error of the ranges; `None` without ranges.
    pub fn range_scale(&self) -> Option<RangeState> {
        self.localizer.localizer().ekf()?.range_scale()
    }

    /// Keeps a journal for smoothing from now on, if the localizer is a single filter; the filters
    /// of a bank replace each other. Angles must be in order of time from now on.
    pub fn keep_journal(&mut self) {
        self.keeps_journal = true;
        self.localizer.keep_journal();
    }

    /// Returns the smoothed pose at each odometry sample since the start of the journal; empty
    /// without a journal.
    pub fn smoothed(&self) -> Vec<PoseEstimate> {
        let ekf = self.localizer.localizer().ekf();
        ekf.map(Ekf::smoothed).unwrap_or_default()
    }
}
