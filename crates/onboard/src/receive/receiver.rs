//! Receiver of the vehicle: an [`SsbObservation`] of every SSB of the site's cells.
//!
//! [`nr_ssb::receiver`] detects and tracks the cells. [`Receiver`] processes windows at the base
//! rate (256 samples per symbol) around each burst, as in simulations.
//! [`SampleStream`](crate::live::SampleStream) processes a sample stream of any rate.

use nr_ssb::receiver::{self as ssb, ReceivedBeam, ReceiverError, WindowReceiver};
use nr_ssb::{Complex32, SubcarrierSpacing};
use num_complex::Complex64;
use thiserror::Error;

use super::array_view::{ArraySetup, ArrayView, SsbElements, array_view};
use super::ranging::RangingClock;
use crate::observation::{SsbDetection, SsbObservation};
use crate::settings::{ArraySettings, Pilots, Site, Vehicle};

/// Samples of an SSB at the base rate: four symbols of 256 samples with a cyclic prefix of 18.
pub const SSB_SAMPLES: usize = 4 * 274;

/// Maximum error of the receiver's oscillator in ppm: three times the maximum standard deviation of
/// a scenario.
const OSCILLATOR_PPM: f64 = 60.0;

/// Receiver configuration.
#[derive(Debug, Clone, PartialEq)]
pub struct ReceiverConfig {
    /// Absolute frequency of the SSB's centre in Hz.
    pub ssb_freq_hz: f64,
    /// Subcarrier spacing of the SSB.
    pub spacing: SubcarrierSpacing,
    /// Period of the SSB burst in seconds.
    pub period_s: f64,
    /// Resource elements that are used.
    pub pilots: Pilots,
    /// Number of snapshots of each SSB if no resource element is known (`pilots` is blind).
    pub snapshots: usize,
    /// Antenna array, including the complex gain of each channel.
    pub array: ArraySettings,
    /// Cells that are received; `None` for all.
    pub cells: Option<Vec<u16>>,
    /// Cell and index of every transmitted SSB; empty if unknown. While all of them are received,
    /// no search is made.
    pub beams: Vec<(u16, u8)>,
    /// Interval of the search for further cells, in seconds.
    pub search_every_s: f64,
    /// Whether delay, range rate, carrier phase and power of every SSB are measured.
    pub measures_ranging: bool,
}

impl ReceiverConfig {
    /// Returns the configuration of a vehicle for the cells of a site.
    pub fn new(site: &Site, vehicle: &Vehicle) -> Self {
        let spacing = if site.ssb.subcarrier_spacing_khz == 30.0 {
            SubcarrierSpacing::Khz30
        } else {
            SubcarrierSpacing::Khz15
        };
        let heads = site.radio_heads.iter();
        let received = heads.filter(|head| vehicle.receiver.receives(head.pci));
        let beams: Vec<_> = received.map(|head| (head.pci, head.ssb_index)).collect();
        Self {
            ssb_freq_hz: site.carrier_mhz * 1e6,
            spacing,
            period_s: site.ssb.period_s(),
            pilots: vehicle.receiver.pilots,
            snapshots: vehicle.receiver.snapshots.into(),
            array: vehicle.array.clone(),
            cells: Some(beams.iter().map(|(pci, _)| *pci).collect()),
            beams,
            search_every_s: 1.0,
            measures_ranging: vehicle.has_one_way_ranging(),
        }
    }

    /// Returns an error unless samples have the configured number of antennas.
    pub(crate) fn check_antennas(&self, found: usize) -> Result<(), ReceiveError> {
        let elements = self.array.elements.into();
        if found != elements {
            return Err(ReceiveError::Antennas { found, elements });
        }
        Ok(())
    }

    /// Returns the configuration of the SSB receiver.
    pub(crate) fn of_ssbs(&self) -> ssb::ReceiverConfig {
        let antennas = self.array.elements.into();
        let widest_ppm = ssb::ReceiverConfig::widest_ppm(self.ssb_freq_hz, self.spacing);
        ssb::ReceiverConfig {
            period_s: self.period_s,
            oscillator_ppm: OSCILLATOR_PPM.min(widest_ppm),
            cells: self.cells.clone(),
            beams: self.beams.clone(),
            search_every_s: self.search_every_s,
            decode_pbch: matches!(self.pilots, Pilots::Ssb),
            ..ssb::ReceiverConfig::new(self.ssb_freq_hz, self.spacing, antennas)
        }
    }
}

/// Samples at the base rate.
#[derive(Debug, Clone, Copy)]
pub struct Window<'a> {
    /// Index of the first sample, in samples of the receiver's clock.
    pub start: u64,
    /// Time of the first sample in seconds.
    pub time_s: f64,
    /// Samples of each antenna, with equal lengths.
    pub antennas: &'a [&'a [Complex32]],
}

