//! Samples by ZeroMQ, a socket for each channel, aligned by counting.

use std::io::{self, BufReader};
use std::net::TcpStream;
use std::time::Duration;

use super::connection::{connect, is_idle};
use super::framing::{Framing, View};
use super::zmtp;
use crate::address::Address;
use crate::inbox::{Inbox, Input};

const RETRY: Duration = Duration::from_millis(300);
/// Bytes read at once: some answers of a millisecond.
const CHUNK: usize = 1 << 18;
/// Requests that a transmitter has not answered yet, at most: it goes on while nothing is read.
const AHEAD: usize = 16;
/// So many are answered before as many are sent, all at once.
const AT_ONCE: usize = 4;
/// Nothing is read for so long at most, for the node may end.
const LONGEST_REST: Duration = Duration::from_millis(50);

/// One channel's transmitter.
struct Channel {
    stream: BufReader<TcpStream>,
    /// Answers since requests were last sent.
    answered: usize,
    /// Bytes of the last answer.
    last: usize,
    /// Bytes of samples that were passed over, and what came after them, as far as the other channels have not
    /// reached it yet.
    passed: usize,
    pending: Vec<u8>,
}

/// Requests samples until the node ends; where one transmitter vanishes, all begin anew.
pub fn run(endpoints: &[Address], mut framing: Framing, inbox: &Inbox) {
    let mut said = String::new();
    while !inbox.is_closed() {
        framing.restart();
        let (error, received) = session(endpoints, &mut framing, inbox);
        let text = error.to_string();
        if received || text != said {
            inbox.put(Input::warning("samples", text.clone()));
            said = text;
        }
        std::thread::sleep(RETRY);
    }
}

/// From connecting to whatever ends it, and whether samples came.
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
        // Transmitters send in order: when the last has come the others are there, and need no waiting.
        for (channel, endpoint) in channels.iter_mut().zip(endpoints).rev() {
            match channel.fill(framing, inbox) {
                Ok(()) => received = true,
                Err(error) => return (named(endpoint, &error), received),
            }
        }
        hand_on(&mut channels, framing);
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

/// Waits as long as nobody waits for what comes and there are requests to answer: reading each answer as it comes
/// takes more than all else that is done with it. The answer that ends a window is waited for at its socket.
fn rest(channels: &[Channel], framing: &Framing) {
    let answer = channels.iter().map(|it| it.last).min().unwrap_or(0);
    let unhurried = framing.unhurried() * framing.sample_bytes();
    let rest_s = framing.duration_s(unhurried.saturating_sub(answer).min(AT_ONCE * answer));
    let rest = Duration::try_from_secs_f64(rest_s).unwrap_or_default();
    std::thread::sleep(rest.min(LONGEST_REST));
}

impl Channel {
    /// Waits for an answer, if this channel has no whole sample, and takes those that have come with it.
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

    /// Takes an answer; one of samples that are not wanted is passed over.
    fn take(&mut self, framing: &Framing) -> io::Result<()> {
        let sample_bytes = framing.sample_bytes();
        // What is passed over stands before all that is kept, in whole samples.
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

    /// Bytes that the other channels have not reached yet.
    const fn length(&self) -> usize {
        self.passed + self.pending.len()
    }

    /// Forgets bytes that all channels have reached.
    fn forget(&mut self, count: usize) {
        let of_passed = count.min(self.passed);
        self.passed -= of_passed;
        self.pending.drain(..count - of_passed);
    }
}

/// Hands on the samples that every channel has; those that one of them has passed over are of none.
fn hand_on(channels: &mut [Channel], framing: &mut Framing) {
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
    fn what_one_channel_has_passed_over_is_of_none_and_the_channels_stay_aligned() {
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
        hand_on(&mut channels, &mut framing);
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
