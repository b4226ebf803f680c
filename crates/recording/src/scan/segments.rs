//! Scan of a recording by segments, each with its own centre frequency.

use num_complex::Complex32;

use super::diagnosis::ChannelFault;
use super::error::ScanError;
use super::iq_source::IqSource;
use super::scanner::{Scan, ScanSettings, scan};
use crate::error::RecordingError;
use crate::sigmf::{Recording, Segment, check_centre_hz};

/// Minimum duration of a searched segment (s): the SSB with the widest subcarriers, 240 kHz.
const SHORTEST_S: f64 = 17e-6;
/// Duration to which shorter segments are extended by zeros (s), because the search requires more
/// than one SSB of any spacing.
const EXTENDED_S: f64 = 1e-3;

/// Finds every SSB of a recording in order of time, at the centre frequency of its capture. If no
/// PBCH is decoded, the search is repeated with I and Q exchanged.
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
        if segments.len() > 1 {
            let allowed = format!(
                "it cannot replace the {} different core:frequency of the captures",
                segments.len()
            );
            return Err(wrong(allowed).into());
        }
    }
    let mut found = Scan::default();
    for segment in segments {
        let mut source = SegmentSource {
            recording: &mut *recording,
            segment,
            exchanged: false,
        };
        let mut part = scan(&mut source, settings)?;
        if !has_message(&part) {
            source.exchanged = true;
            let exchanged = scan(&mut source, settings)?;
            if has_message(&exchanged) {
                part.ssbs = exchanged.ssbs;
                part.faults.push(ChannelFault::IqExchanged);
            }
        }
        for ssb in &mut part.ssbs {
            ssb.sample_start += segment.start as f64;
        }
        found.ssbs.append(&mut part.ssbs);
        found.searched.append(&mut part.searched);
        for fault in part.faults {
            if !found.faults.contains(&fault) {
                found.faults.push(fault);
            }
        }
    }
    Ok(found)
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
        self.recording.sample_rate_hz()
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
