//! Radio with a SoapySDR driver, switched off between the bursts if it has a clock.

use std::sync::Arc;
use std::thread;
use std::time::Duration;

use num_complex::Complex32;
use soapysdr::{Device, Direction, Error, ErrorCode, RxStream};

use super::framing::Framing;
use crate::clock::{ArrivalClock, unix_s};
use crate::gate::RxWindow;
use crate::inbox::{Inbox, Input};
use crate::settings::Radio;

/// Time that a radio needs to start in seconds; it is switched off only for longer pauses.
const BEGINS_S: f64 = 0.03;
const TIMEOUT_US: i64 = 200_000;
const RETRY: Duration = Duration::from_secs(1);

/// Receives until the node stops; a radio that fails is opened again.
pub fn run(radio: &Radio, mut framing: Framing, gate: &Arc<RxWindow>, inbox: &Inbox) {
    let mut last_text = String::new();
    while !inbox.is_closed() {
        if let Err(error) = session(radio, &mut framing, gate, inbox) {
            let text = format!("samples.device is {:?}: {error}", radio.device);
            if text != last_text {
                inbox.put(Input::warning("samples", text.clone()));
                last_text = text;
            }
            thread::sleep(RETRY);
        }
    }
}

fn open(radio: &Radio) -> Result<RxStream<Complex32>, Error> {
    let device = Device::new(radio.device.as_str())?;
    let channels: Vec<usize> = (0..radio.stream.antennas.len()).collect();
    for &channel in &channels {
        let direction = Direction::Rx;
        device.set_sample_rate(direction, channel, radio.stream.rate_msps * 1e6)?;
        device.set_frequency(direction, channel, radio.stream.centre_mhz * 1e6, ())?;
        if let Some(gain_db) = radio.gain_db {
            device.set_gain(direction, channel, gain_db)?;
        }
    }
    device.rx_stream(&channels)
}

fn session(
    radio: &Radio,
    framing: &mut Framing,
    gate: &Arc<RxWindow>,
    inbox: &Inbox,
) -> Result<(), Error> {
    let mut stream = open(radio)?;
    let length = stream.mtu()?.clamp(1, 1 << 15);
    let rate_hz = radio.stream.rate_msps * 1e6;
    let mut buffers = vec![vec![Complex32::ZERO; length]; radio.stream.antennas.len()];
    // Offset of the radio's clock, and a sample counter for a radio without a clock.
    let (mut zero_s, mut counted) = (None, ArrivalClock::new(rate_hz));
    stream.activate(None)?;
    while !inbox.is_closed() {
        let mut into: Vec<&mut [Complex32]> = buffers.iter_mut().map(Vec::as_mut_slice).collect();
        let count = match stream.read(&mut into, TIMEOUT_US) {
            Ok(count) => count,
            // After lost samples or a timeout, the next samples have a new time stamp.
            Err(error) if matches!(error.code, ErrorCode::Overflow | ErrorCode::Timeout) => {
                continue;
            }
            Err(error) => return Err(error),
        };
        let stream_s = stream.time_ns() as f64 * 1e-9;
        let now_s = unix_s();
        let time_s = if stream_s > 0.0 {
            stream_s + *zero_s.get_or_insert(now_s - count as f64 / rate_hz - stream_s)
        } else {
            counted.block(count, now_s).0
        };
        let samples: Vec<&[Complex32]> = buffers
            .iter()
            .map(|it| it.get(..count).unwrap_or_default())
            .collect();
        framing.take_samples(&samples, time_s);
        let end_s = time_s + count as f64 / rate_hz;
        // Without the radio's clock, the sample count would be lost.
        if let (Some([from_s, _]), true) = (gate.wanted(), zero_s.is_some())
            && from_s - end_s > 2.0 * BEGINS_S
        {
            stream.deactivate(None)?;
            let off_s = from_s - end_s - BEGINS_S;
            let off = Duration::try_from_secs_f64(off_s).unwrap_or_default();
            framing.rests(off);
            thread::sleep(off);
            stream.activate(None)?;
        }
    }
    Ok(())
}
