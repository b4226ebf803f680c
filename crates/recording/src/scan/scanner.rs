//! Every SSB of a recording that nobody has said anything about.

use nr_ssb::front_end::FrontEnd;
use nr_ssb::raster::{self, RasterPoint};
use nr_ssb::{Complex32, SubcarrierSpacing};

use super::array_view::ArraySetup;
use super::diagnosis::{ChannelFault, ExchangeVotes, faults_of_samples};
use super::error::ScanError;
use super::iq_source::IqSource;
use super::ssb_search::{BLOCK_S, FALSE_ALARM, FoundSsb, SsbSearch, SsbSearchConfig};

/// Looked through for raster points, in two steps: the usual period, and the longest (TS 38.331).
const RASTER_WINDOWS_S: [f64; 2] = [0.02, 0.16];

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

/// All that a scan found.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Scan {
    /// The SSBs in order of time.
    pub ssbs: Vec<FoundSsb>,
    /// What is wrong with single channels.
    pub faults: Vec<ChannelFault>,
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
    // Shared among the places looked at.
    let false_alarm = FALSE_ALARM / places.len() as f64;
    for place in places {
        let mut search = SsbSearch::new(SsbSearchConfig {
            name: file.clone(),
            // A centre of 0 Hz is none; a given frequency is meant as it is.
            absolute: centre_hz > 0.0 || settings.ssb_freq_hz.is_some(),
            array: settings.array.clone(),
            false_alarm,
            ..SsbSearchConfig::new(
                rate_hz,
                centre_hz,
                place.ssb_freq_hz,
                place.spacing,
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
