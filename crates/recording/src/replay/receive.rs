//! A recording through the receiver, block by block. A recording that was switched off between the
//! bursts has a capture for each stretch, with its place in time in `core:global_index`.

use nr_ssb::front_end::FrontEnd;
use num_complex::Complex32;
use onboard::observation::SsbObservation;
use onboard::receive::{ReceiveError, Receiver, SSB_SAMPLES, Window};

use super::error::ReplayError;
use crate::sigmf::{Capture, Recording};

/// Samples of the recording read at once: 20 ms.
const BLOCK_S: f64 = 0.02;

/// A stretch of samples without a gap.
struct Stretch {
    /// First and last-plus-one sample in the file.
    from: u64,
    to: u64,
    /// Number of its first sample since the receiver began to count.
    global_index: u64,
}

/// Receives a whole recording and hands the SSBs to `take`, in order of time, those of a block at
/// once.
///
/// # Errors
/// [`ReplayError`] when the recording cannot be read or does not suit the receiver, and whatever
/// `take` fails with.
pub fn receive_recording(
    receiver: &mut Receiver,
    recording: &mut Recording,
    start_time_s: f64,
    mut take: impl FnMut(&[SsbObservation]) -> Result<(), ReplayError>,
) -> Result<(), ReplayError> {
    let file = recording.data_file().display().to_string();
    let receive_failed = |source| ReplayError::Receive {
        file: file.clone(),
        source,
    };
    let elements = usize::from(receiver.config().array.elements);
    let found = recording.channels();
    if found != elements {
        return Err(receive_failed(ReceiveError::Antennas { found, elements }));
    }
    let front_end_failed = |source| ReplayError::FrontEnd {
        file: file.clone(),
        source,
    };
    let rate_hz = recording.sample_rate_hz();
    let spacing = receiver.config().spacing;
    let ssb_freq_hz = receiver.config().ssb_freq_hz;
    // Where the recording does not say, the SSB was tuned to.
    let centre_hz = recording.centre_frequency_hz().unwrap_or(ssb_freq_hz);
    let mut front_end = FrontEnd::new(rate_hz, ssb_freq_hz - centre_hz, spacing.hz(), elements)
        .map_err(front_end_failed)?;
    let ratio = front_end.input_per_output();
    let block = ((BLOCK_S * rate_hz) as u64).max(1);
    let mut raw = Vec::new();
    let mut observations: Vec<SsbObservation> = Vec::new();
    for stretch in stretches(recording) {
        let mut base: Vec<Vec<Complex32>> = vec![Vec::new(); elements];
        let mut base_start = (stretch.global_index as f64 / ratio).round() as u64;
        let mut at = stretch.from;
        while at < stretch.to {
            let count = block.min(stretch.to - at);
            recording.read(at, count as usize, &mut raw)?;
            at += count;
            front_end.push(&raw, &mut base).map_err(front_end_failed)?;
            if at == stretch.to {
                front_end.finish(&mut base);
            }
            let antennas: Vec<&[Complex32]> = base.iter().map(Vec::as_slice).collect();
            let window = Window {
                start: base_start,
                time_s: start_time_s + base_start as f64 / spacing.base_rate_hz(),
                antennas: &antennas,
            };
            observations.clear();
            receiver
                .receive(&window, |observation| {
                    observations.push(observation.clone());
                })
                .map_err(receive_failed)?;
            observations.sort_by(|a, b| a.ssb.time_s.total_cmp(&b.ssb.time_s));
            take(&observations)?;
            let length = base.first().map_or(0, Vec::len);
            let gone = length.saturating_sub(2 * SSB_SAMPLES);
            for samples in &mut base {
                samples.drain(..gone);
            }
            base_start += gone as u64;
        }
    }
    Ok(())
}

fn stretches(recording: &Recording) -> Vec<Stretch> {
    let captures = &recording.metadata().captures;
    let global_index = |capture: &Capture| {
        let stated = capture.other.get("core:global_index");
        stated
            .and_then(serde_json::Value::as_u64)
            .unwrap_or(capture.sample_start)
    };
    let mut stretches: Vec<Stretch> = Vec::new();
    for capture in captures {
        let global_index = global_index(capture);
        if let Some(last) = stretches.last_mut() {
            last.to = capture.sample_start;
            // A capture that goes on where the last one ended is no gap.
            if global_index == last.global_index + (last.to - last.from) {
                last.to = recording.length();
                continue;
            }
        }
        let (from, to) = (capture.sample_start, recording.length());
        stretches.push(Stretch {
            from,
            to,
            global_index,
        });
    }
    if stretches.is_empty() {
        stretches.push(Stretch {
            from: 0,
            to: recording.length(),
            global_index: 0,
        });
    }
    stretches
}
