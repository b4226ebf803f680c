//! Live pipeline.

mod commands;
mod condition;
mod ranges;
mod reception;

pub use ranges::{RangeObservation, RangeValue};

use std::collections::VecDeque;

use num_complex::Complex32;

use super::clocks::Clocks;
use super::error::LiveError;
use super::outcome::{AngleRecord, HeadStatus};
use super::start::starting_at;
use super::stream::{SampleStream, StreamConfig, StreamCounts};
use super::stream_clock::Continuity;
use super::time_base::ClockStep;
use super::time_check::TimeCheck;
use crate::BoxError;
use crate::burst::{Burst, HasSsb, LoggedAngle, UNSTATED_SNR_DB};
use crate::energy::{Energy, EnergyModel};
use crate::expected_angle::ExpectedAngle;
use crate::geometry::{Pose, wrap_angle};
use crate::localize::{AngleMeasurement, MeasurementKind, OdometryResult, UpdateReason};
use crate::monitor::Confirmation;
use crate::observation::{BURST_S, OdometrySample, SsbDetection};
use crate::pipeline::{Custom, OdometryDefect, Pipeline};
use crate::radio_head::RadioHead;
use crate::receive::ReceiverConfig;
use crate::settings::{Boundary, Extent, Platform, Site, Vehicle};

/// Maximum number of stored results of angles.
const OUTCOMES: usize = 256;

/// Maximum number of angles of a burst.
const ANGLES: usize = 64;

/// Angle that was estimated elsewhere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AngleObservation {
    /// Array that measured the angle.
    pub kind: MeasurementKind,
    /// Physical cell identity.
    pub pci: u16,
    /// Index of the SSB in its burst.
    pub ssb_index: u8,
    /// Reception time in seconds.
    pub time_s: f64,
    /// Electrical angle ω = 2π(d/λ)·cos θ between neighbours in a row, or azimuth from the axis of any
    /// other array, in radians; measured at a radio head, the azimuth in the frame of its array.
    pub phase_rad: f64,
    /// Standard deviation of `phase_rad`, in radians.
    pub sigma_rad: f64,
    /// SNR per antenna in dB, if known.
    pub snr_db: Option<f64>,
    /// Whether the error is Gaussian with this standard deviation, according to the estimator.
    pub resolved: bool,
}

impl From<&LoggedAngle> for AngleObservation {
    fn from(logged: &LoggedAngle) -> Self {
        let LoggedAngle { ssb, measured } = logged;
        Self {
            kind: measured.kind,
            pci: ssb.pci,
            ssb_index: ssb.ssb_index,
            time_s: ssb.time_s,
            phase_rad: measured.phase_rad,
            sigma_rad: measured.phase_sigma_rad,
            snr_db: Some(ssb.snr_db),
            resolved: measured.resolved,
        }
    }
}

/// Activity since the start, and its energy.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LiveEnergy {
    /// Time since the first input, in seconds.
    pub duration_s: f64,
    /// Number of estimated angles.
    pub aoa_estimates: usize,
    /// Number of received bursts.
    pub bursts_received: usize,
    /// Receiver on-time for these bursts according to the platform file, in seconds.
    pub on_time_s: f64,
    /// Energy; `None` if the platform has no value for the vehicle's method.
    pub energy: Option<Energy>,
    /// Components that the total includes.
    pub boundary: Option<Boundary>,
}

/// Pipeline on a vehicle, which processes inputs as they arrive.
pub struct Live {
    site: Site,
    vehicle: Vehicle,
    onboard: Pipeline,
    has_own_localizer: bool,
    expected_angle: ExpectedAngle,
    stream: Option<SampleStream>,
    /// Angles of an incomplete burst.
    angles: Vec<LoggedAngle>,
    outcomes: VecDeque<AngleRecord>,
    heads: Vec<HeadStatus>,
    /// Clocks of the sources. All other times are those of the pipeline, except those of `heads`,
    /// which are of the odometry's clock.
    clocks: Clocks,
    odometry_step: Option<ClockStep>,
    refused_burst: Option<LiveError>,
    confirmation: Confirmation,
    /// Time of the localizer's last recovery, in seconds.
    recovered_s: Option<f64>,
    last_angle_s: Option<f64>,
    /// First SSB of the last burst: sample time and index.
    last_burst: Option<(f64, u8)>,
    /// Whether samples have arrived since the last SSB or the end of the last segment.
    has_samples: bool,
    /// Number of sample segments without an SSB since the last SSB.
    empty_stretches: u32,
    /// Whether samples were interrupted for an unknown time, and no SSB was received since.
    is_resuming: bool,
    energy: Option<EnergyModel>,
    aoa_estimates: usize,
    bursts_received: usize,
    /// Earliest and latest time of the inputs, in seconds.
    interval_s: Option<[f64; 2]>,
}

