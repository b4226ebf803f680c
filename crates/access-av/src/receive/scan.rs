//! Every SSB of a recording that nobody has said anything about.

use nr_ssb::front_end::{FrontEnd, FrontEndError};
use nr_ssb::raster::{self, RasterPoint};
use nr_ssb::search::{DetectedSsb, SearchConfig, SearchError, Searcher};
use nr_ssb::{Complex32, SubcarrierSpacing};
use thiserror::Error;

use super::SSB_SAMPLES;
use super::array_view::{ArraySetup, ArrayView, View, array_view};
use super::diagnosis::{ChannelFault, ExchangeVotes, faults_of_samples};
use super::iq_source::IqSource;
use crate::recording::RecordingError;

/// Read and searched at once.
const BLOCK_S: f64 = 0.02;
/// Looked through for raster points, in two steps: the usual period, and the longest (TS 38.331).
const RASTER_WINDOWS_S: [f64; 2] = [0.02, 0.16];
/// Probability that 20 ms of noise make a cell, shared among the places looked at.
const FALSE_ALARM: f64 = 1e-3;

/// What a scan is told; by default nothing.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ScanSettings {
    /// Absolute frequency of the SSB's centre in Hz; else the synchronization raster is searched.
    pub ssb_freq_hz: Option<f64>,
    /// Subcarrier spacing; else both are tried.
    pub spacing: Option<SubcarrierSpacing>,
    /// Centre frequency of the recording in Hz, in place of its own.
    pub centre_frequency_hz: Option<f64>,
    /// The receiving array, for angles.
    pub array: ArraySetup,
}

/// One SSB of a recording.
#[derive(Debug, Clone, PartialEq)]
pub struct FoundSsb {
    /// Cell, index, payload, offset and strength.
    pub ssb: DetectedSsb,
    /// First sample of the SSB, its cyclic prefix included, at the recording's rate.
    pub sample_start: f64,
    /// Its length at the recording's rate.
    pub sample_count: f64,
    /// Frequency of its centre in Hz.
    pub ssb_freq_hz: f64,
    /// Its subcarrier spacing.
    pub spacing: SubcarrierSpacing,
    /// Angle of arrival, with two antennas and more.
    pub angle: Option<aoa::AngleEstimate>,
}

/// All that a scan found.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Scan {
    /// The SSBs in order of time.
    pub ssbs: Vec<FoundSsb>,
    /// What is wrong with single channels.
    pub faults: Vec<ChannelFault>,
}

/// What makes a scan impossible.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ScanError {
    /// The samples cannot be read.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// The recording's rate or band does not suit.
    #[error("{file}: {source}")]
    FrontEnd {
        /// The recording.
        file: String,
        /// What does not suit.
        source: FrontEndError,
    },
    /// The search refused its input.
    #[error("{file}: {source}")]
    Search {
        /// The recording.
        file: String,
        /// What does not suit.
        source: SearchError,
    },
    /// No centre frequency, in the recording or in the settings.
    #[error("{file}: no centre frequency; the recording must state it, or it must be given")]
    NoCentreFrequency {
        /// The recording.
        file: String,
    },
    /// An impossible array.
    #[error("array: {0}")]
    Array(#[from] aoa::Error),
}

/// Finds every SSB of a recording, in order of time.
///
/// # Errors
/// [`ScanError`] when the recording cannot be read or searched as it is; a recording without any
/// SSB is not an error.
pub fn scan(source: &mut dyn IqSource, settings: &ScanSettings) -> Result<Scan, ScanError> {
    let file = source.name();
    let front_end_failed = |source| ScanError::FrontEnd {
        file: file.clone(),
        source,
    };
    let rate_hz = source.sample_rate_hz();
    // A rate that no numerology can use is better said before anything else.
    FrontEnd::new(rate_hz, 0.0, SubcarrierSpacing::Khz15.hz(), 1).map_err(front_end_failed)?;
    let centre_hz = settings
        .centre_frequency_hz
        .or(source.centre_frequency_hz())
        .ok_or_else(|| ScanError::NoCentreFrequency { file: file.clone() })?;
    let mut antennas = Vec::new();
    let first_block = source.length().min((BLOCK_S * rate_hz) as u64) as usize;
    source.read(0, first_block, &mut antennas)?;
    let slices: Vec<&[Complex32]> = antennas.iter().map(Vec::as_slice).collect();
    let mut found = Scan {
        faults: faults_of_samples(&slices),
        ..Scan::default()
    };
    let mut votes = ExchangeVotes::default();
    let places = match settings.ssb_freq_hz {
        Some(hz) => given_places(rate_hz, hz, settings.spacing),
        None => raster_places(source, settings.spacing, centre_hz)?,
    };
    for place in &places {
        let config = SearchConfig {
            // A centre of 0 Hz is none; a given frequency is meant as it is.
            ssb_freq_hz: (centre_hz > 0.0 || settings.ssb_freq_hz.is_some())
                .then_some(place.ssb_freq_hz),
            false_alarm: FALSE_ALARM / places.len() as f64,
            ..SearchConfig::new(place.spacing, source.channels())
        };
        let mut front_end = FrontEnd::new(
            rate_hz,
            place.ssb_freq_hz - centre_hz,
            place.spacing.hz(),
            source.channels(),
        )
        .map_err(front_end_failed)?;
        let mut view = array_view(&config, &settings.array)?;
        for (ssb, seen) in search(source, &config, &mut front_end, view.as_deref_mut())? {
            if let Some(seen) = &seen {
                votes.vote(seen);
            }
            let ratio = front_end.input_per_output();
            found.ssbs.push(FoundSsb {
                sample_start: ssb.sample_start * ratio,
                sample_count: SSB_SAMPLES as f64 * ratio,
                ssb_freq_hz: place.ssb_freq_hz,
                spacing: place.spacing,
                angle: seen.map(|seen| seen.estimate),
                ssb,
            });
        }
    }
    found
        .ssbs
        .sort_by(|a, b| a.sample_start.total_cmp(&b.sample_start));
    found.faults.extend(votes.fault());
    Ok(found)
}

