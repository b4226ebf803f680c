//! Thread that owns the pipeline: processes inputs and publishes results.

mod reports;
mod samples;

use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use onboard::live::{AngleRecord, LiveError, SavedState, StreamConfig, TimeCheck};
use onboard::localize::{OdometryResult, UpdateReason};
use onboard::monitor::ActiveFaults;
use onboard::observation::OdometrySample;
use onboard::settings::{Platform, Site, Vehicle};
use onboard::{Custom, Live};

use crate::angle_watch::AngleWatch;
use crate::clock::DriveClock;
use crate::events::Collapse;
use crate::gate::{BurstWindows, RxWindow};
use crate::inbox::{Command, Inbox, Input, Level};
use crate::interruption::Interruptions;
use crate::sink::{Distributor, PoseCause, PoseRecord, Record};
use crate::state::{self, StateStore};
use crate::statistics::{LatencyStats, SourceHealth};
use crate::supervisor::Watchdog;
use crate::web::StatusBoard;

/// Maximum interval between two checks of the time without input.
pub(crate) const TICK: Duration = Duration::from_millis(50);
/// Time between two saved states.
const SAVE_EVERY: Duration = Duration::from_secs(1);
/// Period of the status and of the diagnoses in seconds (REP-107).
const STATUS_S: f64 = 1.0;
/// Number of remembered block arrivals, from which the arrival time of an SSB's last sample is
/// determined.
const ARRIVALS: usize = 64;

/// Configuration of the pipeline.
pub struct NodeConfig {
    /// Site.
    pub site: Site,
    /// Vehicle.
    pub vehicle: Vehicle,
    /// Platform of the vehicle.
    pub platform: Platform,
    /// Stream of samples; `None` without samples.
    pub stream: Option<StreamConfig>,
}

impl NodeConfig {
    /// Whether site, vehicle and platform are equal.
    fn is_of_same_files(&self, other: &Self) -> bool {
        self.site == other.site && self.vehicle == other.vehicle && self.platform == other.platform
    }

    /// Creates the pipeline at the start of a drive.
    ///
    /// # Errors
    /// [`LiveError`] if site, vehicle and platform are incompatible.
    pub fn live(&self) -> Result<Live, LiveError> {
        let Self {
            site,
            vehicle,
            platform,
            stream,
        } = self;
        Live::new(site, vehicle, platform, None, *stream, Custom::default())
    }
}

/// Function that loads site, vehicle and platform again.
pub type Load = Box<dyn Fn() -> anyhow::Result<NodeConfig> + Send>;

/// Request to load site and vehicle again, for example by SIGHUP.
pub struct Reload {
    /// Flag of the request.
    pub requested: Arc<AtomicBool>,
    /// Function that loads them.
    pub load: Load,
}

/// State that was saved before the start.
struct Earlier {
    state: SavedState,
    /// Age of the state when it was read, in seconds.
    age_s: f64,
    read: Instant,
}

/// Pipeline with its clocks, monitors, events and outputs, independent of the kind of input.
pub struct Engine {
    setup: NodeConfig,
    live: Live,
    records: Arc<Distributor>,
    board: Arc<StatusBoard>,
    latency_stats: Arc<LatencyStats>,
    clock: DriveClock,
    gate: Arc<RxWindow>,
    windows: BurstWindows,
    sleeps: bool,
    interruptions: Interruptions,
    /// Number of gaps that were detected from the SSBs.
    unreported_gaps: u64,
    period_s: f64,
    /// Time of the first sample since the last processed SSBs, in seconds.
    window_s: Option<f64>,
    /// End of each recent block in the time of the stream, and its arrival.
    arrivals: VecDeque<(f64, Instant)>,
    last_pose: Option<(f64, Instant)>,
    last_status_s: f64,
    /// Reported active faults.
    faults: ActiveFaults,
    /// Sources that are reported as silent.
    silent: Vec<&'static str>,
    angle_watch: AngleWatch,
    watchdog: Watchdog,
    began: Instant,
    /// Repeated events.
    repeated: Collapse,
    /// Origin of the arrival times; `None` unless inputs arrive in real time.
    arrivals_from: Option<Instant>,
    sources: Vec<Arc<SourceHealth>>,
    /// Whether it was reported that the clocks of angles and odometry differ.
    clocks_differ: bool,
    newest_odometry: Option<OdometrySample>,
    earlier: Option<Earlier>,
    store: Option<Arc<StateStore>>,
    saved: Instant,
    reload: Option<Reload>,
}

