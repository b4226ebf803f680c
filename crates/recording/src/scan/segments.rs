//! Scan of a recording by segments, each with one centre frequency and without a gap.

use nr_ssb::SubcarrierSpacing;
use num_complex::Complex32;

use super::diagnosis::{ChannelFault, add_tone};
use super::error::ScanError;
use super::iq_source::IqSource;
use super::scanner::{Scan, ScanSettings, scan, scan_on_raster};
use crate::error::RecordingError;
use crate::sigmf::{Recording, Segment, check_centre_hz};

/// Minimum duration of a searched segment (s): the SSB with the widest subcarriers, 240 kHz.
const SHORTEST_S: f64 = 17e-6;
/// Duration to which shorter segments are extended by zeros (s), because the search requires more
/// than one SSB of any spacing.
const EXTENDED_S: f64 = 1e-3;

/// Ratios of the true to the specified sample rate that are tested if no PBCH is decoded: a decimation by two that was
/// specified but not applied, or the reverse.
const RATE_RATIOS: [f64; 2] = [0.5, 2.0];

/// Finds every SSB of a recording in order of time, at the centre frequency of its capture. After a gap, SSBs are
/// searched for at the frequencies where they were found before the gap. If no PBCH is decoded, the search is repeated
/// with I and Q exchanged, and then on the synchronization raster with half and twice the sample rate.
///
/// # Errors
/// Errors of [`scan`]; [`ScanError::Recording`] for a centre frequency outside 5G NR, or for one
/// that would replace several.
pub fn scan_recording(
    recording: &mut Recording,
    settings: &ScanSettings,
) -> Result<Scan, ScanError> {
    let segments = recording.segments();
    if let Some(hz) = settings.centre_frequency_hz {
        let wrong = |allowed: String| {
            RecordingError::value(recording.data_file(), "centre frequency", hz, allowed)
        };
        check_centre_hz(hz).map_err(wrong)?;
        let first = segments.first();
        if first.is_some_and(|first| segments.iter().any(|it| !it.has_frequency_of(first))) {
            let allowed =
                "it cannot replace the different core:frequency of the captures".to_owned();
            return Err(wrong(allowed).into());
        }
    }
    let mut found = Scan::default();
    let mut known: Vec<KnownPlaces> = Vec::new();
    let is_only = segments.len() == 1;
    // No SSB is in a segment that is shorter than one.
    let least = SHORTEST_S * recording.sample_rate_hz();
    let searched = |it: &Segment| is_only || it.length as f64 >= least;
    for segment in segments.into_iter().filter(searched) {
        let mut source = SegmentSource {
            recording: &mut *recording,
            segment,
            exchanged: false,
            rate_ratio: 1.0,
        };
        let before = known
            .iter()
            .find(|it| it.segment.has_frequency_of(&segment));
        let mut part = match before {
            Some(before) => before.scan(&mut source, settings)?,
            None => scan_either_way(&mut source, settings)?,
        };
        if before.is_none() {
            known.extend(KnownPlaces::of(&part, segment, source.exchanged, settings));
        }
        for ssb in &mut part.ssbs {
            ssb.sample_start += segment.start as f64;
        }
        found.ssbs.append(&mut part.ssbs);
        for scope in part.searched {
            match found.searched.iter_mut().find(|it| it.is_where(&scope)) {
                Some(known) => known.duration_s += scope.duration_s,
                None => found.searched.push(scope),
            }
        }
        for fault in part.faults {
            match fault {
                ChannelFault::Tone(tone) => add_tone(&mut found.faults, tone),
                fault if found.faults.contains(&fault) => {}
                fault => found.faults.push(fault),
            }
        }
    }
    Ok(found)
}

/// Scans a segment and, if no PBCH is decoded, scans it with I and Q exchanged.
fn scan_either_way(
    source: &mut SegmentSource<'_>,
    settings: &ScanSettings,
) -> Result<Scan, ScanError> {
    let mut part = scan(source, settings)?;
    if !has_message(&part) {
        source.exchanged = true;
        let exchanged = scan(source, settings)?;
        source.exchanged = has_message(&exchanged);
        if source.exchanged {
            part.ssbs = exchanged.ssbs;
            part.faults.push(ChannelFault::IqExchanged);
        } else {
            part.faults.extend(likely_rate(source, settings)?);
        }
    }
    Ok(part)
}

