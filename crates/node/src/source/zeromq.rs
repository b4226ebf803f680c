//! Samples from ZeroMQ, with one socket per channel, aligned by counting.

use std::io::{self, BufReader};
use std::net::TcpStream;
use std::time::Duration;

use super::connection::{connect, is_idle};
use super::framing::{Framing, View};
use super::zmtp;
use crate::address::Address;
use crate::inbox::{Inbox, Input};

const RETRY: Duration = Duration::from_millis(300);
/// Maximum number of bytes per read: several answers of one millisecond.
const CHUNK: usize = 1 << 18;
/// Maximum number of unanswered requests; the transmitter continues while nothing is read.
const AHEAD: usize = 16;
/// Number of answers after which new requests are sent together.
const AT_ONCE: usize = 4;
/// Maximum time without reading, so that the node can stop.
const LONGEST_REST: Duration = Duration::from_millis(50);

/// Transmitter of one channel.
struct Channel {
    stream: BufReader<TcpStream>,
    /// Number of answers since the last requests.
    answered: usize,
    /// Size of the last answer in bytes.
    last: usize,
    /// Number of dropped sample bytes that the other channels have not reached yet.
    passed: usize,
    /// Received bytes after the dropped ones that the other channels have not reached yet.
    pending: Vec<u8>,
}

/// Requests samples until the node stops; if one transmitter fails, all connections are reopened.
pub fn run(endpoints: &[Address], mut framing: Framing, inbox: &Inbox) {
    let mut last_text = String::new();
    while !inbox.is_closed() {
        framing.restart();
        let (error, received) = session(endpoints, &mut framing, inbox);
        let text = error.to_string();
        if received || text != last_text {
            inbox.put(Input::warning("samples", text.clone()));
            last_text = text;
        }
        std::thread::sleep(RETRY);
    }
}

/// Runs the connections until an error. Returns the error and whether samples were received.
fn session(endpoints: &[Address], framing: &mut Framing, inbox: &Inbox) -> (io::Error, bool) {
    let mut channels = Vec::with_capacity(endpoints.len());
    for endpoint in endpoints {
        match open(endpoint) {
            Ok(channel) => channels.push(channel),
            Err(error) => return (named(endpoint, &error), false),
        }
    }
    let mut received = false;
    while !inbox.is_closed() {
        rest(&channels, framing);
        // Transmitters send in order: after the answer of the last one, the others do not block.
        for (channel, endpoint) in channels.iter_mut().zip(endpoints).rev() {
            match channel.fill(framing, inbox) {
                Ok(()) => received = true,
                Err(error) => return (named(endpoint, &error), received),
            }
        }
        forward_samples(&mut channels, framing);
    }
    (io::ErrorKind::Interrupted.into(), received)
}

fn named(endpoint: &Address, error: &io::Error) -> io::Error {
    io::Error::new(error.kind(), format!("{endpoint}: {error}"))
}

fn open(endpoint: &Address) -> io::Result<Channel> {
    let Address::Tcp(socket) = endpoint else {
        return Err(io::ErrorKind::Unsupported.into());
    };
    let mut stream = connect(socket)?;
    zmtp::greet(&mut stream)?;
    zmtp::request(&mut stream, AHEAD)?;
    Ok(Channel {
        stream: BufReader::with_capacity(CHUNK, stream),
        answered: 0,
        last: 0,
        passed: 0,
        pending: Vec::new(),
    })
}

/// Pauses while no sample is needed immediately and requests are pending, because reading each
/// answer on arrival takes most of the computing time. The answer that ends a window is read
/// without a pause.
fn rest(channels: &[Channel], framing: &Framing) {
    let answer = channels.iter().map(|it| it.last).min().unwrap_or(0);
    let deferrable = framing.deferrable() * framing.sample_bytes();
    let rest_s = framing.duration_s(deferrable.saturating_sub(answer).min(AT_ONCE * answer));
    let rest = Duration::try_from_secs_f64(rest_s).unwrap_or_default();
    std::thread::sleep(rest.min(LONGEST_REST));
}

impl Channel {
    /// Waits for an answer if the channel has no complete sample, and reads all available answers.
    fn fill(&mut self, framing: &Framing, inbox: &Inbox) -> io::Result<()> {
        while self.length() < framing.sample_bytes() && !inbox.is_closed() {
            self.take(framing)?;
        }
        for _ in 1..AHEAD {
            if self.stream.buffer().is_empty() {
                break;
            }
            self.take(framing)?;
        }
        if self.answered >= AT_ONCE {
            zmtp::request(self.stream.get_mut(), std::mem::take(&mut self.answered))?;
        }
        Ok(())
    }

