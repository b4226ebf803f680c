//! The thread that owns the pipeline: takes what comes in, hands on what comes of it.

mod reports;
mod samples;

use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use onboard::live::{LiveError, Outcome, SavedState, StreamConfig, TimeCheck};
use onboard::localize::UpdateReason;
use onboard::monitor::ActiveFaults;
use onboard::observation::OdometrySample;
use onboard::settings::{Platform, Site, Vehicle};
use onboard::{Custom, Live};

use crate::angle_watch::AngleWatch;
use crate::clock::DriveClock;
use crate::events::Collapse;
use crate::gate::{Gate, Windows};
use crate::inbox::{Block, Command, Inbox, Input, Level};
use crate::interruption::Interruptions;
use crate::sink::{By, Distributor, PoseRecord, Record};
use crate::state::{self, StateStore};
use crate::statistics::{Punctuality, SourceHealth};
use crate::supervisor::Watchdog;
use crate::web::Board;

/// The engine looks at the time this often, whatever comes.
pub(crate) const TICK: Duration = Duration::from_millis(50);
/// Time between two saved states.
const SAVE_EVERY: Duration = Duration::from_secs(1);
/// Status and diagnoses come once a second (REP-107).
const STATUS_S: f64 = 1.0;
/// Arrivals of blocks remembered, to tell when an SSB's last sample came.
const ARRIVALS: usize = 64;

/// What the vehicle is, and where.
pub struct Setup {
    /// The site.
    pub site: Site,
    /// The vehicle.
    pub vehicle: Vehicle,
    /// Its platform.
    pub platform: Platform,
    /// Its samples.
    pub stream: Option<StreamConfig>,
}

impl Setup {
    /// Whether site, vehicle and platform are equal.
    fn is_of_same_files(&self, other: &Self) -> bool {
        self.site == other.site && self.vehicle == other.vehicle && self.platform == other.platform
    }