/// Where to search, and how.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Place {
    ssb_freq_hz: f64,
    spacing: SubcarrierSpacing,
}

fn given_places(rate_hz: f64, ssb_freq_hz: f64, spacing: Option<SubcarrierSpacing>) -> Vec<Place> {
    let both = [SubcarrierSpacing::Khz15, SubcarrierSpacing::Khz30];
    // A spacing that was asked for may fail; one that was only guessed is left out.
    both.into_iter()
        .filter(|one| spacing.map_or(one.base_rate_hz() <= rate_hz, |wanted| wanted == *one))
        .map(|spacing| Place {
            ssb_freq_hz,
            spacing,
        })
        .collect()
}

fn raster_places(
    source: &mut dyn IqSource,
    spacing: Option<SubcarrierSpacing>,
    centre_hz: f64,
) -> Result<Vec<Place>, ScanError> {
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
    let suiting = |finds: Vec<raster::RasterFind>| -> Vec<Place> {
        let suits = |find: &&raster::RasterFind| spacing.is_none_or(|it| it == find.spacing);
        let place = |find: &raster::RasterFind| {
            let RasterPoint { ssb_freq_hz, .. } = find.point;
            Place {
                ssb_freq_hz,
                spacing: find.spacing,
            }
        };
        finds.iter().filter(suits).map(place).collect()
    };
    let centre_hz = Some(centre_hz).filter(|hz| *hz > 0.0);
    let mut antennas = Vec::new();
    let mut looked_at = 0;
    for window_s in RASTER_WINDOWS_S {
        let Some(centre_hz) = centre_hz else { break };
        let count = source.length().min((window_s * rate_hz) as u64) as usize;
        if count == looked_at {
            break;
        }
        looked_at = count;
        source.read(0, count, &mut antennas)?;
        let slices: Vec<&[Complex32]> = antennas.iter().map(Vec::as_slice).collect();
        let finds = raster::scan_raster(&slices, rate_hz, centre_hz).map_err(failed)?;
        let places = suiting(finds);
        if !places.is_empty() {
            return Ok(places);
        }
    }
    // Off the raster, or without a centre to count from, the whole band is looked through, for
    // one period on one antenna.
    let count = source.length().min((RASTER_WINDOWS_S[0] * rate_hz) as u64) as usize;
    source.read(0, count, &mut antennas)?;
    let first: Vec<&[Complex32]> = antennas.iter().take(1).map(Vec::as_slice).collect();
    let finds = raster::scan_off_raster(&first, rate_hz, centre_hz).map_err(failed)?;
    Ok(suiting(finds))
}

/// Calls `act` with block after block, and whether it is the last.
fn for_each_block(
    source: &mut dyn IqSource,
    antennas: &mut Vec<Vec<Complex32>>,
    mut act: impl FnMut(&[Vec<Complex32>], bool) -> Result<(), ScanError>,
) -> Result<(), ScanError> {
    let block = ((BLOCK_S * source.sample_rate_hz()) as u64).max(1);
    let mut start = 0;
    while start < source.length() {
        let count = block.min(source.length() - start);
        source.read(start, count as usize, antennas)?;
        start += count;
        act(antennas, start == source.length())?;
    }
    Ok(())
}

/// The SSBs at one place, and how the array sees each.
fn search(
    source: &mut dyn IqSource,
    config: &SearchConfig,
    front_end: &mut FrontEnd,
    mut view: Option<&mut (dyn ArrayView + 'static)>,
) -> Result<Vec<(DetectedSsb, Option<View>)>, ScanError> {
    let file = source.name();
    let front_end_failed = |source| ScanError::FrontEnd {
        file: file.clone(),
        source,
    };
    let search_failed = |source| ScanError::Search {
        file: file.clone(),
        source,
    };
    let samples = (source.length() as f64 / front_end.input_per_output()) as usize;
    if samples < SSB_SAMPLES {
        return Err(search_failed(SearchError::TooShort {
            samples,
            needed: SSB_SAMPLES,
        }));
    }
    let mut searcher = Searcher::new(config.clone()).map_err(search_failed)?;
    let mut found = Vec::new();
    let mut base = vec![Vec::new(); source.channels()];
    let mut base_start = 0u64;
    let mut raw = Vec::new();
    for_each_block(source, &mut raw, |raw, last| {
        let known = base.first().map_or(0, Vec::len);
        front_end.push(raw, &mut base).map_err(front_end_failed)?;
        if last {
            front_end.finish(&mut base);
        }
        let window: Vec<&[Complex32]> = base.iter().map(Vec::as_slice).collect();
        let new: Vec<&[Complex32]> = window
            .iter()
            .map(|samples| samples.get(known..).unwrap_or_default())
            .collect();
        for ssb in searcher.push(&new).map_err(search_failed)? {
            let seen = view
                .as_mut()
                .and_then(|view| view.view(ssb, &window, base_start as f64));
            found.push((ssb.clone(), seen));
        }
        // An SSB that is complete only with the next block begins at most this long ago.
        let gone = window
            .first()
            .map_or(0, |it| it.len().saturating_sub(2 * SSB_SAMPLES));
        for samples in &mut base {
            samples.drain(..gone);
        }
        base_start += gone as u64;
        Ok(())
    })?;
    Ok(found)
}
