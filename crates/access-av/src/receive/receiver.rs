//! The vehicle's receiver: finds cells, keeps to them, and makes an [`SsbObservation`] of every SSB.
//!
//! It is given windows of samples at the base rate (256 to a symbol), however they came about: cut
//! from a recording, or made by the simulator around each burst.

use nr_ssb::grid::{SUBCARRIERS, SYMBOLS};
use nr_ssb::search::{SearchConfig, SearchError, Searcher};
use nr_ssb::track::{TrackError, Tracked, Tracker};
use nr_ssb::{Complex32, SubcarrierSpacing};
use num_complex::Complex64;
use thiserror::Error;

use super::SSB_SAMPLES;
use super::despread::Despread;
use super::wideband::line_of_sight;
use crate::observation::{ANTENNAS, SensedSsb, SsbObservation};
use crate::scenario::{Pilots, Scenario};

/// SSBs in a row that must be missing before a cell is given up: one second at the usual period.
const MISSES: u32 = 50;
/// Time after which a receiver that has cells looks for others, in seconds.
const SEARCH_INTERVAL_S: f64 = 1.0;
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
    /// Complex gain of each channel, by which it is divided.
    pub calibration: [Complex64; ANTENNAS],
    /// Cells to listen to; all without.
    pub cells: Option<Vec<u16>>,
}

