//! Receiver of the vehicle: an [`SsbObservation`] of every SSB of the site's cells.
//!
//! [`nr_ssb::receiver`] detects and tracks the cells. [`Receiver`] processes windows at the base
//! rate (256 samples per symbol) around each burst, as in simulations.
//! [`SampleStream`](crate::live::SampleStream) processes a sample stream of any rate.

use aoa::DirectionFinder;
use nr_ssb::grid::{SUBCARRIERS, SYMBOLS};
use nr_ssb::receiver::{self as ssb, ReceivedBeam, ReceiverError, WindowReceiver};
use nr_ssb::track::{Tracker, TrackerOutput};
use nr_ssb::{Complex32, SubcarrierSpacing, Tone};
use num_complex::Complex64;
use thiserror::Error;

use super::despread::Despread;
use super::ranging::RangingClock;
use super::wideband::line_of_sight;
use crate::elements::for_elements;
use crate::manifold::ArrayManifold;
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

    /// Returns the configuration of the SSB receiver.
    fn of_ssbs(&self) -> ssb::ReceiverConfig {
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
    /// The antennas do not form an array.
    #[error(transparent)]
    Array(#[from] aoa::Error),
    /// A channel gain is zero or not finite.
    #[error("gain of channel {0} is not a finite number other than zero")]
    Calibration(usize),
}

/// Receiver of windows at one frequency, for any number of antennas.
pub trait Receiver: Send {
    /// Returns the number of tracked SSBs.
    fn tracked(&self) -> usize;

    /// Returns the number of windows in which cells were searched for.
    fn searches(&self) -> u64;

    /// Searches for cells if a search is due, and passes every SSB in the window to `take`, in
    /// order of time.
    ///
    /// # Errors
    /// [`ReceiveError`] if the number of antennas differs from the configuration, or their lengths
    /// differ.
    fn receive(
        &mut self,
        window: &Window<'_>,
        take: &mut dyn FnMut(&SsbObservation),
    ) -> Result<(), ReceiveError>;
}

/// Creates a receiver of windows without cells.
///
/// # Errors
/// [`ReceiveError::Ssb`] or [`ReceiveError::Calibration`] for invalid settings.
pub fn window_receiver(config: ReceiverConfig) -> Result<Box<dyn Receiver>, ReceiveError> {
    let ssb_config = config.of_ssbs();
    for_elements!(config.array.elements, A => {
        let receiver = WindowReceiver::<A>::new(ssb_config)?;
        Ok(Box::new((receiver, Observer::<A>::new(config)?)))
    })
}

impl<const A: usize> Receiver for (WindowReceiver<A>, Observer<A>) {
    fn tracked(&self) -> usize {
        self.0.tracked()
    }

    fn searches(&self) -> u64 {
        self.0.searches()
    }

    fn receive(
        &mut self,
        window: &Window<'_>,
        take: &mut dyn FnMut(&SsbObservation),
    ) -> Result<(), ReceiveError> {
        let (receiver, observer) = self;
        let (start, antennas) = (window.start as i64, window.antennas);
        let found = antennas.len();
        if found != A {
            return Err(ReceiveError::Antennas { found, elements: A });
        }
        let base_rate_hz = observer.config.spacing.base_rate_hz();
        receiver.receive(&ssb::Window { start, antennas }, &mut |mut seen| {
            let elapsed_s = (seen.ssb.sample_start - start as f64) / base_rate_hz;
            take(observer.observe(&mut seen, window.time_s + elapsed_s));
        })?;
        Ok(())
    }
}

/// Receiver of a sample stream at one frequency, for any number of antennas.
pub(crate) trait StreamReceiver: Send {
    /// Returns the number of tracked SSBs.
    fn tracked(&self) -> usize;

    /// Returns tone number `index` of those that are subtracted, the strongest first, at its
    /// absolute frequency.
    fn tone(&self, index: usize) -> Option<Tone>;

    /// Returns the input sample before which all SSBs have been passed on.
    fn passed_until(&self) -> f64;

    /// Returns the number of SSBs that a search has detected; all others were received at their
    /// expected time.
    fn found(&self) -> u64;

    /// Processes the next samples and passes every completed SSB to `take`, in order of time.
    /// `time_s` returns the reception time of an input sample, whose index is 0 for the first one.
    /// Its second argument is the total duration in seconds of missing samples that the caller has
    /// not reported.
    ///
    /// # Errors
    /// [`ReceiveError`] if the number of antennas differs from the configuration, or their lengths
    /// differ.
    fn push(
        &mut self,
        antennas: &[&[Complex32]],
        time_s: &mut dyn FnMut(f64, f64) -> f64,
        take: &mut dyn FnMut(&SsbObservation),
    ) -> Result<(), ReceiveError>;

    /// Sets the index of the next input sample; the samples before it are missing. Passes on
    /// pending SSBs.
    ///
    /// # Errors
    /// Those of [`push`](Self::push).
    fn gap_to(
        &mut self,
        sample: u64,
        time_s: &mut dyn FnMut(f64, f64) -> f64,
        take: &mut dyn FnMut(&SsbObservation),
    ) -> Result<(), ReceiveError>;

    /// Removes cells and samples, for a stream that restarts at sample 0.
    fn reset(&mut self);
}

/// Creates a receiver without cells, for samples of a rate and centre frequency.
///
/// # Errors
/// Those of [`window_receiver`].
pub(crate) fn stream_receiver(
    config: ReceiverConfig,
    sample_rate_hz: f64,
    centre_hz: f64,
) -> Result<Box<dyn StreamReceiver>, ReceiveError> {
    let ssb_config = config.of_ssbs();
    for_elements!(config.array.elements, A => {
        let receiver = ssb::StreamReceiver::<A>::new(ssb_config, sample_rate_hz, centre_hz)?;
        Ok(Box::new((receiver, Observer::<A>::new(config)?)))
    })
}

impl<const A: usize> StreamReceiver for (ssb::StreamReceiver<A>, Observer<A>) {
    fn tracked(&self) -> usize {
        self.0.receiver().tracked()
    }

    fn tone(&self, index: usize) -> Option<Tone> {
        let mut tone = self.0.receiver().tones().nth(index)?;
        tone.frequency_hz += self.1.config.ssb_freq_hz;
        Some(tone)
    }

    fn passed_until(&self) -> f64 {
        self.0.passed_until() * self.0.input_per_output()
    }

    fn found(&self) -> u64 {
        self.1.found
    }

    fn push(
        &mut self,
        antennas: &[&[Complex32]],
        time_s: &mut dyn FnMut(f64, f64) -> f64,
        take: &mut dyn FnMut(&SsbObservation),
    ) -> Result<(), ReceiveError> {
        let (receiver, observer) = self;
        let ratio = receiver.input_per_output();
        receiver.push(antennas, &mut |mut seen| {
            take(observer.observe_in_stream(&mut seen, ratio, time_s));
        })?;
        Ok(())
    }

    fn gap_to(
        &mut self,
        sample: u64,
        time_s: &mut dyn FnMut(f64, f64) -> f64,
        take: &mut dyn FnMut(&SsbObservation),
    ) -> Result<(), ReceiveError> {
        let (receiver, observer) = self;
        let ratio = receiver.input_per_output();
        receiver.gap_to(sample, &mut |mut seen| {
            take(observer.observe_in_stream(&mut seen, ratio, time_s));
        })?;
        Ok(())
    }

    fn reset(&mut self) {
        let (receiver, observer) = self;
        receiver.reset();
        if let Some(clock) = &mut observer.ranging {
            clock.reset();
        }
    }
}

/// Converter of received SSBs to observations.
struct Observer<const A: usize> {
    config: ReceiverConfig,
    calibration: [Complex64; A],
    /// Direction finder of a non-linear array.
    finder: Option<DirectionFinder<ArrayManifold<A>, A>>,
    /// Clock of the delays, if they are measured.
    ranging: Option<RangingClock>,
    observation: SsbObservation,
    /// Number of SSBs that a search has detected.
    found: u64,
}

impl<const A: usize> Observer<A> {
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
        Ok(Self {
            calibration,
            finder: manifold.map(ArrayManifold::finder).transpose()?,
            ranging: (config.measures_ranging)
                .then(|| RangingClock::new(config.spacing, config.ssb_freq_hz, config.period_s))
                .flatten(),
            observation: SsbObservation::new(A),
            found: 0,
            config,
        })
    }

    /// Returns the observation of a received SSB with its reception time.
    fn observe(&mut self, seen: &mut ReceivedBeam<'_, A>, time_s: f64) -> &SsbObservation {
        self.found += u64::from(!seen.is_followed);
        let ranging = self.ranging.as_mut().and_then(|clock| {
            let observed = seen.tracker.observe(seen.ssb)?;
            let gap_s = seen.unreported_gap / self.config.spacing.base_rate_hz();
            clock.ranging(seen.ssb.ssb_index, &observed.observables, gap_s)
        });
        let (config, finder) = (&self.config, self.finder.as_ref());
        let (tracker, ssb) = (&*seen.tracker, seen.ssb);
        let into = &mut self.observation;
        fill(
            into,
            config,
            &self.calibration,
            finder,
            tracker,
            ssb,
            time_s,
        );
        into.ranging = ranging;
        into
    }

    /// Returns the observation of an SSB in a stream; `ratio` is the number of input samples per
    /// sample at the base rate.
    fn observe_in_stream(
        &mut self,
        seen: &mut ReceivedBeam<'_, A>,
        ratio: f64,
        time_s: &mut dyn FnMut(f64, f64) -> f64,
    ) -> &SsbObservation {
        let unreported_gap_s = seen.unreported_gap / self.config.spacing.base_rate_hz();
        let received_s = time_s(seen.ssb.sample_start * ratio, unreported_gap_s);
        self.observe(seen, received_s)
    }
}

