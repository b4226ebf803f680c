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
const HEADER: usize = 64;

/// One channel's transmitter.
struct Channel {
    /// Buffered for the few bytes before a frame's samples, which are longer and are read past the buffer.
    stream: BufReader<TcpStream>,
    /// Samples that the other channels have not reached yet.
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
        // Transmitters send in order: when the last has come the others are there, and need no waiting.
        for (channel, endpoint) in channels.iter_mut().zip(endpoints).rev() {
            match channel.fill(framing.sample_bytes(), inbox) {
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
    zmtp::request(&mut stream)?;
    Ok(Channel {
        stream: BufReader::with_capacity(HEADER, stream),
        pending: Vec::new(),
    })
}

impl Channel {
    /// Waits for an answer, if this channel has no whole sample; the next one is asked for at once.
    fn fill(&mut self, sample_bytes: usize, inbox: &Inbox) -> io::Result<()> {
        while self.pending.len() < sample_bytes && !inbox.is_closed() {
            match zmtp::answer(&mut self.stream, &mut self.pending) {
                Ok(_) => zmtp::request(self.stream.get_mut())?,
                Err(error) if is_idle(&error) => {}
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }
}

/// Hands on the samples that every channel has.
fn hand_on(channels: &mut [Channel], framing: &mut Framing) {
    let stride = framing.sample_bytes();
    let frames = |channel: &Channel| channel.pending.len() / stride;
    let count = channels.iter().map(frames).min().unwrap_or(0);
    let views: Vec<View<'_>> = (channels.iter())
        .map(|channel| View {
            bytes: &channel.pending,
            stride,
        })
        .collect();
    framing.take(&views, count);
    for channel in channels {
        channel.pending.drain(..count * stride);
    }
}
