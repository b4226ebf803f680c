//! Search for SSBs at one frequency, with FFT plans and buffers that are reused for several
//! recordings.

use nr_ssb::front_end::FrontEnd;
use nr_ssb::grid::SUBCARRIERS;
use nr_ssb::search::{DetectedSsb, SearchConfig, SearchError, Searcher};
use nr_ssb::{ChannelCovariance, Complex32, Pci, SubcarrierSpacing, Tone};

use super::diagnosis::{ExchangeVotes, ONE_TONE_HZ};
use super::error::ScanError;
use super::iq_source::first_not_finite;
use crate::error::RecordingError;
use num_complex::Complex64;
use onboard::receive::SSB_SAMPLES;
use onboard::receive::array_view::{ArraySetup, ArrayView, FoundAngle, View, array_view};

/// Duration of samples that are searched at once in seconds.
pub(super) const BLOCK_S: f64 = 0.02;
/// Probability of a false cell in 20 ms of noise.
pub(super) const FALSE_ALARM: f64 = 1e-3;

/// Configuration of a search.
#[derive(Debug, Clone, PartialEq)]
pub struct SsbSearchConfig {
    /// Name of the samples in errors.
    pub name: String,
    /// Sample rate in Hz.
    pub sample_rate_hz: f64,
    /// Absolute frequency at 0 Hz in the samples.
    pub centre_frequency_hz: f64,
    /// Number of antennas.
    pub antennas: usize,
    /// Centre frequency of the SSB in Hz.
    pub ssb_freq_hz: f64,
    /// Whether the frequencies are absolute, which determines the phase of each symbol (TS 38.211,
    /// 5.4), or only their difference is known.
    pub absolute: bool,
    /// Subcarrier spacing of the SSB.
    pub spacing: SubcarrierSpacing,
    /// Array of the receiver, for angles.
    pub array: ArraySetup,
    /// Probability of a false cell in 20 ms of noise.
    pub false_alarm: f64,
    /// Maximum carrier frequency offset in either direction in Hz, up to five subcarriers.
    pub cfo_range_hz: f64,
}

impl SsbSearchConfig {
    /// Creates a configuration for an SSB with known frequency and subcarrier spacing.
    pub fn new(
        sample_rate_hz: f64,
        centre_frequency_hz: f64,
        ssb_freq_hz: f64,
        spacing: SubcarrierSpacing,
        antennas: usize,
    ) -> Self {
        Self {
            name: "samples".to_owned(),
            sample_rate_hz,
            centre_frequency_hz,
            antennas,
            ssb_freq_hz,
            absolute: true,
            spacing,
            array: ArraySetup::default(),
            false_alarm: FALSE_ALARM,
            cfo_range_hz: 0.5 * spacing.hz(),
        }
    }
}

/// SSB of a recording.
#[derive(Debug, Clone, PartialEq)]
pub struct ScannedSsb {
    /// Cell, SSB index, payload, frequency offset and strength.
    pub ssb: DetectedSsb,
    /// First sample of the SSB including its cyclic prefix, at the sample rate of the recording.
    pub sample_start: f64,
    /// Length of the SSB at the sample rate of the recording.
    pub sample_count: f64,
    /// Centre frequency of the SSB in Hz.
    pub ssb_freq_hz: f64,
    /// Subcarrier spacing of the SSB.
    pub spacing: SubcarrierSpacing,
    /// Angle of arrival; `None` with one antenna.
    pub angle: Option<FoundAngle>,
    /// Response of the array from which the angle is estimated, per symbol and antenna, with unit
    /// noise power; empty without an array.
    pub blocks: Vec<Vec<Complex64>>,
    /// Received channel on the SSB's subcarriers per antenna, without delay and frequency offset.
    pub channel: Vec<[Complex32; SUBCARRIERS]>,
    /// Covariance of the noise of `channel` between subcarriers.
    pub channel_covariance: Option<ChannelCovariance>,
    /// Noise variance on a resource element per antenna, in the squared scale of `channel`.
    pub noise_variance: Vec<f64>,
}