    /// Reads an answer; an answer with samples that are not required is dropped.
    fn take(&mut self, framing: &Framing) -> io::Result<()> {
        let sample_bytes = framing.sample_bytes();
        // Dropped samples precede all stored ones and are complete.
        let unwanted = match self.pending.len() {
            0 => (sample_bytes * framing.unwanted()).saturating_sub(self.passed),
            _ => 0,
        };
        let is_wanted = |length: usize| length > unwanted || !length.is_multiple_of(sample_bytes);
        let before = self.length();
        match zmtp::answer(&mut self.stream, &mut self.pending, is_wanted) {
            Ok(passed) => {
                self.passed += passed;
                self.last = self.length() - before;
                self.answered += 1;
                Ok(())
            }
            Err(error) if is_idle(&error) => Ok(()),
            Err(error) => Err(error),
        }
    }

    /// Returns the number of bytes that the other channels have not reached yet.
    const fn length(&self) -> usize {
        self.passed + self.pending.len()
    }

    /// Removes bytes that all channels have reached.
    fn forget(&mut self, count: usize) {
        let of_passed = count.min(self.passed);
        self.passed -= of_passed;
        self.pending.drain(..count - of_passed);
    }
}

/// Delivers the samples that every channel has. Samples that one channel has dropped are dropped
/// for all.
fn forward_samples(channels: &mut [Channel], framing: &mut Framing) {
    let stride = framing.sample_bytes();
    loop {
        let whole = channels.iter().map(Channel::length).min().unwrap_or(0) / stride * stride;
        let passed = channels.iter().map(|it| it.passed).filter(|it| *it > 0);
        let passed = passed.min().map(|passed| passed.min(whole));
        let count = passed.unwrap_or(whole);
        if count == 0 {
            return;
        }
        if passed.is_some() {
            framing.pass_over(count / stride);
        } else {
            let views: Vec<View<'_>> = (channels.iter())
                .map(|channel| View {
                    bytes: &channel.pending,
                    stride,
                })
                .collect();
            framing.take(&views, count / stride);
        }
        for channel in &mut *channels {
            channel.forget(count);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::net::TcpListener;
    use std::sync::Arc;

    use super::*;
    use crate::settings::{Clock, SampleFormat, Stream};
    use crate::statistics::SourceHealth;

    #[test]
    fn samples_dropped_in_one_channel_are_dropped_in_all_and_channels_stay_aligned() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let channel = |passed: usize, pending: Vec<u8>| {
            let stream = TcpStream::connect(listener.local_addr().unwrap()).unwrap();
            Channel {
                stream: BufReader::new(stream),
                answered: 0,
                last: 0,
                passed,
                pending,
            }
        };
        // Samples of two bytes; both channels begin at sample 0.
        let samples = |range: std::ops::Range<u8>| range.flat_map(|it| [it, 0]).collect();
        let mut channels = [
            channel(2 * 5, samples(5..12)),
            channel(2 * 2, samples(2..10)),
        ];
        let stream = Stream {
            rate_msps: 1.0,
            centre_mhz: 3500.0,
            antennas: vec![0, 1],
            clock: Clock::StartTimeS(0.0),
        };
        let inbox = Arc::new(Inbox::default());
        let health = Arc::new(SourceHealth::new("samples"));
        let format = SampleFormat::Ci8;
        let mut framing = Framing::new(&stream, format, Arc::default(), Arc::clone(&inbox), health);
        forward_samples(&mut channels, &mut framing);
        let mut blocks = Vec::new();
        while let Some((_, input)) = inbox.take(Duration::ZERO) {
            if let Input::Samples(block) = input {
                blocks.push(block);
            }
        }
        let [block] = &blocks[..] else {
            panic!("{} blocks", blocks.len());
        };
        assert!((block.time_s - 5e-6).abs() < 1e-12);
        let parts = |antenna: usize| block.antennas[antenna].iter().map(|it| it.re * 128.0);
        for antenna in [0, 1] {
            assert!(parts(antenna).eq([5.0, 6.0, 7.0, 8.0, 9.0]));
        }
        assert_eq!(channels.each_ref().map(Channel::length), [2 * 2, 0]);
    }
}