impl Engine {
    /// Creates the engine at the start of a drive.
    ///
    /// # Errors
    /// Errors of [`NodeConfig::live`].
    pub fn new(
        setup: NodeConfig,
        records: Arc<Distributor>,
        board: Arc<StatusBoard>,
        latency_stats: Arc<LatencyStats>,
        gate: Arc<RxWindow>,
        sleeps: bool,
    ) -> Result<Self, LiveError> {
        Ok(Self {
            live: setup.live()?,
            windows: BurstWindows::new(&setup.site),
            period_s: setup.site.ssb.period_s(),
            window_s: None,
            setup,
            records,
            board,
            latency_stats,
            clock: DriveClock::default(),
            gate,
            sleeps,
            interruptions: Interruptions::default(),
            unreported_gaps: 0,
            arrivals: VecDeque::with_capacity(ARRIVALS),
            last_pose: None,
            last_status_s: f64::NEG_INFINITY,
            faults: ActiveFaults::default(),
            silent: Vec::new(),
            angle_watch: AngleWatch::default(),
            watchdog: Watchdog::from_environment(),
            began: Instant::now(),
            repeated: Collapse::default(),
            arrivals_from: None,
            sources: Vec::new(),
            clocks_differ: false,
            newest_odometry: None,
            earlier: None,
            store: None,
            saved: Instant::now(),
            reload: None,
        })
    }

    /// Enables the validation of time stamps against the arrival times, for inputs that arrive in
    /// real time.
    pub fn validate_arrivals(&mut self) {
        self.arrivals_from = Some(Instant::now());
    }

    /// Enables loading of site and vehicle on request.
    pub fn reload_by(&mut self, reload: Reload) {
        self.reload = Some(reload);
    }

    /// Enables saving of the state once a second, and resumes the state that was `read` from the
    /// file at the first odometry. `read` is a state with its age in seconds, `None` at the first
    /// start, or the reason why the file cannot be used.
    ///
    /// # Errors
    /// [`LiveError::Custom`].
    pub fn keep_state(
        &mut self,
        store: Arc<StateStore>,
        read: Result<Option<(SavedState, f64)>, String>,
    ) -> Result<(), LiveError> {
        self.store = Some(store);
        match read {
            Ok(None) => {
                let text = "no state file yet: this is the first start".to_owned();
                self.event(Level::Info, "state", text);
            }
            Ok(Some((state, age_s))) => {
                let read = Instant::now();
                self.earlier = Some(Earlier { state, age_s, read });
            }
            Err(why) => {
                let text = format!("ignored: {why}");
                self.event(Level::Warn, "state", text);
                self.search()?;
            }
        }
        Ok(())
    }

    /// Starts a search for the pose if the vehicle supports it, because the configured start pose
    /// is valid at the first start only.
    fn search(&mut self) -> Result<(), LiveError> {
        let text = match self.live.reset() {
            Ok(()) => "a search for the pose has started".to_owned(),
            Err(LiveError::Settings(_)) => {
                "the vehicle cannot be found by a search: it starts at the configured pose"
                    .to_owned()
            }
            Err(error) => return Err(error),
        };
        self.event(Level::Info, "state", text);
        Ok(())
    }

    /// Returns the pipeline.
    pub const fn live_mut(&mut self) -> &mut Live {
        &mut self.live
    }

    /// Runs until `stop` is set or all sources have ended.
    ///
    /// # Errors
    /// [`LiveError`] for an unrecoverable error.
    pub fn run(
        &mut self,
        inbox: &Inbox,
        sources: &[Arc<SourceHealth>],
        silent_after: Duration,
        stop: &AtomicBool,
    ) -> Result<(), LiveError> {
        self.sources = sources.to_vec();
        while !stop.load(Ordering::Acquire) {
            match inbox.take(TICK) {
                Some((_, Input::End)) => break,
                Some((came, input)) => self.take(came, input, inbox)?,
                None => {}
            }
            self.watch(sources, silent_after);
            self.reload_if_requested()?;
            self.tick()?;
        }
        self.process_bursts(true, None)?;
        self.live.flush()?;
        self.publish_angles(None)?;
        self.save()
    }