impl Live {
    /// Creates the pipeline of a vehicle at a site. It starts at `start`, otherwise at the pose of
    /// the vehicle's settings, otherwise with a search. Without `stream` it accepts angles only.
    ///
    /// # Errors
    /// [`LiveError`] if site, vehicle, platform and stream are incompatible, or a start is missing
    /// and a search is impossible.
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
        let onboard = Pipeline::new(site, &vehicle, platform, start, custom)?;
        let receiver = || ReceiverConfig::new(site, &vehicle);
        let stream = stream.map(|config| SampleStream::new(config, receiver()));
        let heads = RadioHead::received_by(site, &vehicle);
        Ok(Self {
            expected_angle: ExpectedAngle::new(&vehicle),
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
            aoa_estimates: 0,
            bursts_received: 0,
            interval_s: None,
            has_own_localizer,
            onboard,
            site: site.clone(),
            vehicle,
        })
    }

    /// Sets the arrival time of the next inputs by a monotonic clock in seconds. Time stamps are
    /// validated against it; without it, against their predecessors only.
    pub const fn set_arrival(&mut self, arrival_s: Option<f64>) {
        self.clocks.arrival_s = arrival_s;
    }

    /// Processes the next samples of every antenna, of any length. `time_s` is the reception time
    /// of the first sample by the sample clock. The results of the SSBs are in the
    /// [`outcomes`](Self::next_angle_record). The time reveals missing and repeated samples, and a
    /// restarted stream.
    ///
    /// # Errors
    /// [`LiveError`] for a wrong number of antennas, unequal lengths or an implausible time.
    pub fn samples(
        &mut self,
        time_s: f64,
        antennas: &[&[Complex32]],
    ) -> Result<Continuity, LiveError> {
        let continuity = self.receive(time_s, antennas)?;
        self.process_until(f64::INFINITY)?;
        Ok(continuity)
    }

    /// Processes samples like [`samples`](Self::samples), but bursts only when
    /// [`process_until`](Self::process_until) is called: for recordings, whose odometry is read in
    /// advance.
    ///
    /// # Errors
    /// Those of [`samples`](Self::samples).
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

    /// Processes the complete bursts that began before `time_s`.
    ///
    /// # Errors
    /// [`LiveError::Custom`] for errors of user code.
    pub fn process_until(&mut self, time_s: f64) -> Result<(), LiveError> {
        while let Some(stream) = &mut self.stream {
            let burst = stream.burst();
            let number = burst.len();
            let first_s = burst.first().map(|first| first.ssb.time_s);
            let Some(first_s) = first_s.filter(|first_s| *first_s < time_s) else {
                break;
            };
            let newest = self.onboard.newest_odometry();
            match self.clocks.accept_burst("SSBs", first_s, newest) {
                Ok(inside_s) => {
                    for observation in &mut *burst {
                        observation.ssb.time_s += inside_s - first_s;
                    }
                    let result = process(&mut self.onboard, burst);
                    stream.forget(number);
                    self.record_results(result)?;
                }
                Err(error) => {
                    self.refused_burst = Some(error);
                    stream.forget(number);
                }
            }
        }
        Ok(())
    }

    /// Ends a segment of samples before a deliberate gap, so that its last SSBs are detected at
    /// once.
    ///
    /// # Errors
    /// [`LiveError::Receive`].
    pub fn end_segment(&mut self) -> Result<(), LiveError> {
        self.empty_stretches += u32::from(std::mem::take(&mut self.has_samples));
        match &mut self.stream {
            Some(stream) => stream.break_off(),
            None => Ok(()),
        }
    }

    /// Processes odometry, and returns the localizer's verdict. The speed alone is sufficient: see
    /// [`OdometrySample::of_speed`]. A message that establishes a new time base resumes the pose,
    /// with a covariance that includes the odometry's error over the elapsed time and distance: see
    /// [`take_odometry_step`](Self::take_odometry_step).
    ///
    /// # Errors
    /// [`LiveError::Time`] for an implausible time, [`LiveError::Odometry`] for a value that is not
    /// finite.
    pub fn odometry(&mut self, sample: &OdometrySample) -> Result<OdometryResult, LiveError> {
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
        if let Some(first) = self.angles.first()
            && first.ssb.time_s + BURST_S <= sample.time_s
        {
            self.process_angles()?;
        }
        let sample = self.with_distance(&sample);
        let verdict = self
            .onboard
            .odometry(&sample)
            .map_err(LiveError::Custom)??;
        self.see(sample.time_s);
        Ok(verdict)
    }

    /// Converts stored times of the odometry to its new clock after a step.
    fn resumed(&mut self, step: &ClockStep) {
        for head in &mut self.heads {
            for time_s in [&mut head.last_angle_s, &mut head.last_accepted_s] {
                *time_s = time_s.map(|it| it + step.step_s);
            }
        }
        self.confirmation.restart();
    }

    /// Returns the time of the newest odometry by its clock, in seconds.
    pub fn newest_odometry_s(&self) -> Option<f64> {
        let newest = self.onboard.newest_odometry()?;
        Some(self.clocks.odometry.outside(newest.time_s))
    }

    /// Returns the step of the odometry's clock since the previous call; the pose was resumed at
    /// the step.
    pub const fn take_odometry_step(&mut self) -> Option<ClockStep> {
        self.odometry_step.take()
    }

    /// Returns the step of the samples' or angles' clock since the previous call.
    pub const fn take_angle_step(&mut self) -> Option<ClockStep> {
        self.clocks.take_angle_step()
    }

    /// Returns the cause of the last rejected burst of SSBs since the previous call.
    pub const fn take_refused_burst(&mut self) -> Option<LiveError> {
        self.refused_burst.take()
    }

    /// Returns the time of angles minus that of odometry in seconds, if their clocks differ.
    pub fn clock_disagreement_s(&self) -> Option<f64> {
        let newest = self.onboard.newest_odometry()?;
        self.clocks.disagreement_s(newest)
    }

    /// Processes an angle that was estimated elsewhere. The angles of a burst (SSBs within half a
    /// frame) are processed together: as soon as odometry, a later angle or
    /// [`flush`](Self::flush) completes the burst.
    ///
    /// # Errors
    /// [`LiveError::Value`] for an invalid value; [`LiveError::Time`], [`LiveError::AngleAhead`]
    /// and [`LiveError::AngleRepeated`] for an implausible time.
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
        if let Some(first) = self.angles.first()
            && ((time_s - first.ssb.time_s).abs() >= BURST_S || self.angles.len() == ANGLES)
        {
            self.process_angles()?;
        }
        let snr_db = angle.snr_db.unwrap_or(UNSTATED_SNR_DB);
        let ssb = SsbDetection {
            pci: angle.pci,
            ssb_index: angle.ssb_index,
            time_s,
            snr_db,
        };
        let measured = AngleMeasurement {
            kind: angle.kind,
            time_s,
            phase_rad: angle.phase_rad,
            phase_sigma_rad: sigma_rad,
            angle_rad: match angle.kind {
                MeasurementKind::Angle => {
                    self.expected_angle.measurand().angle_rad(angle.phase_rad)
                }
                MeasurementKind::AngleAtHead => wrap_angle(angle.phase_rad),
            },
            snr_db,
            resolved: angle.resolved,
        };
        self.angles.push(LoggedAngle { ssb, measured });
        Ok(())
    }

    /// Whether an angle is a copy of the last one of its radio head; `time_s` is its time in the
    /// pipeline.
    fn is_repeated(&self, angle: &AngleObservation, time_s: f64) -> bool {
        let is_same = |LoggedAngle { ssb, measured }: &LoggedAngle| {
            (ssb.pci, ssb.ssb_index, ssb.time_s) == (angle.pci, angle.ssb_index, time_s)
                && measured.phase_rad == angle.phase_rad
        };
        let received_s = Some(self.clocks.odometry.outside(time_s));
        self.angles.iter().any(is_same)
            || (self.heads.iter()).any(|it| {
                it.head.sends(angle.pci, angle.ssb_index) && it.last_angle_s == received_s
            })
    }

    /// Processes an incomplete burst without waiting for further angles, for example at the end of
    /// a drive.
    ///
    /// # Errors
    /// [`LiveError::Custom`] for errors of user code.
    pub fn flush(&mut self) -> Result<(), LiveError> {
        self.end_segment()?;
        self.process_until(f64::INFINITY)?;
        self.process_angles()
    }

    /// Returns the result of the next angle, oldest first. If more than 256 results are stored, the
    /// oldest are removed.
    pub fn next_angle_record(&mut self) -> Option<AngleRecord> {
        self.outcomes.pop_front()
    }

    /// Returns the site.
    pub(super) const fn site(&self) -> &Site {
        &self.site
    }

    /// Returns the vehicle's settings.
    pub(super) const fn vehicle(&self) -> &Vehicle {
        &self.vehicle
    }

    /// Whether the odometry contains a distance.
    pub(super) fn has_distance(&self) -> bool {
        self.clocks.has_distance()
    }

    /// Returns the status of each radio head that the vehicle receives.
    pub fn heads(&self) -> &[HeadStatus] {
        &self.heads
    }

    /// Returns the counts of the samples.
    pub fn stream_counts(&self) -> StreamCounts {
        let counts = self.stream.as_ref().map(SampleStream::counts);
        counts.unwrap_or_default()
    }

    /// Returns the pipeline, which provides estimated constants and the results of the monitors.
    pub const fn onboard(&self) -> &Pipeline {
        &self.onboard
    }

    /// Returns the activity since the start or the last reset, and its energy according to the
    /// platform.
    pub fn energy(&self) -> LiveEnergy {
        let duration_s = self
            .interval_s
            .map_or(0.0, |[first_s, last_s]| last_s - first_s);
        let (aoa_estimates, bursts_received) = (self.aoa_estimates, self.bursts_received);
        let model = self.energy.as_ref();
        LiveEnergy {
            duration_s,
            aoa_estimates,
            bursts_received,
            on_time_s: model.map_or(0.0, |model| bursts_received as f64 * model.on_time_s),
            energy: model.map(|model| model.run_energy(aoa_estimates, bursts_received, duration_s)),
            boundary: model.map(|model| model.boundary),
        }
    }

    /// Records the time of an input.
    fn see(&mut self, time_s: f64) {
        let [first_s, last_s] = self.interval_s.unwrap_or([time_s; 2]);
        self.interval_s = Some([first_s.min(time_s), last_s.max(time_s)]);
    }

    /// Integrates the speed of a sample without a distance.
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

    fn process_angles(&mut self) -> Result<(), LiveError> {
        if self.angles.is_empty() {
            return Ok(());
        }
        let result = process(&mut self.onboard, &self.angles);
        self.angles.clear();
        self.record_results(result)
    }

    /// Stores the results of the angles of a burst.
    fn record_results(&mut self, result: Result<BurstSummary, BoxError>) -> Result<(), LiveError> {
        let BurstSummary {
            time_s,
            ssb_index,
            receiver_on,
        } = result.map_err(LiveError::Custom)?;
        self.see(time_s);
        let burst_s = self.clocks.angles.outside(time_s) - self.time_offset_s();
        self.last_burst = Some((burst_s, ssb_index));
        (self.has_samples, self.empty_stretches) = (false, 0);
        self.is_resuming = false;
        self.bursts_received += usize::from(receiver_on);
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
        for &angle_result in self.onboard.aoa_estimates() {
            self.aoa_estimates += 1;
            let (ssb, verdict) = (angle_result.ssb, angle_result.verdict);
            let sends = |it: &&mut HeadStatus| it.head.sends(ssb.pci, ssb.ssb_index);
            let mut status = self.heads.iter_mut().find(sends);
            let residual_rad = (status.as_ref())
                .zip(angle_result.measured)
                .map(|(it, measured)| {
                    let (kind, value_rad) = (measured.kind, measured.phase_rad);
                    (self.expected_angle).residual_rad(kind, after.pose, &it.head, value_rad)
                })
                .filter(|it| it.is_finite());
            if verdict.accepted {
                self.last_angle_s = Some(ssb.time_s);
            }
            let is_judged = verdict.accepted || verdict.reason == UpdateReason::Outlier;
            if is_judged && self.clocks.agree() {
                self.confirmation.angle(ssb.pci, verdict.accepted);
            }
            let received_s = odometry.outside(ssb.time_s);
            if let Some(status) = &mut status {
                status.is_faulty = !status.is_excluded && verdict.reason == UpdateReason::Excluded;
                status.snr_db = Some(ssb.snr_db);
                status.last_angle_s = Some(received_s);
                status.residual_rad = residual_rad;
                status.accepted += u64::from(verdict.accepted);
                status.refused += u64::from(!verdict.accepted);
                if verdict.accepted {
                    status.last_accepted_s = Some(received_s);
                }
            }
            if self.outcomes.len() == OUTCOMES {
                self.outcomes.pop_front();
            }
            let mut angle_result = angle_result;
            angle_result.ssb.time_s = angles.outside(ssb.time_s);
            if let Some(measured) = &mut angle_result.measured {
                measured.time_s = angles.outside(measured.time_s);
            }
            self.outcomes.push_back(AngleRecord {
                angle_result,
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

/// Time and index of a burst's first SSB, and whether the burst was received.
struct BurstSummary {
    time_s: f64,
    ssb_index: u8,
    receiver_on: bool,
}

fn process<T: HasSsb>(onboard: &mut Pipeline, burst: &[T]) -> Result<BurstSummary, BoxError> {
    let first = burst.first().map(HasSsb::ssb);
    let (time_s, ssb_index) = first.map_or((0.0, 0), |it| (it.time_s, it.ssb_index));
    let receiver_on = onboard
        .process_burst(time_s, &mut Burst(burst))?
        .receiver_on;
    Ok(BurstSummary {
        time_s,
        ssb_index,
        receiver_on,
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

/// Validates a time stamp without predecessors.
fn plausible(what: &'static str, time_s: f64) -> Result<(), LiveError> {
    TimeCheck::range(time_s).map_err(|defect| LiveError::Time { what, defect })
}
