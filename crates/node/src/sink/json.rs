//! Newline JSON to standard output, a file or whoever listens.

use std::io::{self, ErrorKind, Write};
use std::net::{TcpListener, TcpStream, UdpSocket};

use anyhow::{Context, Result, bail};

use super::file::create;
use super::record::Record;
use crate::address::Address;
use crate::settings::JsonOutput;

/// Listeners at once.
const MOST_CLIENTS: usize = 16;
/// Bytes that wait for a listener that does not read before it is let go.
const MOST_WAITING: usize = 1 << 18;

/// Where the lines go.
enum Way {
    Write(Box<dyn Write + Send>),
    Clients(TcpListener, Vec<Client>),
    Datagrams(UdpSocket, String),
}

struct Client {
    stream: TcpStream,
    waiting: Vec<u8>,
}

/// Newline JSON.
pub struct Json {
    way: Way,
    period_s: f64,
    last_pose_s: f64,
    line: Vec<u8>,
}

impl Json {
    /// Opens the way.
    ///
    /// # Errors
    /// Those of file or socket, with its name.
    pub fn new(settings: &JsonOutput) -> Result<Self> {
        let named = || format!("output.json.address: {}", settings.address);
        let way = match &settings.address {
            Address::Standard => Way::Write(Box::new(io::stdout())),
            Address::File(path) => Way::Write(Box::new(create(path)?)),
            Address::TcpListen(socket) => {
                let listener = TcpListener::bind(socket).with_context(named)?;
                listener.set_nonblocking(true).with_context(named)?;
                Way::Clients(listener, Vec::new())
            }
            Address::Udp(socket) => {
                let any = if socket.starts_with('[') {
                    "[::]:0"
                } else {
                    "0.0.0.0:0"
                };
                let from = UdpSocket::bind(any).with_context(named)?;
                from.set_nonblocking(true).with_context(named)?;
                Way::Datagrams(from, socket.clone())
            }
            _ => bail!(
                "{}: it must be `-`, tcp-listen://, udp:// or a path",
                named()
            ),
        };
        Ok(Self {
            way,
            period_s: 1.0 / settings.rate_hz,
            last_pose_s: f64::NEG_INFINITY,
            line: Vec::new(),
        })
    }

    /// Writes a record as a line.
    pub fn take(&mut self, record: &Record) -> Result<()> {
        if let Record::Pose(pose) = record {
            let time_s = pose.status.time_s;
            // A period less the odometry's own jitter.
            if (self.last_pose_s..self.last_pose_s + 0.99 * self.period_s).contains(&time_s)
                && time_s > self.last_pose_s
            {
                return Ok(());
            }
            self.last_pose_s = time_s;
        }
        self.line.clear();
        serde_json::to_writer(&mut self.line, &record.to_json())?;
        self.line.push(b'\n');
        match &mut self.way {
            Way::Write(writer) => writer.write_all(&self.line)?,
            Way::Datagrams(socket, to) => {
                // Nobody need be there.
                let _ = socket.send_to(&self.line, to.as_str());
            }
            Way::Clients(listener, clients) => {
                while clients.len() < MOST_CLIENTS
                    && let Ok((stream, _)) = listener.accept()
                {
                    if stream.set_nonblocking(true).is_ok() {
                        let waiting = Vec::new();
                        clients.push(Client { stream, waiting });
                    }
                }
                let line = &self.line;
                clients.retain_mut(|client| client.send(line));
            }
        }
        Ok(())
    }

    /// Sends all that waits.
    pub fn flush(&mut self) -> Result<()> {
        if let Way::Write(writer) = &mut self.way {
            writer.flush()?;
        }
        Ok(())
    }
}

impl Client {
    /// Sends what can be sent at once; `false` where the listener is gone, or too slow.
    fn send(&mut self, line: &[u8]) -> bool {
        self.waiting.extend_from_slice(line);
        loop {
            match self.stream.write(&self.waiting) {
                Ok(0) => return false,
                Ok(count) => {
                    self.waiting.drain(..count);
                    if self.waiting.is_empty() {
                        return true;
                    }
                }
                Err(error) if error.kind() == ErrorKind::WouldBlock => {
                    return self.waiting.len() <= MOST_WAITING;
                }
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(_) => return false,
            }
        }
    }
}
