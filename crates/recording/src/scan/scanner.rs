//! Search for every SSB of a recording without prior knowledge.

use nr_ssb::front_end::FrontEnd;
use nr_ssb::raster;
use nr_ssb::{Complex32, SubcarrierSpacing};

use super::diagnosis::{ChannelFault, ExchangeVotes, add_tone, faults_of_samples};
use super::error::ScanError;
use super::iq_source::IqSource;
use super::search_scope::{Places, SearchScope};
use super::ssb_search::{BLOCK_S, FALSE_ALARM, ScannedSsb, SsbSearch, SsbSearchConfig};
use onboard::receive::array_view::ArraySetup;

/// Durations of the search for unknown frequencies in seconds: the usual SSB period, and the
/// longest one (TS 38.331).
const WINDOWS_S: [f64; 2] = [0.02, 0.16];
/// Limit of the search outside the raster: duration times squared sample rate, which is
/// proportional to the computation. It corresponds to 20 ms at 46.08 Msps; narrower bands are
/// searched longer.
const OFF_RASTER_BUDGET: f64 = 0.02 * 46.08e6 * 46.08e6;

/// Prior knowledge of a scan; by default none.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ScanSettings {
    /// Absolute centre frequency of the SSB in Hz [default: search of the synchronization raster].
    pub ssb_freq_hz: Option<f64>,
    /// Subcarrier spacing [default: both spacings of the frequency range].
    pub spacing: Option<SubcarrierSpacing>,
    /// Maximum frequency error of transmitter and receiver together in parts per million, if the
    /// frequency is given [default: half a subcarrier].
    pub cfo_ppm: Option<f64>,
    /// Centre frequency in Hz that replaces the one of the recording.
    pub centre_frequency_hz: Option<f64>,
    /// Array of the receiver, for angles.
    pub array: ArraySetup,
}

/// Result of a scan.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Scan {
    /// SSBs in order of time.
    pub ssbs: Vec<ScannedSsb>,
    /// Faults of the receive channels.
    pub faults: Vec<ChannelFault>,
    /// Scope of the search.
    pub searched: Vec<SearchScope>,
}

/// Finds every SSB of a recording, in order of time.
///
/// # Errors
/// [`ScanError`] if the recording cannot be read or searched. A recording without an SSB is not an
/// error.
pub fn scan(source: &mut dyn IqSource, settings: &ScanSettings) -> Result<Scan, ScanError> {
    scan_band(source, settings, Band::Whole)
}

/// Finds the SSBs at the given frequency or on the synchronization raster, which takes a fraction of the time.
pub(super) fn scan_on_raster(
    source: &mut dyn IqSource,
    settings: &ScanSettings,
) -> Result<Scan, ScanError> {
    scan_band(source, settings, Band::Raster)
}

/// Frequencies of a search without a given SSB frequency.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Band {
    /// Synchronization raster in the first 20 ms.
    Raster,
    /// Raster, and all other frequencies.
    Whole,
}

