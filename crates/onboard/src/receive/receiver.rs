//! The vehicle's receiver: finds cells, keeps to them, and makes an [`SsbObservation`] of every SSB.
//!
//! It is given windows of samples at the base rate (256 to a symbol), however they came about: cut
//! from a recording, or made by the simulator around each burst.

use aoa::DirectionFinder;
use nr_ssb::grid::{SUBCARRIERS, SYMBOLS};
use nr_ssb::search::{SearchConfig, SearchError, Searcher};
use nr_ssb::track::{TrackError, Tracked, Tracker};
use nr_ssb::{Complex32, SubcarrierSpacing};
use num_complex::Complex64;
use thiserror::Error;

use super::despread::Despread;
use super::wideband::line_of_sight;
use crate::elements::for_elements;
use crate::manifold::ArrayManifold;
use crate::observation::{SensedSsb, SsbObservation};
use crate::settings::{ArraySettings, Pilots, Site, Vehicle};

/// Samples of an SSB at the base rate: four symbols of 256 with a cyclic prefix of 18.
pub const SSB_SAMPLES: usize = 4 * 274;

/// SSBs in a row that must be missing before one is given up, and for how many seconds.
const MISSES: u32 = 8;
const ABSENT_S: f64 = 2.0;
/// Time after which a receiver that has cells looks for others, in seconds.
const SEARCH_INTERVAL_S: f64 = 1.0;
/// The same where it has none, once it has looked at every frequency offset.
const LOST_INTERVAL_S: f64 = 0.1;
/// Largest error of the receiver's oscillator in parts per million, over its carrier: three times
/// the standard deviation that a scenario may give it.
const OSCILLATOR_PPM: f64 = 60.0;
/// An SSB must lie this many samples inside a window; half a cyclic prefix and the filter's reach.
const GUARD: f64 = 16.0;

/// What a receiver is told.
#[derive(Debug, Clone, PartialEq)]
pub struct ReceiverConfig {
    /// Absolute frequency of the SSB's centre in Hz.
    pub ssb_freq_hz: f64,
    /// Its subcarrier spacing.
    pub spacing: SubcarrierSpacing,
    /// Period of the SSB burst in seconds.
    pub period_s: f64,
    /// Which resource elements are used.
    pub pilots: Pilots,
    /// Snapshots of each SSB where none is known (`pilots` is blind).
    pub snapshots: usize,
    /// The antennas, and the complex gain of each one's channel, by which it is divided.
    pub array: ArraySettings,
    /// Cells to listen to; all without.
    pub cells: Option<Vec<u16>>,
}

impl ReceiverConfig {
    /// The receiver of a vehicle, for the cells of a site that it listens to.
    pub fn new(site: &Site, vehicle: &Vehicle) -> Self {
        let spacing = if site.ssb.subcarrier_spacing_khz == 30.0 {
            SubcarrierSpacing::Khz30
        } else {
            SubcarrierSpacing::Khz15
        };
        let heads = site.radio_heads.iter().map(|head| head.pci);
        Self {
            ssb_freq_hz: site.carrier_mhz * 1e6,
            spacing,
            period_s: site.ssb.period_s(),
            pilots: vehicle.receiver.pilots,
            snapshots: vehicle.receiver.snapshots.into(),
            array: vehicle.array.clone(),
            cells: Some(heads.filter(|pci| vehicle.receiver.hears(*pci)).collect()),
        }
    }
}

/// Samples at the base rate.
#[derive(Debug, Clone, Copy)]
pub struct Window<'a> {
    /// Number of the first sample, counted by the receiver's clock.
    pub start: u64,
    /// Time of the first sample in seconds.
    pub time_s: f64,
    /// The samples of each antenna, equally many.
    pub antennas: &'a [&'a [Complex32]],
}

