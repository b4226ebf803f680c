//! Newline JSON to standard output, a file, a FIFO or network clients.

use std::io::{self, ErrorKind, Write};
use std::net::{TcpListener, TcpStream, UdpSocket};

use anyhow::{Context, Result, bail};

use super::file::GrowingFile;
use super::message::Message;
use super::output::Sink;
use super::record::Record;
use crate::address::Address;
use crate::settings::JsonOutput;

/// Maximum number of TCP clients.
const MAX_CLIENTS: usize = 16;
/// Maximum number of bytes that wait for a TCP client. A client that does not read is disconnected.
const MAX_WAITING_BYTES: usize = 1 << 18;

/// Destination of the lines.
enum Destination {
    /// Standard output, with lines that have not been written yet.
    Standard(Vec<u8>),
    File(GrowingFile),
    Clients(TcpListener, Vec<Client>),
    Datagrams(UdpSocket, String),
}

struct Client {
    stream: TcpStream,
    waiting: Vec<u8>,
}

/// Newline JSON.
pub struct Json {
    address: Address,
    destination: Option<Destination>,
    period_s: f64,
    last_pose_s: f64,
    line: Vec<u8>,
}

impl Json {
    /// Creates the output from the settings; nothing is opened.
    pub fn new(settings: &JsonOutput) -> Self {
        Self {
            address: settings.address.clone(),
            destination: None,
            period_s: 1.0 / settings.rate_hz,
            last_pose_s: f64::NEG_INFINITY,
            line: Vec::new(),
        }
    }

    fn connect(&self) -> Result<Destination> {
        Ok(match &self.address {
            Address::Standard => Destination::Standard(Vec::new()),
            Address::File(path) => Destination::File(GrowingFile::create(path)?),
            Address::TcpListen(socket) => {
                let listener = TcpListener::bind(socket)?;
                listener.set_nonblocking(true)?;
                Destination::Clients(listener, Vec::new())
            }
            Address::Udp(socket) => {
                let any = if socket.starts_with('[') {
                    "[::]:0"
                } else {
                    "0.0.0.0:0"
                };
                let from = UdpSocket::bind(any)?;
                from.set_nonblocking(true)?;
                Destination::Datagrams(from, socket.clone())
            }
            _ => bail!("it must be `-`, tcp-listen://, udp:// or a path"),
        })
    }

    fn named(&self) -> String {
        format!("output.json.address {}", self.address)
    }

    /// Whether a pose is omitted because the configured rate is lower than that of the odometry.
    fn is_left_out(&mut self, record: &Record) -> bool {
        let Record::Pose(pose) = record else {
            return false;
        };
        let time_s = pose.status.time_s;
        // One percent less than a period, because odometry has jitter.
        let next_s = self.last_pose_s + 0.99 * self.period_s;
        if time_s > self.last_pose_s && time_s < next_s {
            return true;
        }
        self.last_pose_s = time_s;
        false
    }
}

impl Sink for Json {
    fn open(&mut self) -> Result<bool> {
        if let Some(Destination::File(file)) = &mut self.destination
            && file.repair()
        {
            return Ok(false);
        }
        // A FIFO is closed first, so that lines that its last reader did not read are discarded.
        self.destination = None;
        let destination = self.connect().with_context(|| self.named())?;
        let destination = self.destination.insert(destination);
        Ok(matches!(
            destination,
            Destination::Clients(..) | Destination::Datagrams(..)
        ))
    }

    fn take(&mut self, record: &Record) -> Result<bool> {
        if self.is_left_out(record) {
            return Ok(false);
        }
        self.line.clear();
        serde_json::to_writer(&mut self.line, &Message::from(record))?;
        self.line.push(b'\n');
        let line = &self.line;
        let done = match &mut self.destination {
            None => Ok(()),
            Some(Destination::Standard(lines)) => {
                lines.extend_from_slice(line);
                Ok(())
            }
            Some(Destination::File(file)) => file.write_all(line),
            Some(Destination::Datagrams(socket, to)) => send(socket, to, line),
            Some(Destination::Clients(listener, clients)) => {
                while clients.len() < MAX_CLIENTS
                    && let Ok((stream, _)) = listener.accept()
                {
                    if stream.set_nonblocking(true).is_ok() {
                        let waiting = Vec::new();
                        clients.push(Client { stream, waiting });
                    }
                }
                clients.retain_mut(|client| client.send(line));
                Ok(())
            }
        };
        done.with_context(|| self.named())?;
        Ok(true)
    }

    fn flush(&mut self) -> Result<bool> {
        match &mut self.destination {
            Some(Destination::Standard(lines)) => {
                let mut standard = io::stdout().lock();
                let done = standard.write_all(lines).and_then(|()| standard.flush());
                lines.clear();
                done.context("standard output")?;
            }
            Some(Destination::File(file)) => {
                let done = file.flush();
                done.with_context(|| format!("output.json.address {}", self.address))?;
                file.check_exists()?;
            }
            _ => {}
        }
        Ok(true)
    }

    fn abandon(&mut self) {
        let is_repaired = match &mut self.destination {
            Some(Destination::File(file)) => file.repair(),
            _ => false,
        };
        if !is_repaired {
            self.destination = None;
        }
    }

    fn close(&mut self) -> Result<()> {
        self.flush().map(drop)
    }
}

/// Sends a datagram. A receiver need not exist, and a full socket buffer loses the datagram.
fn send(socket: &UdpSocket, to: &str, line: &[u8]) -> io::Result<()> {
    match socket.send_to(line, to) {
        Err(error)
            if !matches!(
                error.kind(),
                ErrorKind::ConnectionRefused | ErrorKind::WouldBlock | ErrorKind::Interrupted
            ) =>
        {
            Err(error)
        }
        _ => Ok(()),
    }
}

impl Client {
    /// Sends what can be sent at once; returns `false` if the client has disconnected or is too slow.
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
                    return self.waiting.len() <= MAX_WAITING_BYTES;
                }
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(_) => return false,
            }
        }
    }
}