    /// Returns the arrival time for the validation of time stamps in seconds; `None` without
    /// validation.
    fn arrival_s(&self, came: Option<Instant>) -> Option<f64> {
        let from = self.arrivals_from?;
        Some(came?.saturating_duration_since(from).as_secs_f64())
    }

    fn take(&mut self, came: Instant, input: Input, inbox: &Inbox) -> Result<(), LiveError> {
        self.live.set_arrival(self.arrival_s(Some(came)));
        match input {
            Input::Samples(block) => self.samples(block, came, inbox)?,
            Input::Slept(until_s) => {
                self.clock.see(until_s + self.live.time_offset_s());
                self.watch_samples(came, until_s);
                let is_over = |[_, end_s]: [f64; 2]| until_s >= end_s;
                if self.gate.wanted().is_some_and(is_over) {
                    self.process_bursts(true, came)?;
                    self.sleep_until_next(until_s)?;
                }
            }
            Input::Odometry(sample) => self.odometry(&sample, Some(came))?,
            Input::Angle(angle) => {
                self.angle_watch.came(came);
                let (pci, ssb_index) = (angle.pci, angle.ssb_index);
                let mut heads = self.setup.site.radio_heads.iter();
                if !heads.any(|it| (it.pci, it.ssb_index) == (pci, ssb_index)) {
                    self.report_unknown(pci, ssb_index);
                }
                if let Some(text) = self.angle_watch.duplicate(&angle) {
                    self.event(Level::Warn, "angles", text);
                }
                match self.live.angle(&angle) {
                    Ok(()) => self.clock.see(angle.time_s),
                    Err(error) => self.refused("angles", &error),
                }
                self.report_clocks();
                self.publish_angles(Some(came))?;
            }
            Input::Range(range) => {
                let (pci, ssb_index) = (range.pci, range.ssb_index);
                match self.live.range(&range) {
                    Ok(verdict) if verdict.reason == UpdateReason::UnknownRadioHead => {
                        self.report_unknown(pci, ssb_index);
                    }
                    Ok(_) => self.clock.see(range.time_s),
                    Err(error) => self.refused("ranges", &error),
                }
                self.report_clocks();
            }
            Input::Command(command) => self.command(command),
            Input::Remark {
                level,
                source,
                text,
            } => self.event(level, source, text),
            Input::End => {}
        }
        Ok(())
    }

    /// Processes odometry and publishes the resulting pose.
    ///
    /// # Errors
    /// [`LiveError`] for an unrecoverable error.
    pub fn odometry(
        &mut self,
        sample: &OdometrySample,
        came: Option<Instant>,
    ) -> Result<(), LiveError> {
        self.live.set_arrival(self.arrival_s(came));
        self.resume_earlier(sample)?;
        match self.live.odometry(sample) {
            Ok(OdometryResult::DistanceJump { jump_m }) => {
                let text = format!("distance_m jumps by {jump_m:.4e} m; the speed is used instead");
                self.event(Level::Warn, "odometry", text);
            }
            Ok(OdometryResult::YawRateRefused { radps }) => {
                let text = format!(
                    "yaw_rate_radps is {radps:.4e}, above the maximum; it is not used; check its unit"
                );
                self.event(Level::Warn, "odometry", text);
            }
            Ok(_) => {}
            Err(error) => {
                self.refused("odometry", &error);
                return Ok(());
            }
        }
        if let Some(step) = self.live.take_odometry_step() {
            let text = format!(
                "the clock has stepped by {:+.3} s to {:.3} s; the pose is resumed after {:.2} s \
                 and must be confirmed by angles",
                step.step_s, sample.time_s, step.elapsed_s
            );
            self.clock.reset();
            (self.last_pose, self.last_status_s) = (None, f64::NEG_INFINITY);
            self.gate.open();
            self.event(Level::Warn, "odometry", text);
        }
        self.newest_odometry = Some(*sample);
        self.clock.see_odometry(sample.time_s);
        let status = self.live.status(sample.time_s)?;
        self.report_faults(&status);
        if let Some(came) = came {
            let now = Instant::now();
            let seconds = |since: Instant| now.saturating_duration_since(since).as_secs_f64();
            self.latency_stats.odometry_to_pose.add(seconds(came));
            if let Some((last_s, last)) = self.last_pose {
                let jitter_s = (seconds(last) - (sample.time_s - last_s)).abs();
                self.latency_stats.jitter.add(jitter_s);
            }
            self.last_pose = Some((sample.time_s, now));
        }
        let by = PoseCause::Odometry;
        self.records.put(Record::Pose(PoseRecord { status, by }));
        Ok(())
    }