/// What makes receiving impossible.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum ReceiveError {
    /// The search refuses its settings or samples.
    #[error(transparent)]
    Search(#[from] SearchError),
    /// A tracker refuses its samples.
    #[error(transparent)]
    Track(#[from] TrackError),
    /// Samples of another number of antennas than it was told of.
    #[error("{found} channels; the vehicle's array has {elements}")]
    Antennas {
        /// Number of antennas that there are samples of.
        found: usize,
        /// Number that it was told of.
        elements: usize,
    },
    /// Antennas that make no array.
    #[error(transparent)]
    Array(#[from] aoa::Error),
    /// A channel gain of zero or not finite.
    #[error("gain of channel {0} is not a finite number other than zero")]
    Calibration(usize),
}

/// A receiver on one frequency.
pub struct Receiver(Box<dyn SsbReceiver>);

impl Receiver {
    /// A receiver that knows no cell yet.
    ///
    /// # Errors
    /// [`ReceiveError::Search`] or [`ReceiveError::Calibration`] for impossible settings.
    pub fn new(config: ReceiverConfig) -> Result<Self, ReceiveError> {
        for_elements!(config.array.elements, A => {
            Ok(Self(Box::new(ArrayReceiver::<A>::new(config)?)))
        })
    }

    /// What it was told.
    pub fn config(&self) -> &ReceiverConfig {
        self.0.config()
    }

    /// Number of SSBs that are tracked.
    pub fn tracked(&self) -> usize {
        self.0.tracked()
    }

    /// Number of windows that were searched for cells.
    pub fn searches(&self) -> u64 {
        self.0.searches()
    }

    /// Looks for cells where it is time to, and hands every SSB that lies in the window to `take`.
    ///
    /// # Errors
    /// [`ReceiveError`] where the antennas are not as many as it was told of, or not equally long.
    pub fn receive(
        &mut self,
        window: &Window<'_>,
        mut take: impl FnMut(&SsbObservation),
    ) -> Result<(), ReceiveError> {
        self.0.receive(window, &mut take)
    }
}

/// A receiver of any number of antennas.
trait SsbReceiver: Send {
    fn config(&self) -> &ReceiverConfig;
    fn tracked(&self) -> usize;
    fn searches(&self) -> u64;
    fn receive(
        &mut self,
        window: &Window<'_>,
        take: &mut dyn FnMut(&SsbObservation),
    ) -> Result<(), ReceiveError>;
}

struct ArrayReceiver<const A: usize> {
    config: ReceiverConfig,
    calibration: [Complex64; A],
    /// Of antennas that are not in a row.
    finder: Option<DirectionFinder<ArrayManifold<A>, A>>,
    search: SearchConfig,
    searcher: Searcher,
    cells: Vec<Cell<A>>,
    last_search_s: f64,
    searches: u64,
    /// Frequency offset that cells were last found at, in Hz, and searches in vain since.
    offset_hz: f64,
    in_vain: u32,
    observation: SsbObservation,
}

struct Cell<const A: usize> {
    ssb_index: u8,
    pci: u16,
    tracker: Tracker<A>,
    /// Periods after the last SSB seen that the next one is expected, and where.
    periods: f64,
    next_start: f64,
    last_seen_s: f64,
}

impl<const A: usize> Cell<A> {
    /// Moves on by some bursts; the clocks drift meanwhile as they were seen to.
    fn skip(&mut self, bursts: f64, period: f64) {
        self.periods += bursts;
        self.next_start = self.tracker.expected_start(self.periods * period);
    }

    /// Begins to count anew: its SSB was seen.
    fn seen(&mut self, time_s: f64, period: f64) {
        self.last_seen_s = time_s;
        self.periods = 0.0;
        self.skip(1.0, period);
    }

    fn is_lost(&self, time_s: f64) -> bool {
        self.tracker.misses() >= MISSES && time_s - self.last_seen_s >= ABSENT_S
    }
}

impl<const A: usize> ArrayReceiver<A> {
    fn new(config: ReceiverConfig) -> Result<Self, ReceiveError> {
        let calibration = config.array.calibration();
        let unusable = |gain: &Complex64| !gain.norm_sqr().is_normal();
        if let Some(channel) = calibration.iter().position(unusable) {
            return Err(ReceiveError::Calibration(channel));
        }
        let found = calibration.len();
        let manifold = config.array.manifold::<A>()?;
        let calibration = <[Complex64; A]>::try_from(calibration);
        let calibration = calibration.map_err(|_| ReceiveError::Antennas { found, elements: A })?;
        let search = SearchConfig {
            ssb_freq_hz: Some(config.ssb_freq_hz),
            ..SearchConfig::new(config.spacing, A)
        };
        Ok(Self {
            searcher: Searcher::new(search.clone())?,
            search,
            calibration,
            finder: manifold.map(ArrayManifold::finder).transpose()?,
            cells: Vec::new(),
            last_search_s: f64::NEG_INFINITY,
            searches: 0,
            offset_hz: 0.0,
            in_vain: 0,
            observation: SsbObservation::new(A),
            config,
        })
    }

    /// Whether it is time to search. A receiver without cells looks at every frequency offset that
    /// its oscillator may have at once, then now and then.
    fn searches_now(&self, time_s: f64) -> bool {
        let interval_s = if !self.cells.is_empty() {
            SEARCH_INTERVAL_S
        } else if self.in_vain < self.offsets() {
            0.0
        } else {
            LOST_INTERVAL_S
        };
        time_s - self.last_search_s >= interval_s
    }

    /// Frequency offsets, a subcarrier apart, that the oscillator may have.
    fn offsets(&self) -> u32 {
        let subcarriers =
            1e-6 * OSCILLATOR_PPM * self.config.ssb_freq_hz / self.config.spacing.hz();
        2 * (subcarriers - 0.5).ceil().clamp(0.0, 15.0) as u32 + 1
    }

    /// The frequency offset to search around: that of the cells there are, else the last one known,
    /// one subcarrier above, one below, two above, and so on.
    fn centre_hz(&self) -> f64 {
        if let Some(cell) = self.cells.iter().min_by_key(|cell| cell.tracker.misses()) {
            return cell.tracker.cfo_hz();
        }
        let turn = self.in_vain % self.offsets();
        let away = f64::from(turn.div_ceil(2)) * self.config.spacing.hz();
        self.offset_hz + if turn % 2 == 1 { away } else { -away }
    }

    fn search(&mut self, window: &Window<'_>) -> Result<(), ReceiveError> {
        let period = self.config.period_s * self.config.spacing.base_rate_hz();
        let too_short = |samples: &&[Complex32]| samples.len() < SSB_SAMPLES;
        if window.antennas.iter().any(too_short) {
            return Ok(());
        }
        self.last_search_s = window.time_s;
        self.searches += 1;
        self.searcher.centre(self.centre_hz())?;
        self.in_vain = self.in_vain.saturating_add(1);
        for found in self.searcher.search(window.antennas)? {
            let pci = found.pci.get();
            let wanted = self.config.cells.as_ref();
            if wanted.is_some_and(|cells| !cells.contains(&pci)) {
                continue;
            }
            (self.in_vain, self.offset_hz) = (0, found.cfo_hz);
            let mut found = found.clone();
            found.sample_start += window.start as f64;
            let same = |cell: &&mut Cell<A>| (cell.pci, cell.ssb_index) == (pci, found.ssb_index);
            match self.cells.iter_mut().find(same) {
                Some(cell) if cell.tracker.misses() > 0 => {
                    // Bursts since it was seen last.
                    let late = (found.sample_start - cell.next_start) / period;
                    let bursts = cell.periods + late.round();
                    cell.tracker.found(&found, bursts.max(1.0) * period);
                    (cell.periods, cell.next_start) = (0.0, found.sample_start);
                }
                Some(_) => {}
                None => self.cells.push(Cell {
                    ssb_index: found.ssb_index,
                    pci,
                    tracker: Tracker::new(&self.search, &found)?,
                    periods: 0.0,
                    next_start: found.sample_start,
                    last_seen_s: window.time_s,
                }),
            }
        }
        Ok(())
    }
}

impl<const A: usize> SsbReceiver for ArrayReceiver<A> {
    fn config(&self) -> &ReceiverConfig {
        &self.config
    }

    fn tracked(&self) -> usize {
        self.cells.len()
    }

    fn searches(&self) -> u64 {
        self.searches
    }

    fn receive(
        &mut self,
        window: &Window<'_>,
        take: &mut dyn FnMut(&SsbObservation),
    ) -> Result<(), ReceiveError> {
        let antennas = <[&[Complex32]; A]>::try_from(window.antennas).map_err(|_| {
            let found = window.antennas.len();
            ReceiveError::Antennas { found, elements: A }
        })?;
        if self.searches_now(window.time_s) {
            self.search(window)?;
        }
        let base_rate_hz = self.config.spacing.base_rate_hz();
        let period = self.config.period_s * base_rate_hz;
        let decode_pbch = matches!(self.config.pilots, Pilots::Ssb);
        let first = window.start as f64 + GUARD;
        let length = antennas.first().map_or(0, |samples| samples.len());
        let last = (window.start as f64) + (length as f64) - SSB_SAMPLES as f64 - GUARD;
        for cell in &mut self.cells {
            if cell.next_start < first {
                // Asleep meanwhile, or the window came late.
                let drifted =
                    cell.tracker.expected_start(period) - cell.tracker.expected_start(0.0);
                let bursts = ((first - cell.next_start) / drifted).ceil();
                cell.skip(bursts, period);
            }
            while cell.next_start <= last {
                let start = cell.next_start;
                let seen =
                    cell.tracker
                        .track(&antennas, window.start as f64, start, decode_pbch)?;
                // The beam is told by DM-RS; another cell's SSB is not this one.
                let seen = seen.filter(|seen| seen.ssb_index == cell.ssb_index);
                let Some(seen) = seen else {
                    cell.skip(1.0, period);
                    continue;
                };
                cell.seen(window.time_s, period);
                let elapsed_s = (seen.sample_start - window.start as f64) / base_rate_hz;
                fill(
                    &mut self.observation,
                    &self.config,
                    &self.calibration,
                    self.finder.as_ref(),
                    &cell.tracker,
                    &seen,
                    window.time_s + elapsed_s,
                );
                take(&self.observation);
            }
        }
        self.cells.retain(|cell| !cell.is_lost(window.time_s));
        Ok(())
    }
}

/// Makes an observation of a tracked SSB: noise of unit power, channels calibrated.
fn fill<const A: usize>(
    into: &mut SsbObservation,
    config: &ReceiverConfig,
    calibration: &[Complex64; A],
    finder: Option<&DirectionFinder<ArrayManifold<A>, A>>,
    tracker: &Tracker<A>,
    seen: &Tracked<A>,
    time_s: f64,
) {
    into.restart(SensedSsb {
        pci: seen.pci.get(),
        ssb_index: seen.ssb_index,
        time_s,
        snr_db: seen.snr_db,
    });
    into.cfo_hz = seen.cfo_hz;
    let noise = seen.noise_variance.iter().sum::<f64>() / A as f64;
    let scale = noise.max(f64::MIN_POSITIVE).sqrt().recip();
    let gains = calibration.map(|gain| scale / gain);
    if config.pilots == Pilots::Blind {
        return fill_blind(into, config, tracker, gains);
    }
    let Some(elements) = received(tracker) else {
        return;
    };
    into.noise_variance = Some(1.0);
    let delay = seen.residual_delay;
    let despread = Despread::new(elements, tracker.known(), config.pilots, delay).scaled(&gains);
    if let Some(told) = line_of_sight(&despread, finder) {
        into.push(&told.block);
        return;
    }
    for block in despread.blocks() {
        into.push(&block);
    }
}

/// What every antenna received of the last SSB.
fn received<const A: usize>(
    tracker: &Tracker<A>,
) -> Option<[&[[Complex32; SUBCARRIERS]; SYMBOLS]; A]> {
    let mut elements = [tracker.received(0)?; A];
    for (antenna, grid) in elements.iter_mut().enumerate() {
        *grid = tracker.received(antenna)?;
    }
    Some(elements)
}

/// Resource elements of the broadcast channel as snapshots of a signal that is not known.
fn fill_blind<const A: usize>(
    into: &mut SsbObservation,
    config: &ReceiverConfig,
    tracker: &Tracker<A>,
    gains: [Complex64; A],
) {
    /// Symbol of the SSB that holds nothing but the broadcast channel.
    const PBCH_SYMBOL: usize = 1;
    let Some(elements) = received(tracker) else {
        return;
    };
    for number in 0..config.snapshots {
        let subcarrier = number * SUBCARRIERS / config.snapshots.max(1);
        let mut snapshot = gains;
        for (value, grid) in snapshot.iter_mut().zip(elements) {
            let element = grid[PBCH_SYMBOL]
                .get(subcarrier)
                .copied()
                .unwrap_or_default();
            *value *= Complex64::new(element.re.into(), element.im.into());
        }
        into.push(&snapshot);
    }
}