fn scan_band(
    source: &mut dyn IqSource,
    settings: &ScanSettings,
    band: Band,
) -> Result<Scan, ScanError> {
    let file = source.name();
    let front_end_failed = |source| ScanError::FrontEnd {
        file: file.clone(),
        source,
    };
    let rate_hz = source.sample_rate_hz();
    let centre_hz = settings
        .centre_frequency_hz
        .or(source.centre_frequency_hz());
    // Report an unsupported sample rate before other errors.
    let [lowest, _] =
        SubcarrierSpacing::of_range(settings.ssb_freq_hz.or(centre_hz).unwrap_or(0.0));
    FrontEnd::new(rate_hz, 0.0, lowest.hz(), 1).map_err(front_end_failed)?;
    let centre_hz = centre_hz.ok_or_else(|| ScanError::NoCentreFrequency { file: file.clone() })?;
    let mut antennas = Vec::new();
    let first_block = source.length().min((BLOCK_S * rate_hz) as u64) as usize;
    source.read(0, first_block, &mut antennas)?;
    let slices: Vec<&[Complex32]> = antennas.iter().map(Vec::as_slice).collect();
    let mut found = Scan {
        faults: faults_of_samples(&slices, rate_hz),
        ..Scan::default()
    };
    let mut votes = ExchangeVotes::default();
    let candidates = if let Some(hz) = settings.ssb_freq_hz {
        let candidates = given_candidates(rate_hz, hz, settings.spacing);
        let duration_s = source.length() as f64 / rate_hz;
        found
            .searched
            .extend(candidates.iter().map(|candidate| SearchScope {
                spacing: candidate.spacing,
                places: Places::Given {
                    ssb_freq_hz: hz,
                    cfo_hz: cfo_range_hz(settings, candidate),
                },
                duration_s,
                channels: slices.len(),
            }));
        candidates
    } else {
        let faults = found.faults.iter();
        let faulty: Vec<usize> = faults.filter_map(ChannelFault::channel).collect();
        let sound = (0..slices.len()).find(|channel| !faulty.contains(channel));
        let search = BandSearch {
            centre_hz: Some(centre_hz).filter(|hz| *hz > 0.0),
            spacing: settings.spacing,
            sound_channel: sound.unwrap_or(0),
            band,
        };
        search.places(source, &mut found.searched)?
    };
    // Divide the false-alarm probability among the searched positions.
    let false_alarm = FALSE_ALARM / candidates.len() as f64;
    for candidate in candidates {
        let mut search = SsbSearch::new(SsbSearchConfig {
            name: file.clone(),
            // A centre frequency of 0 Hz means an unknown one; a given SSB frequency is absolute.
            absolute: centre_hz > 0.0 || settings.ssb_freq_hz.is_some(),
            array: settings.array.clone(),
            false_alarm,
            cfo_range_hz: cfo_range_hz(settings, &candidate),
            ..SsbSearchConfig::new(
                rate_hz,
                centre_hz,
                candidate.ssb_freq_hz,
                candidate.spacing,
                source.channels(),
            )
        })?;
        let (block, length) = (search.block() as u64, source.length());
        search.begin(length)?;
        let mut start = 0;
        while start < length {
            let count = block.min(length - start);
            source.read(start, count as usize, &mut antennas)?;
            start += count;
            let slices: Vec<&[Complex32]> = antennas.iter().map(Vec::as_slice).collect();
            search.push(&slices, start == length)?;
        }
        found.ssbs.extend_from_slice(search.found());
        votes.add(search.votes());
        for tone in search.tones() {
            add_tone(&mut found.faults, *tone);
        }
    }
    found
        .ssbs
        .sort_by(|a, b| a.sample_start.total_cmp(&b.sample_start));
    found.faults.extend(votes.fault());
    Ok(found)
}

/// Frequency and subcarrier spacing of a search.
#[derive(Debug, Clone, Copy, PartialEq)]
struct SsbCandidate {
    ssb_freq_hz: f64,
    spacing: SubcarrierSpacing,
}

fn given_candidates(
    rate_hz: f64,
    ssb_freq_hz: f64,
    spacing: Option<SubcarrierSpacing>,
) -> Vec<SsbCandidate> {
    // A given spacing may cause an error; an assumed one is omitted if it is impossible.
    let likely = SubcarrierSpacing::of_range(ssb_freq_hz).into_iter();
    let possible = likely.filter(|one| spacing.is_none() && one.base_rate_hz() <= rate_hz);
    let candidate = |spacing| SsbCandidate {
        ssb_freq_hz,
        spacing,
    };
    spacing.into_iter().chain(possible).map(candidate).collect()
}

/// Returns the maximum carrier frequency offset of the search in either direction (Hz).
fn cfo_range_hz(settings: &ScanSettings, candidate: &SsbCandidate) -> f64 {
    let given = settings.cfo_ppm.filter(|_| settings.ssb_freq_hz.is_some());
    given.map_or(0.5 * candidate.spacing.hz(), |ppm| {
        1e-6 * ppm * candidate.ssb_freq_hz
    })
}