    /// Resumes the saved state at the first odometry.
    fn resume_earlier(&mut self, sample: &OdometrySample) -> Result<(), LiveError> {
        if self.earlier.is_none() || TimeCheck::range(sample.time_s).is_err() {
            return Ok(());
        }
        let Some(Earlier { state, age_s, read }) = self.earlier.take() else {
            return Ok(());
        };
        let elapsed_s = age_s + read.elapsed().as_secs_f64();
        let Some(by) = self.live.resume(&state, elapsed_s, sample)? else {
            let text = format!(
                "ignored: the pose of {elapsed_s:.1} s ago; the vehicle may have moved by more than {} m",
                2.0 * onboard::live::MAX_GROWTH_M
            );
            self.event(Level::Warn, "state", text);
            return self.search();
        };
        let driven = by.driven_m.map_or_else(
            || "an unknown distance".to_owned(),
            |driven_m| format!("{driven_m:.2} m by the odometer"),
        );
        let text = format!(
            "the pose of {elapsed_s:.1} s ago is resumed after {driven}, with a standard \
             deviation of {:.2} m; angles must confirm it",
            by.position_std_m
        );
        self.event(Level::Info, "state", text);
        Ok(())
    }

    /// Requests that the state is written, if there is one.
    fn save(&mut self) -> Result<(), LiveError> {
        self.saved = Instant::now();
        // A saved state that waits for odometry is not overwritten.
        if let (Some(store), None) = (&self.store, &self.earlier)
            && let Some(state) = self.live.saved_state()?
        {
            store.put(state);
        }
        Ok(())
    }

    /// Loads site and vehicle again if requested, and resumes the pose with them. If they cannot be
    /// used, the current ones remain.
    fn reload_if_requested(&mut self) -> Result<(), LiveError> {
        let Some(reload) = &self.reload else {
            return Ok(());
        };
        if !reload.requested.swap(false, Ordering::AcqRel) {
            return Ok(());
        }
        let loaded = (reload.load)().and_then(|setup| {
            let live = setup.live()?;
            Ok((setup, live))
        });
        match loaded {
            Ok((setup, _)) if self.setup.is_of_same_files(&setup) => {
                let text = "site and vehicle have not changed".to_owned();
                self.event(Level::Info, "node", text);
            }
            Ok((setup, live)) => {
                self.swap(setup, live)?;
                self.board.set_site(&self.setup.site);
                let text = "site and vehicle were reloaded; the pose is resumed and must be \
                     confirmed by angles";
                self.event(Level::Info, "node", text.to_owned());
            }
            Err(error) => {
                let text = format!(
                    "site and vehicle were not reloaded, and the previous ones remain active: \
                     {error:#}"
                );
                self.event(Level::Warn, "node", text);
            }
        }
        Ok(())
    }

    /// Continues with another site and vehicle at the current pose.
    fn swap(&mut self, setup: NodeConfig, mut live: Live) -> Result<(), LiveError> {
        let state = self.live.saved_state()?;
        let excluded = self.live.heads().iter().filter(|it| it.is_excluded);
        for pci in excluded.map(|it| it.head.pci) {
            // The new site may not have this radio head.
            let _ = live.exclude(pci);
        }
        if let Some(sample) = &self.newest_odometry {
            let resumed = match &state {
                Some(state) => live.resume(state, 0.0, sample)?.is_some(),
                None => false,
            };
            if !resumed {
                // The configured start pose is valid at the first start only; not every vehicle
                // supports a search.
                let _ = live.reset();
            }
            live.odometry(sample)?;
        }
        if let Some(store) = &self.store {
            store.set_fingerprint(state::fingerprint(&setup.site, &setup.vehicle));
        }
        self.windows = BurstWindows::new(&setup.site);
        self.period_s = setup.site.ssb.period_s();
        (self.setup, self.live) = (setup, live);
        self.window_s = None;
        self.clocks_differ = false;
        self.interruptions.reset();
        self.unreported_gaps = 0;
        self.gate.open();
        Ok(())
    }