/// Array response of one SSB.
struct SsbResponse {
    pci: Pci,
    sample_start: f64,
    view: Option<View>,
    channel: Vec<[Complex32; SUBCARRIERS]>,
    channel_covariance: ChannelCovariance,
    noise_variance: Vec<f64>,
}

/// Search that can be used for several recordings.
pub struct SsbSearch {
    config: SsbSearchConfig,
    /// Ratio of the input sample rate to the base rate.
    ratio: f64,
    /// Resampler and mixer; `None` if the samples are centred at the base rate.
    front_end: Option<FrontEnd>,
    searcher: Searcher,
    view: Option<Box<dyn ArrayView>>,
    base: Vec<Vec<Complex32>>,
    /// Array responses of the SSBs of one block.
    seen: Vec<SsbResponse>,
    votes: ExchangeVotes,
    tones: Vec<Tone>,
    found: Vec<ScannedSsb>,
}

impl SsbSearch {
    /// Plans a search.
    ///
    /// # Errors
    /// [`ScanError::FrontEnd`], [`ScanError::Search`] or [`ScanError::Array`] for an unsupported
    /// configuration.
    pub fn new(config: SsbSearchConfig) -> Result<Self, ScanError> {
        let offset_hz = config.ssb_freq_hz - config.centre_frequency_hz;
        let (rate_hz, spacing) = (config.sample_rate_hz, config.spacing);
        let front_end = FrontEnd::new(rate_hz, offset_hz, spacing.hz(), config.antennas)
            .map_err(|source| config.front_end_failed(source))?;
        let search = SearchConfig {
            ssb_freq_hz: config.absolute.then_some(config.ssb_freq_hz),
            false_alarm: config.false_alarm,
            cfo_range_hz: config.cfo_range_hz,
            ..SearchConfig::new(spacing, config.antennas)
        };
        let nothing_to_do = rate_hz == spacing.base_rate_hz() && offset_hz == 0.0;
        Ok(Self {
            ratio: front_end.input_per_output(),
            front_end: (!nothing_to_do).then_some(front_end),
            searcher: Searcher::new(search).map_err(|source| config.search_failed(source))?,
            view: array_view(config.antennas, &config.array)?,
            base: vec![Vec::new(); config.antennas],
            seen: Vec::new(),
            votes: ExchangeVotes::default(),
            tones: Vec::new(),
            found: Vec::new(),
            config,
        })
    }

    /// Returns the configuration.
    pub const fn config(&self) -> &SsbSearchConfig {
        &self.config
    }

    /// Returns every SSB of a recording in order of time.
    ///
    /// # Errors
    /// [`ScanError`] for a different number of antennas, different lengths, less than one SSB, or
    /// samples that are not finite.
    pub fn search(&mut self, antennas: &[&[Complex32]]) -> Result<&[ScannedSsb], ScanError> {
        let first = antennas.first().map_or(0, |samples| samples.len());
        if let Some(other) = antennas.iter().find(|samples| samples.len() != first) {
            let other = other.len();
            return Err(self
                .config
                .search_failed(SearchError::UnequalLengths { first, other }));
        }
        if let Some((channel, sample)) = first_not_finite(antennas) {
            let (file, sample) = (self.config.name.clone(), sample as u64);
            return Err(RecordingError::NotFinite {
                file,
                sample,
                channel,
            }
            .into());
        }
        self.begin(first as u64)?;
        let block = self.block();
        let mut start = 0;
        while start < first {
            let end = first.min(start + block);
            let slices: Vec<&[Complex32]> = antennas
                .iter()
                .map(|samples| samples.get(start..end).unwrap_or_default())
                .collect();
            self.push(&slices, end == first)?;
            start = end;
        }
        Ok(&self.found)
    }

    /// Returns the number of samples per block.
    pub(super) fn block(&self) -> usize {
        ((BLOCK_S * self.config.sample_rate_hz) as usize).max(1)
    }