    /// The pipeline at the start of a drive.
    ///
    /// # Errors
    /// [`LiveError`] where these do not go together.
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

/// Loads site, vehicle and platform again.
pub type Load = Box<dyn Fn() -> anyhow::Result<Setup> + Send>;

/// A request to load site and vehicle again, as by SIGHUP.
pub struct Reload {
    /// Set when it is requested.
    pub requested: Arc<AtomicBool>,
    /// Loads them.
    pub load: Load,
}

/// State that was saved before the start.
struct Earlier {
    state: SavedState,
    /// Its age when it was read, in seconds.
    age_s: f64,
    read: Instant,
}

/// The pipeline and everything around it that does not care where its input comes from.
pub struct Engine {
    setup: Setup,
    live: Live,
    records: Arc<Distributor>,
    board: Arc<Board>,
    punctuality: Arc<Punctuality>,
    clock: DriveClock,
    gate: Arc<Gate>,
    windows: Windows,
    sleeps: bool,
    interruptions: Interruptions,
    /// Gaps that the SSBs have shown.
    unreported_gaps: u64,
    period_s: f64,
    /// Samples that the pipeline has not got yet.
    pending: Block,
    /// Ends of blocks in the stream's time, and when they arrived.
    arrivals: VecDeque<(f64, Instant)>,
    last_pose: Option<(f64, Instant)>,
    last_status_s: f64,
    /// Active faults that were reported.
    faults: ActiveFaults,
    /// Silent sources that were named.
    silent: Vec<&'static str>,
    angle_watch: AngleWatch,
    watchdog: Watchdog,
    began: Instant,
    /// Repeated events.
    repeated: Collapse,
    /// Origin of the arrival times, where inputs arrive as they were measured.
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
    /// At the start of a drive.
    ///
    /// # Errors
    /// As [`Setup::live`].
    pub fn new(
        setup: Setup,
        records: Arc<Distributor>,
        board: Arc<Board>,
        punctuality: Arc<Punctuality>,
        gate: Arc<Gate>,
        sleeps: bool,
    ) -> Result<Self, LiveError> {
        Ok(Self {
            live: setup.live()?,
            windows: Windows::new(&setup.site),
            period_s: setup.site.ssb.period_s(),
            pending: Block::default(),
            setup,
            records,
            board,
            punctuality,
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

    /// Validates time stamps against the arrival of inputs from now on, which arrive as they were measured.
    pub fn validate_arrivals(&mut self) {
        self.arrivals_from = Some(Instant::now());
    }

    /// Loads site and vehicle again on request.
    pub fn reload_by(&mut self, reload: Reload) {
        self.reload = Some(reload);
    }

    /// Saves the state once a second, and resumes the one that was `read` from the file at the first odometry: a state
    /// with its age in seconds, nothing at the first start, or why the file cannot be used.
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

    /// Searches for the pose, if the vehicle can be found: the configured start pose is that of the first start only.
    fn search(&mut self) -> Result<(), LiveError> {
        let text = match self.live.reset() {
            Ok(()) => "the pose is searched for".to_owned(),
            Err(LiveError::Settings(_)) => {
                "the vehicle cannot be found by a search: it starts at the configured pose"
                    .to_owned()
            }
            Err(error) => return Err(error),
        };
        self.event(Level::Info, "state", text);
        Ok(())
    }

    /// The pipeline itself.
    pub const fn live_mut(&mut self) -> &mut Live {
        &mut self.live
    }

    /// Runs until `stop`, or until all sources have ended.
    ///
    /// # Errors
    /// [`LiveError`] for what cannot go on at all.
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
        self.receive(true)?;
        self.live.settle()?;
        self.publish_heard(None)?;
        self.save()
    }

    /// Time of arrival for the validation of time stamps, in seconds.
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
                    self.receive(true)?;
                    self.publish_heard(Some(came))?;
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
                self.publish_heard(Some(came))?;
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

    /// Takes in odometry, and hands on the pose by it.
    ///
    /// # Errors
    /// [`LiveError`] for what cannot go on at all.
    pub fn odometry(
        &mut self,
        sample: &OdometrySample,
        came: Option<Instant>,
    ) -> Result<(), LiveError> {
        self.live.set_arrival(self.arrival_s(came));
        self.resume_earlier(sample)?;
        if let Err(error) = self.live.odometry(sample) {
            self.refused("odometry", &error);
            return Ok(());
        }
        if let Some(step) = self.live.take_odometry_step() {
            let text = format!(
                "the clock has stepped by {:+.3} s to {:.3} s; the pose is resumed after {:.2} s and is to be confirmed \
                 by angles",
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
            self.punctuality.odometry_to_pose.add(seconds(came));
            if let Some((last_s, last)) = self.last_pose {
                let jitter_s = (seconds(last) - (sample.time_s - last_s)).abs();
                self.punctuality.jitter.add(jitter_s);
            }
            self.last_pose = Some((sample.time_s, now));
        }
        let by = By::Odometry;
        self.records.put(Record::Pose(PoseRecord { status, by }));
        Ok(())
    }

    /// Resumes the state that was saved before the start, at the first odometry.
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
            "the pose of {elapsed_s:.1} s ago is resumed after {driven}, with a standard deviation of {:.2} m; it is \
             to be confirmed by angles",
            by.position_std_m
        );
        self.event(Level::Info, "state", text);
        Ok(())
    }

    /// Has the state written, if there is one.
    fn save(&mut self) -> Result<(), LiveError> {
        self.saved = Instant::now();
        // An earlier state that waits for odometry is not replaced.
        if let (Some(store), None) = (&self.store, &self.earlier)
            && let Some(state) = self.live.saved_state()?
        {
            store.put(state);
        }
        Ok(())
    }

    /// Loads site and vehicle again if that was requested, and resumes the pose with them; where they cannot be used
    /// the earlier ones stay.
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
                let text = "site and vehicle are loaded again; the pose is resumed and is to be confirmed by angles";
                self.event(Level::Info, "node", text.to_owned());
            }
            Err(error) => {
                let text = format!(
                    "site and vehicle are not loaded again, the earlier ones stay: {error:#}"
                );
                self.event(Level::Warn, "node", text);
            }
        }
        Ok(())
    }

    /// Goes on with another site and vehicle at the pose there is.
    fn swap(&mut self, setup: Setup, mut live: Live) -> Result<(), LiveError> {
        let state = self.live.saved_state()?;
        let excluded = self.live.heads().iter().filter(|it| it.is_excluded);
        for pci in excluded.map(|it| it.head.pci) {
            // The new site may have no such radio head.
            let _ = live.exclude(pci);
        }
        if let Some(sample) = &self.newest_odometry {
            let resumed = match &state {
                Some(state) => live.resume(state, 0.0, sample)?.is_some(),
                None => false,
            };
            if !resumed {
                // A configured start pose is that of the first start only; not every vehicle can be searched for.
                let _ = live.reset();
            }
            live.odometry(sample)?;
        }
        if let Some(store) = &self.store {
            store.set_fingerprint(state::fingerprint(&setup.site, &setup.vehicle));
        }
        self.windows = Windows::new(&setup.site);
        self.period_s = setup.site.ssb.period_s();
        (self.setup, self.live) = (setup, live);
        self.pending.antennas.iter_mut().for_each(Vec::clear);
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

    /// What was heard since the last time, and the pose after it.
    ///
    /// # Errors
    /// [`LiveError::Custom`].
    pub fn publish_heard(&mut self, came: Option<Instant>) -> Result<(), LiveError> {
        let mut last: Option<Outcome> = None;
        while let Some(outcome) = self.live.next_outcome() {
            if came.is_some() {
                let end_s = outcome.execution.ssb.time_s + self.windows.ssb_s();
                if let Some(arrived) = self.arrival_of(end_s) {
                    let late = Instant::now().saturating_duration_since(arrived);
                    self.punctuality.ssb_to_pose.add(late.as_secs_f64());
                }
            }
            self.records.put(Record::Verdict(outcome));
            let ssb = &outcome.execution.ssb;
            if outcome.execution.verdict.reason == UpdateReason::UnknownRadioHead {
                self.report_unknown(ssb.pci, ssb.ssb_index);
            }
            last = Some(outcome);
        }
        if let Some(last) = last {
            let status = self.live.status(last.after.time_s)?;
            self.report_faults(&status);
            let by = By::Angles;
            self.records.put(Record::Pose(PoseRecord { status, by }));
        }
        Ok(())
    }

    /// What is due by the clock: a status a second, and what the page shows.
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
            // In step, not a second from whatever came first after the last was due.
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

    /// Says that the pipeline is alive, where it waits.
    pub fn alive(&mut self) {
        self.watchdog.alive();
    }

    /// Notes a time of the drive.
    pub fn see(&mut self, time_s: f64) {
        self.clock.move_to(time_s);
    }
}
