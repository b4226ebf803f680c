//! Inputs of the node from sockets and files: newline JSON, frames of ZeroMQ, samples, settings, addresses.
//!
//! Byte 0: kind of input. The remaining bytes are the input.

use std::sync::Arc;
use std::time::Duration;

use access_av_node::address::Address;
use access_av_node::inbox::{Inbox, Input};
use access_av_node::settings::{Clock, NodeSettings, SampleFormat, Stream};
use access_av_node::source::{Framing, Lines, answer, greet, parse};
use access_av_node::statistics::SourceHealth;
use onboard::settings::{Shipped, TomlFile};

/// A peer that sends these bytes, whatever it receives.
struct Peer<'a>(&'a [u8]);

impl std::io::Read for Peer<'_> {
    fn read(&mut self, bytes: &mut [u8]) -> std::io::Result<usize> {
        self.0.read(bytes)
    }
}

impl std::io::BufRead for Peer<'_> {
    fn fill_buf(&mut self) -> std::io::Result<&[u8]> {
        Ok(self.0)
    }

    fn consume(&mut self, count: usize) {
        self.0 = self.0.get(count..).unwrap_or_default();
    }
}

impl std::io::Write for Peer<'_> {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

pub fn run(data: &[u8]) {
    let [what, rest @ ..] = data else {
        return;
    };
    match what % 5 {
        0 => {
            let mut lines = Lines::default();
            let take = |line: Option<&[u8]>| {
                if let Some(Ok(Some(Input::Odometry(sample)))) = line.map(parse) {
                    // An absent distance is NaN; all other values are finite.
                    assert!(sample.time_s.is_finite() && sample.speed_mps.is_finite());
                }
            };
            let (first, second) = rest.split_at(rest.len() / 2);
            lines.push(first, take);
            lines.push(second, take);
            lines.finish(take);
        }
        1 => {
            let mut peer = Peer(rest);
            let _ = greet(&mut peer);
            let mut samples = Vec::new();
            // An answer of an even number of bytes is skipped.
            let is_wanted = |length: usize| length % 2 == 1;
            while answer(&mut peer, &mut samples, is_wanted).is_ok() {}
            // Memory is allocated for the received bytes, not for the announced length.
            assert!(samples.capacity() <= 4 * (rest.len() + (1 << 16)));
        }
        2 => {
            let [format, antennas, bytes @ ..] = rest else {
                return;
            };
            let formats = [SampleFormat::Cf32, SampleFormat::Ci16, SampleFormat::Ci8];
            let stream = Stream {
                rate_msps: 3.84,
                centre_mhz: 3500.0,
                antennas: (0..=antennas % 16).collect(),
                clock: Clock::StartTimeS(0.0),
            };
            let inbox = Arc::<Inbox>::default();
            let health = Arc::new(SourceHealth::new("samples"));
            let format = formats[usize::from(format % 3)];
            let mut framing =
                Framing::new(&stream, format, Arc::default(), Arc::clone(&inbox), health);
            bytes
                .chunks(97)
                .for_each(|bytes| framing.interleaved(bytes));
            while let Some((_, input)) = inbox.take(Duration::ZERO) {
                if let Input::Samples(block) = input {
                    let mut samples = block.antennas.iter().flatten();
                    assert!(samples.all(|it| it.re.is_finite() && it.im.is_finite()));
                }
            }
        }
        3 => {
            if let Ok(text) = std::str::from_utf8(rest) {
                let _ = NodeSettings::from_toml(text, "node.toml", &Shipped);
            }
        }
        _ => {
            if let Ok(text) = std::str::from_utf8(rest)
                && let Ok(address) = text.parse::<Address>()
            {
                assert_eq!(address.to_string().parse(), Ok(address));
            }
        }
    }
}