    fn command(&mut self, command: Command) {
        let done = match command {
            Command::SetPose {
                time_s,
                pose,
                covariance,
            } => {
                let time_s = time_s.or(self.live.newest_odometry_s()).unwrap_or(0.0);
                self.earlier = None;
                self.live.set_pose(time_s, pose, covariance)
            }
            Command::Reset => {
                self.earlier = None;
                self.live.reset()
            }
            Command::Exclude(pci) => self.live.exclude(pci),
            Command::Readmit(pci) => self.live.readmit(pci),
        };
        match done {
            Ok(()) => {
                self.gate.open();
                if command == Command::Reset {
                    self.clock.reset();
                }
                self.event(Level::Info, "messages", format!("done: {command:?}"));
            }
            Err(error) => self.refused("messages", &error),
        }
    }

    /// Publishes the results since the last call, and the pose after them.
    ///
    /// # Errors
    /// [`LiveError::Custom`].
    pub fn publish_angles(&mut self, came: Option<Instant>) -> Result<(), LiveError> {
        let mut last: Option<AngleRecord> = None;
        while let Some(outcome) = self.live.next_angle_record() {
            if came.is_some() {
                let end_s = outcome.angle_result.ssb.time_s + self.windows.ssb_s();
                if let Some(arrived) = self.arrival_of(end_s) {
                    let late = Instant::now().saturating_duration_since(arrived);
                    self.latency_stats.ssb_to_pose.add(late.as_secs_f64());
                }
            }
            self.records.put(Record::Verdict(outcome));
            let ssb = &outcome.angle_result.ssb;
            if outcome.angle_result.verdict.reason == UpdateReason::UnknownRadioHead {
                self.report_unknown(ssb.pci, ssb.ssb_index);
            }
            last = Some(outcome);
        }
        if let Some(last) = last {
            let status = self.live.status(last.after.time_s)?;
            self.report_faults(&status);
            let by = PoseCause::Angles;
            self.records.put(Record::Pose(PoseRecord { status, by }));
        }
        Ok(())
    }

    /// Performs the periodic tasks: a status per second, and updates of the web page.
    ///
    /// # Errors
    /// [`LiveError::Custom`].
    pub fn tick(&mut self) -> Result<(), LiveError> {
        self.watchdog.alive();
        self.report_outputs();
        self.report_repeated(false);
        if self.store.is_some() && self.saved.elapsed() >= SAVE_EVERY {
            self.save()?;
        }
        let Some(now_s) = self.clock.now_s() else {
            return Ok(());
        };
        let (shows, tells) = (self.board.is_due(), now_s - self.last_status_s >= STATUS_S);
        if !(shows || tells) {
            return Ok(());
        }
        let (status, energy) = (self.live.status(now_s)?, self.live.energy());
        let heads = self.live.heads();
        if shows {
            let counts = self.live.stream_counts();
            self.board.show(now_s, &status, heads, &energy, counts);
        }
        if tells {
            // Keep the period constant, instead of one second after the last status.
            let due_s = self.last_status_s + STATUS_S;
            self.last_status_s = if now_s - due_s < STATUS_S {
                due_s
            } else {
                now_s
            };
            let outputs = self.records.status();
            self.watchdog
                .set_vehicle(format!("{}: {}", status.state.name(), status.reason));
            self.records.put(Record::Status {
                status,
                heads: heads.to_vec(),
                energy,
                outputs,
                time_s: now_s,
            });
        }
        Ok(())
    }

    /// Notifies the watchdog while the thread waits.
    pub fn alive(&mut self) {
        self.watchdog.alive();
    }

    /// Advances the time of the drive.
    pub fn see(&mut self, time_s: f64) {
        self.clock.move_to(time_s);
    }
}