/// Reason why reception is impossible.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum ReceiveError {
    /// Settings, rate, frequency or samples do not match.
    #[error(transparent)]
    Ssb(#[from] ReceiverError),
    /// The number of antennas differs from the configuration.
    #[error("{found} channels; the vehicle's array has {elements}")]
    Antennas {
        /// Number of antennas of the samples.
        found: usize,
        /// Configured number of antennas.
        elements: usize,
    },
    /// The antennas do not form an array, or a channel gain is zero or not finite.
    #[error(transparent)]
    Array(#[from] aoa::Error),
}

/// Receiver of windows at one frequency.
pub struct Receiver {
    windows: WindowReceiver,
    observer: Observer,
    observation: SsbObservation,
}

impl Receiver {
    /// Creates a receiver of windows without cells.
    ///
    /// # Errors
    /// [`ReceiveError::Ssb`] or [`ReceiveError::Array`] for invalid settings.
    pub fn new(config: ReceiverConfig) -> Result<Self, ReceiveError> {
        Ok(Self {
            windows: WindowReceiver::new(config.of_ssbs())?,
            observation: SsbObservation::new(config.array.elements.into()),
            observer: Observer::new(config)?,
        })
    }

    /// Returns the number of tracked SSBs.
    pub fn tracked(&self) -> usize {
        self.windows.tracked()
    }

    /// Returns the number of windows in which cells were searched for.
    pub const fn searches(&self) -> u64 {
        self.windows.searches()
    }

    /// Searches for cells if a search is due, and passes every SSB in the window to `take`, in
    /// order of time.
    ///
    /// # Errors
    /// [`ReceiveError`] if the number of antennas differs from the configuration, or their lengths
    /// differ.
    pub fn receive(
        &mut self,
        window: &Window<'_>,
        take: &mut dyn FnMut(&SsbObservation),
    ) -> Result<(), ReceiveError> {
        let (start, antennas) = (window.start as i64, window.antennas);
        self.observer.config.check_antennas(antennas.len())?;
        let base_rate_hz = self.observer.config.spacing.base_rate_hz();
        let window_of_ssbs = ssb::Window { start, antennas };
        self.windows.receive(&window_of_ssbs, &mut |mut beam| {
            let elapsed_s = (beam.ssb.sample_start - start as f64) / base_rate_hz;
            let time_s = window.time_s + elapsed_s;
            self.observer
                .observe(&mut beam, time_s, &mut self.observation);
            take(&self.observation);
        })?;
        Ok(())
    }
}

/// Converter of received SSBs to observations.
pub(crate) struct Observer {
    config: ReceiverConfig,
    view: Box<dyn ArrayView>,
    /// Clock of the delays, if they are measured.
    ranging: Option<RangingClock>,
    /// Number of SSBs that a search has detected.
    found: u64,
}

impl Observer {
    /// Creates a converter.
    ///
    /// # Errors
    /// [`ReceiveError::Array`] for invalid settings.
    pub fn new(config: ReceiverConfig) -> Result<Self, ReceiveError> {
        let elements = config.array.elements.into();
        let setup = ArraySetup {
            shape: config.array.shape.clone(),
            spacing_wavelengths: config.array.spacing_wavelengths,
            calibration: Some(config.array.calibration()),
        };
        let view = array_view(elements, &setup)?;
        let found = elements;
        Ok(Self {
            view: view.ok_or(ReceiveError::Antennas { found, elements })?,
            ranging: (config.measures_ranging)
                .then(|| RangingClock::new(config.spacing, config.ssb_freq_hz, config.period_s))
                .flatten(),
            found: 0,
            config,
        })
    }

    /// Returns the configuration.
    pub const fn config(&self) -> &ReceiverConfig {
        &self.config
    }

    /// Returns the number of SSBs that a search has detected; all others were received at their
    /// expected time.
    pub const fn found(&self) -> u64 {
        self.found
    }

    /// Restarts the clock of the delays.
    pub fn reset(&mut self) {
        if let Some(clock) = &mut self.ranging {
            clock.reset();
        }
    }

    /// Returns the duration of unreported missing samples before an SSB, in seconds.
    pub fn unreported_gap_s(&self, beam: &ReceivedBeam<'_>) -> f64 {
        beam.unreported_gap / self.config.spacing.base_rate_hz()
    }

    /// Fills the observation of a received SSB with its reception time: unit noise power,
    /// calibrated channels.
    pub fn observe(&mut self, beam: &mut ReceivedBeam<'_>, time_s: f64, into: &mut SsbObservation) {
        self.found += u64::from(!beam.is_followed);
        let gap_s = self.unreported_gap_s(beam);
        let ssb = beam.ssb;
        into.restart(SsbDetection {
            pci: ssb.pci.get(),
            ssb_index: ssb.ssb_index,
            time_s,
            snr_db: ssb.snr_db,
        });
        into.cfo_hz = ssb.cfo_hz;
        into.ranging = self.ranging.as_mut().and_then(|clock| {
            let observed = beam.tracker.observe(ssb)?;
            clock.ranging(ssb.ssb_index, &observed.observables, gap_s)
        });
        let elements = SsbElements {
            received: beam.tracker.received(),
            known: beam.tracker.known(),
            noise_variance: &ssb.noise_variance,
            delay: ssb.residual_delay,
        };
        let (view, pilots, count) = (&self.view, self.config.pilots, self.config.snapshots);
        into.noise_variance = (pilots != Pilots::Blind).then_some(1.0);
        let mut take = |snapshot: &[Complex64]| {
            into.push(snapshot);
        };
        match pilots {
            Pilots::Blind => view.snapshots(&elements, count, &mut take),
            _ => view.responses(&elements, pilots, &mut take),
        }
    }
}