/// Fills an observation of a tracked SSB: unit noise power, calibrated channels.
fn fill<const A: usize>(
    into: &mut SsbObservation,
    config: &ReceiverConfig,
    calibration: &[Complex64; A],
    finder: Option<&DirectionFinder<ArrayManifold<A>, A>>,
    tracker: &Tracker<A>,
    seen: &TrackerOutput<A>,
    time_s: f64,
) {
    into.restart(SsbDetection {
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
    if let Some(direct) = line_of_sight(&despread, finder) {
        into.push(&direct.block);
        return;
    }
    for block in despread.blocks() {
        into.push(&block);
    }
}

/// Returns the received signal of every antenna for the last SSB.
fn received<const A: usize>(
    tracker: &Tracker<A>,
) -> Option<[&[[Complex32; SUBCARRIERS]; SYMBOLS]; A]> {
    let mut elements = [tracker.received(0)?; A];
    for (antenna, grid) in elements.iter_mut().enumerate() {
        *grid = tracker.received(antenna)?;
    }
    Some(elements)
}

/// Fills resource elements of the PBCH as snapshots of an unknown signal.
fn fill_blind<const A: usize>(
    into: &mut SsbObservation,
    config: &ReceiverConfig,
    tracker: &Tracker<A>,
    gains: [Complex64; A],
) {
    /// Symbol of the SSB that contains the PBCH only.
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