impl ReceiverConfig {
    /// The scenario's receiver, its channels ideal, for the cells of its radio heads.
    pub fn new(scenario: &Scenario) -> Self {
        let spacing = if scenario.ssb.subcarrier_spacing_khz == 30.0 {
            SubcarrierSpacing::Khz30
        } else {
            SubcarrierSpacing::Khz15
        };
        Self {
            ssb_freq_hz: scenario.ssb.carrier_mhz * 1e6,
            spacing,
            period_s: scenario.ssb.period_s(),
            pilots: scenario.receiver.pilots,
            snapshots: scenario.array.snapshots.into(),
            calibration: [Complex64::ONE; ANTENNAS],
            cells: Some(scenario.radio_heads.iter().map(|head| head.pci).collect()),
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
    pub antennas: [&'a [Complex32]; ANTENNAS],
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
    /// A channel gain of zero or not finite.
    #[error("gain of channel {0} is not a finite number other than zero")]
    Calibration(usize),
}

/// A receiver on one frequency.
pub struct Receiver {
    config: ReceiverConfig,
    search: SearchConfig,
    searcher: Searcher,
    cells: Vec<Cell>,
    last_search_s: f64,
    observation: SsbObservation,
}

struct Cell {
    ssb_index: u8,
    pci: u16,
    tracker: Tracker<ANTENNAS>,
    next_start: f64,
}

impl Receiver {
    /// A receiver that knows no cell yet.
    ///
    /// # Errors
    /// [`ReceiveError::Search`] or [`ReceiveError::Calibration`] for impossible settings.
    pub fn new(config: ReceiverConfig) -> Result<Self, ReceiveError> {
        let unusable = |gain: &Complex64| !gain.norm_sqr().is_normal();
        if let Some(channel) = config.calibration.iter().position(unusable) {
            return Err(ReceiveError::Calibration(channel));
        }
        let search = SearchConfig {
            ssb_freq_hz: Some(config.ssb_freq_hz),
            ..SearchConfig::new(config.spacing, ANTENNAS)
        };
        let nothing = SensedSsb {
            pci: 0,
            ssb_index: 0,
            time_s: 0.0,
            snr_db: 0.0,
        };
        Ok(Self {
            searcher: Searcher::new(search.clone())?,
            search,
            cells: Vec::new(),
            last_search_s: f64::NEG_INFINITY,
            observation: SsbObservation::new(nothing),
            config,
        })
    }

    /// What it was told.
    pub const fn config(&self) -> &ReceiverConfig {
        &self.config
    }

    /// Number of SSBs that are tracked.
    pub fn tracked(&self) -> usize {
        self.cells.len()
    }

    /// Looks for cells where it is time to, and hands every SSB that lies in the window to `take`.
    ///
    /// # Errors
    /// [`ReceiveError`] where the antennas are not equally long.
    pub fn receive(
        &mut self,
        window: &Window<'_>,
        mut take: impl FnMut(&SsbObservation),
    ) -> Result<(), ReceiveError> {
        let since_s = window.time_s - self.last_search_s;
        if self.cells.is_empty() || since_s >= SEARCH_INTERVAL_S {
            self.search(window)?;
        }
        let base_rate_hz = self.config.spacing.base_rate_hz();
        let period = self.config.period_s * base_rate_hz;
        let decode_pbch = matches!(self.config.pilots, Pilots::Ssb);
        let first = window.start as f64 + GUARD;
        let [antenna, ..] = window.antennas;
        let last = (window.start as f64) + (antenna.len() as f64) - SSB_SAMPLES as f64 - GUARD;
        for cell in &mut self.cells {
            if cell.next_start < first {
                // Asleep meanwhile, or the window came late.
                let missed = ((first - cell.next_start) / period).ceil();
                cell.next_start += missed * period;
            }
            while cell.next_start <= last {
                let start = cell.next_start;
                let seen = cell.tracker.track(
                    &window.antennas,
                    window.start as f64,
                    start,
                    decode_pbch,
                )?;
                // The beam is told by DM-RS; another cell's SSB is not this one.
                let seen = seen.filter(|seen| seen.ssb_index == cell.ssb_index);
                cell.next_start = match &seen {
                    Some(seen) => cell
                        .tracker
                        .expected_start(period)
                        .max(seen.sample_start + 1.0),
                    None => start + period,
                };
                if let Some(seen) = seen {
                    let elapsed_s = (seen.sample_start - window.start as f64) / base_rate_hz;
                    let time_s = window.time_s + elapsed_s;
                    fill(
                        &mut self.observation,
                        &self.config,
                        &cell.tracker,
                        &seen,
                        time_s,
                    );
                    take(&self.observation);
                }
            }
        }
        self.cells.retain(|cell| cell.tracker.misses() <= MISSES);
        Ok(())
    }

    fn search(&mut self, window: &Window<'_>) -> Result<(), ReceiveError> {
        self.last_search_s = window.time_s;
        if window
            .antennas
            .iter()
            .any(|samples| samples.len() < SSB_SAMPLES)
        {
            return Ok(());
        }
        for found in self.searcher.search(&window.antennas)? {
            let pci = found.pci.get();
            let wanted = self
                .config
                .cells
                .as_ref()
                .is_none_or(|cells| cells.contains(&pci));
            let known = |cell: &Cell| (cell.pci, cell.ssb_index) == (pci, found.ssb_index);
            if wanted && !self.cells.iter().any(known) {
                let mut found = found.clone();
                found.sample_start += window.start as f64;
                self.cells.push(Cell {
                    ssb_index: found.ssb_index,
                    pci,
                    tracker: Tracker::new(&self.search, &found)?,
                    next_start: found.sample_start,
                });
            }
        }
        Ok(())
    }
}

/// Makes an observation of a tracked SSB: noise of unit power, channels calibrated.
fn fill(
    into: &mut SsbObservation,
    config: &ReceiverConfig,
    tracker: &Tracker<ANTENNAS>,
    seen: &Tracked<ANTENNAS>,
    time_s: f64,
) {
    into.restart(SensedSsb {
        pci: seen.pci.get(),
        ssb_index: seen.ssb_index,
        time_s,
        snr_db: seen.snr_db,
    });
    into.cfo_hz = seen.cfo_hz;
    let noise = seen.noise_variance.iter().sum::<f64>() / ANTENNAS as f64;
    let scale = noise.max(f64::MIN_POSITIVE).sqrt().recip();
    let gains: [Complex64; ANTENNAS] = config.calibration.map(|gain| scale / gain);
    if config.pilots == Pilots::Blind {
        return fill_blind(into, config, tracker, gains);
    }
    let Some(elements) = received(tracker) else {
        return;
    };
    into.noise_variance = Some(1.0);
    let delay = seen.residual_delay;
    let despread = Despread::new(elements, tracker.known(), config.pilots, delay).scaled(&gains);
    if let Some(told) = line_of_sight(&despread) {
        into.push(told.block);
        return;
    }
    for block in despread.blocks() {
        into.push(block);
    }
}

/// What every antenna received of the last SSB.
fn received(
    tracker: &Tracker<ANTENNAS>,
) -> Option<[&[[Complex32; SUBCARRIERS]; SYMBOLS]; ANTENNAS]> {
    let mut elements = [tracker.received(0)?; ANTENNAS];
    for (antenna, grid) in elements.iter_mut().enumerate() {
        *grid = tracker.received(antenna)?;
    }
    Some(elements)
}

/// Resource elements of the broadcast channel as snapshots of a signal that is not known.
fn fill_blind(
    into: &mut SsbObservation,
    config: &ReceiverConfig,
    tracker: &Tracker<ANTENNAS>,
    gains: [Complex64; ANTENNAS],
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
        into.push(snapshot);
    }
}
