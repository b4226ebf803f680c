//! Reception of a recording block by block. If the recorder was off between the bursts, the
//! recording has one capture per segment with its position in time in `core:global_index` or
//! `core:datetime`.

use nr_ssb::receiver::ReceiverError;
use num_complex::Complex32;
use onboard::live::{LiveError, SampleStream, StreamConfig};
use onboard::observation::SsbObservation;
use onboard::receive::{ReceiveError, ReceiverConfig};

use super::error::ReplayError;
use crate::sigmf::Recording;

/// Duration of samples that are read at once in seconds.
const BLOCK_S: f64 = 0.02;

/// Missing samples that the recording does not report, detected from the times of the SSBs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InferredGap {
    /// Time of the first SSB after the gap in seconds; this and all later times are corrected.
    pub before_s: f64,
    /// Duration of the gap in seconds, modulo the SSB period.
    pub lost_s: f64,
}

/// Receives a whole recording and calls `take` with the SSBs of each burst in order of time.
/// Returns the gaps that the recording does not report.
///
/// # Errors
/// [`ReplayError`] if the recording cannot be read or is incompatible with the receiver; errors of
/// `take`.
pub fn receive_recording(
    config: ReceiverConfig,
    recording: &mut Recording,
    start_time_s: f64,
    mut take: impl FnMut(&[SsbObservation]) -> Result<(), ReplayError>,
) -> Result<Vec<InferredGap>, ReplayError> {
    let file = recording.data_file().display().to_string();
    let failed = |error| match error {
        LiveError::Receive(ReceiveError::Ssb(ReceiverError::FrontEnd(source))) => {
            ReplayError::FrontEnd {
                file: file.clone(),
                source,
            }
        }
        LiveError::Receive(source) => ReplayError::Receive {
            file: file.clone(),
            source,
        },
        other => ReplayError::Custom(other.into()),
    };
    let elements = usize::from(config.array.elements);
    let found = recording.channels();
    if found != elements {
        let error = ReceiveError::Antennas { found, elements };
        return Err(failed(error.into()));
    }
    recording.check_drive()?;
    let rate_hz = recording.sample_rate_hz();
    // Without a centre frequency in the recording, the receiver is assumed to be tuned to the SSB.
    let centre_hz = recording.centre_frequency_hz();
    let centre_hz = centre_hz.unwrap_or(config.ssb_freq_hz);
    let stream = StreamConfig { rate_hz, centre_hz };
    let mut stream = SampleStream::new(stream, config).map_err(&failed)?;
    let block = ((BLOCK_S * rate_hz) as u64).max(1);
    let mut raw = Vec::new();
    let (mut gaps, mut unreported_gap_s) = (Vec::new(), 0.0);
    let mut pass_bursts = |stream: &mut SampleStream| {
        loop {
            let burst = stream.burst();
            let number = burst.len();
            let Some(before_s) = burst.first().map(|first| first.ssb.time_s) else {
                break;
            };
            take(burst)?;
            stream.forget(number);
            let lost_s = stream.counts().unreported_gap_s - unreported_gap_s;
            if lost_s > 0.0 {
                gaps.push(InferredGap { before_s, lost_s });
                unreported_gap_s += lost_s;
            }
        }
        Ok::<(), ReplayError>(())
    };
    for segment in recording.segments() {
        let (mut at, end) = (segment.start, segment.start + segment.length);
        while at < end {
            let count = block.min(end - at);
            recording.read(at, count as usize, &mut raw)?;
            let sample = segment.number_of(at);
            let antennas: Vec<&[Complex32]> = raw.iter().map(Vec::as_slice).collect();
            let time_s = start_time_s + sample as f64 / rate_hz;
            stream.push(time_s, &antennas).map_err(&failed)?;
            at += count;
            pass_bursts(&mut stream)?;
        }
    }
    stream.break_off().map_err(&failed)?;
    pass_bursts(&mut stream)?;
    Ok(gaps)
}