/// Search for SSBs of unknown frequency.
struct BandSearch {
    centre_hz: Option<f64>,
    spacing: Option<SubcarrierSpacing>,
    /// Index of a channel without a fault.
    sound_channel: usize,
    band: Band,
}

impl BandSearch {
    /// Returns the frequencies with SSBs: on the raster with all channels, and outside the raster
    /// with one channel because of the computing time.
    fn places(
        &self,
        source: &mut dyn IqSource,
        searched: &mut Vec<SearchScope>,
    ) -> Result<Vec<SsbCandidate>, ScanError> {
        let rate_hz = source.sample_rate_hz();
        let file = source.name();
        let failed = |error| match error {
            raster::ScanError::FrontEnd(source) => ScanError::FrontEnd {
                file: file.clone(),
                source,
            },
            raster::ScanError::Search(source) => ScanError::Search {
                file: file.clone(),
                source,
            },
            _ => ScanError::NoCentreFrequency { file: file.clone() },
        };
        let mut antennas = Vec::new();
        let mut examined = 0;
        let mut candidates = Vec::new();
        for window_s in WINDOWS_S {
            let samples = |duration_s: f64| source.length().min((duration_s * rate_hz) as u64);
            let count = samples(window_s) as usize;
            let off_raster = samples(OFF_RASTER_BUDGET / (rate_hz * rate_hz)) as usize;
            if count == examined || !candidates.is_empty() {
                break;
            }
            examined = count;
            source.read(0, count, &mut antennas)?;
            let slices: Vec<&[Complex32]> = antennas.iter().map(Vec::as_slice).collect();
            let mut finds = match self.centre_hz {
                Some(hz) => raster::scan_raster(&slices, rate_hz, hz).map_err(failed)?,
                None => Vec::new(),
            };
            if self.band == Band::Raster {
                finds.retain(|find| self.spacing.is_none_or(|it| it == find.spacing));
                return Ok(finds.iter().map(SsbCandidate::from).collect());
            }
            let one = slices.get(self.sound_channel).copied().unwrap_or_default();
            let one = [&one[..off_raster.min(one.len())]];
            finds.extend(
                raster::scan_off_raster(&one, rate_hz, self.centre_hz, &finds).map_err(failed)?,
            );
            finds.retain(|find| self.spacing.is_none_or(|it| it == find.spacing));
            candidates = finds.iter().map(SsbCandidate::from).collect();
            *searched = self.scopes(rate_hz, [count, one[0].len()], slices.len());
        }
        Ok(candidates)
    }

    /// Returns the scopes of a search of the given numbers of samples on the raster and outside it.
    fn scopes(&self, rate_hz: f64, samples: [usize; 2], channels: usize) -> Vec<SearchScope> {
        let [on_raster_s, off_raster_s] = samples.map(|samples| samples as f64 / rate_hz);
        let range = SubcarrierSpacing::of_range(self.centre_hz.unwrap_or(0.0));
        let spacings = range.into_iter().filter(|one| {
            self.spacing.is_none_or(|it| it == *one) && raster::reach_hz(rate_hz, *one) >= 0.0
        });
        let mut scopes = Vec::new();
        for spacing in spacings {
            let centre_hz = self.centre_hz.unwrap_or(0.0);
            let reach_hz = raster::reach_hz(rate_hz, spacing);
            let (low_hz, high_hz) = (centre_hz - reach_hz, centre_hz + reach_hz);
            if self.centre_hz.is_some() {
                let points = raster::synchronization_raster(low_hz, high_hz).count();
                scopes.push(SearchScope {
                    spacing,
                    places: Places::Raster(points),
                    duration_s: on_raster_s,
                    channels,
                });
            }
            scopes.push(SearchScope {
                spacing,
                places: Places::Anywhere { low_hz, high_hz },
                duration_s: off_raster_s,
                channels: 1,
            });
        }
        scopes
    }
}

impl From<&raster::RasterFind> for SsbCandidate {
    fn from(find: &raster::RasterFind) -> Self {
        Self {
            ssb_freq_hz: find.point.ssb_freq_hz,
            spacing: find.spacing,
        }
    }
}