    /// Starts a new recording of `length` samples.
    pub(super) fn begin(&mut self, length: u64) -> Result<(), ScanError> {
        self.searcher.reset();
        self.found.clear();
        self.tones.clear();
        self.votes = ExchangeVotes::default();
        let (samples, needed) = ((length as f64 / self.ratio) as usize, SSB_SAMPLES);
        if samples < needed {
            return Err(self
                .config
                .search_failed(SearchError::TooShort { samples, needed }));
        }
        Ok(())
    }

    /// Processes the next block of a recording.
    pub(super) fn push(&mut self, antennas: &[&[Complex32]], last: bool) -> Result<(), ScanError> {
        let Self {
            config,
            front_end,
            searcher,
            view,
            base,
            seen,
            votes,
            tones,
            ..
        } = self;
        let at_base_rate: Vec<&[Complex32]>;
        let samples = if let Some(front_end) = front_end {
            base.iter_mut().for_each(Vec::clear);
            front_end
                .push(antennas, base)
                .map_err(|source| config.front_end_failed(source))?;
            if last {
                front_end.finish(base);
            }
            at_base_rate = base.iter().map(Vec::as_slice).collect();
            &at_base_rate
        } else {
            antennas
        };
        seen.clear();
        let found = searcher
            .push_with(samples, &mut |ssb, received| {
                let view = view.as_ref().and_then(|view| view.view(received));
                if let Some(view) = &view {
                    votes.vote(view);
                }
                seen.push(SsbResponse {
                    pci: ssb.pci,
                    sample_start: ssb.sample_start,
                    view,
                    channel: received.channel.to_vec(),
                    channel_covariance: received.channel_covariance.clone(),
                    noise_variance: received.noise_variance.to_vec(),
                });
            })
            .map_err(|source| config.search_failed(source))?
            .to_vec();
        let offset_hz = config.ssb_freq_hz - config.centre_frequency_hz;
        for mut tone in searcher.tones() {
            tone.frequency_hz += offset_hz;
            let same = |it: &&mut Tone| (it.frequency_hz - tone.frequency_hz).abs() < ONE_TONE_HZ;
            match tones.iter_mut().find(same) {
                Some(known) if known.power_dbfs >= tone.power_dbfs => {}
                Some(known) => *known = tone,
                None => tones.push(tone),
            }
        }
        let ratio = self.ratio;
        self.found.extend(found.iter().map(|ssb| {
            let same = |it: &SsbResponse| it.pci == ssb.pci && it.sample_start == ssb.sample_start;
            let seen = seen
                .iter()
                .position(same)
                .map(|place| seen.swap_remove(place));
            let (view, channel, channel_covariance, noise_variance) =
                seen.map_or_else(Default::default, |it| {
                    let covariance = Some(it.channel_covariance);
                    (it.view, it.channel, covariance, it.noise_variance)
                });
            ScannedSsb {
                sample_start: ssb.sample_start * ratio,
                sample_count: SSB_SAMPLES as f64 * ratio,
                ssb_freq_hz: config.ssb_freq_hz,
                spacing: config.spacing,
                angle: view.as_ref().map(|view| view.angle),
                blocks: view.map_or_else(Vec::new, |view| view.blocks),
                channel,
                channel_covariance,
                noise_variance,
                ssb: ssb.clone(),
            }
        }));
        Ok(())
    }

    /// Returns the SSBs found so far in order of time.
    pub(super) fn found(&self) -> &[ScannedSsb] {
        &self.found
    }

    /// Returns the subtracted DC offset and tones with their maximum power; frequencies are
    /// relative to the recording's centre.
    pub fn tones(&self) -> &[Tone] {
        &self.tones
    }

    /// Returns the votes of the SSBs on exchanged channels.
    pub(super) const fn votes(&self) -> &ExchangeVotes {
        &self.votes
    }
}

impl SsbSearchConfig {
    fn front_end_failed(&self, source: nr_ssb::front_end::FrontEndError) -> ScanError {
        let file = self.name.clone();
        ScanError::FrontEnd { file, source }
    }

    fn search_failed(&self, source: SearchError) -> ScanError {
        let file = self.name.clone();
        ScanError::Search { file, source }
    }
}