/// Returns the sample rate with which a PBCH is decoded, if it is half or twice the specified one.
fn likely_rate(
    source: &mut SegmentSource<'_>,
    settings: &ScanSettings,
) -> Result<Option<ChannelFault>, ScanError> {
    let specified_hz = source.sample_rate_hz();
    for ratio in RATE_RATIOS {
        source.rate_ratio = ratio;
        let found = scan_on_raster(source, settings);
        let likely_hz = source.sample_rate_hz();
        source.rate_ratio = 1.0;
        match found {
            Ok(found) if has_message(&found) => {
                return Ok(Some(ChannelFault::SampleRate {
                    specified_hz,
                    likely_hz,
                }));
            }
            // A rate that cannot be received is not the true one.
            Ok(_) | Err(ScanError::FrontEnd { .. }) => {}
            Err(error) => return Err(error),
        }
    }
    Ok(None)
}

/// Frequencies of the SSBs in an earlier segment of the same centre frequency.
struct KnownPlaces {
    segment: Segment,
    exchanged: bool,
    /// Frequency of the SSB's centre (Hz), and its subcarrier spacing.
    places: Vec<(f64, SubcarrierSpacing)>,
}

impl KnownPlaces {
    /// Returns the frequencies of a scan; `None` without SSBs, or if the centre frequency is unknown.
    fn of(scan: &Scan, segment: Segment, exchanged: bool, settings: &ScanSettings) -> Option<Self> {
        let mut places: Vec<(f64, SubcarrierSpacing)> = Vec::new();
        for ssb in &scan.ssbs {
            let place = (ssb.ssb_freq_hz, ssb.spacing);
            if !places.contains(&place) {
                places.push(place);
            }
        }
        let centre_hz = settings.centre_frequency_hz.or(segment.centre_frequency_hz);
        let is_absolute = centre_hz.is_some_and(|it| it > 0.0) || settings.ssb_freq_hz.is_some();
        (is_absolute && !places.is_empty()).then_some(Self {
            segment,
            exchanged,
            places,
        })
    }

    /// Searches another segment at these frequencies.
    fn scan(
        &self,
        source: &mut SegmentSource<'_>,
        settings: &ScanSettings,
    ) -> Result<Scan, ScanError> {
        source.exchanged = self.exchanged;
        let mut found = Scan::default();
        for (ssb_freq_hz, spacing) in &self.places {
            let settings = ScanSettings {
                ssb_freq_hz: Some(*ssb_freq_hz),
                spacing: Some(*spacing),
                cfo_ppm: settings.cfo_ppm.filter(|_| settings.ssb_freq_hz.is_some()),
                ..settings.clone()
            };
            let mut part = scan(source, &settings)?;
            found.ssbs.append(&mut part.ssbs);
            found.searched.append(&mut part.searched);
            found.faults.append(&mut part.faults);
        }
        found
            .ssbs
            .sort_by(|a, b| a.sample_start.total_cmp(&b.sample_start));
        Ok(found)
    }
}

/// Whether the PBCH of any SSB was decoded.
fn has_message(scan: &Scan) -> bool {
    scan.ssbs.iter().any(|it| it.ssb.payload.is_some())
}

/// Samples of one segment.
struct SegmentSource<'a> {
    recording: &'a mut Recording,
    segment: Segment,
    /// Whether I and Q are exchanged.
    exchanged: bool,
    /// Factor on the specified sample rate.
    rate_ratio: f64,
}

impl IqSource for SegmentSource<'_> {
    fn name(&self) -> String {
        self.recording.data_file().display().to_string()
    }

    fn channels(&self) -> usize {
        self.recording.channels()
    }

    fn length(&self) -> u64 {
        let rate_hz = self.sample_rate_hz();
        let length = self.segment.length;
        if (length as f64) < SHORTEST_S * rate_hz {
            return length;
        }
        length.max((EXTENDED_S * rate_hz) as u64)
    }

    fn sample_rate_hz(&self) -> f64 {
        self.rate_ratio * self.recording.sample_rate_hz()
    }

    fn centre_frequency_hz(&self) -> Option<f64> {
        self.segment.centre_frequency_hz
    }

    fn read(
        &mut self,
        start: u64,
        count: usize,
        antennas: &mut Vec<Vec<Complex32>>,
    ) -> Result<(), RecordingError> {
        let end = start.saturating_add(count as u64);
        let from = start.min(self.segment.length);
        let held = (end.min(self.segment.length) - from) as usize;
        self.recording
            .read(self.segment.start + from, held, antennas)?;
        for samples in antennas {
            samples.resize(count, Complex32::ZERO);
            if self.exchanged {
                for sample in samples {
                    *sample = Complex32::new(sample.im, sample.re);
                }
            }
        }
        Ok(())
    }
}
