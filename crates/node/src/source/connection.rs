//! Byte streams from any address, reopened when they end.

use std::fs::File;
use std::io::{self, ErrorKind, Read};
use std::net::{TcpListener, TcpStream, ToSocketAddrs, UdpSocket};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::Path;
use std::time::Duration;

use crate::address::Address;
use crate::inbox::{Inbox, Input, Level};

/// Interval at which a reader checks whether the node is stopping.
const LOOK: Duration = Duration::from_millis(200);
/// Interval between connection attempts.
const RETRY: Duration = Duration::from_millis(300);
/// Maximum number of bytes per read.
const CHUNK: usize = 1 << 18;

/// Event of a stream.
pub enum Event<'a> {
    /// The stream begins or restarts.
    Begin,
    /// Received bytes.
    Bytes(&'a [u8]),
}

/// Reads an address until the node stops, or until a file or standard input ends, and calls `take`
/// for each event.
pub fn read(
    address: &Address,
    source: &'static str,
    inbox: &Inbox,
    mut take: impl FnMut(Event<'_>),
) {
    let remark = |text: String| inbox.put(Input::warning(source, text));
    let mut last_text = String::new();
    let mut opener = Opener::default();
    while !inbox.is_closed() {
        match opener.open(address) {
            Ok(Some(mut stream)) => {
                if !last_text.is_empty() {
                    let (level, text) = (Level::Info, format!("{address}: connected"));
                    inbox.put(Input::Remark {
                        level,
                        source,
                        text,
                    });
                    last_text.clear();
                }
                take(Event::Begin);
                let ended = drain(&mut *stream, inbox, &mut take);
                let text = match ended {
                    Ok(()) => format!("{address}: ended"),
                    Err(error) => format!("{address}: {error}"),
                };
                let is_over = matches!(address, Address::Standard | Address::File(_));
                if is_over || inbox.is_closed() {
                    break;
                }
                remark(text.clone());
                last_text = text;
            }
            Ok(None) => {} // no client has connected yet
            Err(error) => {
                let text = format!("{address}: {error}");
                if text != last_text {
                    remark(text.clone());
                    last_text = text;
                }
                if matches!(address, Address::File(_)) {
                    break;
                }
            }
        }
        std::thread::sleep(RETRY);
    }
}

fn drain(stream: &mut dyn Read, inbox: &Inbox, take: &mut impl FnMut(Event<'_>)) -> io::Result<()> {
    let mut bytes = vec![0; CHUNK];
    while !inbox.is_closed() {
        match stream.read(&mut bytes) {
            Ok(0) => break,
            Ok(count) => take(Event::Bytes(bytes.get(..count).unwrap_or_default())),
            Err(error) if is_idle(&error) => {}
            Err(error) => return Err(error),
        }
    }
    Ok(())
}

/// Whether the error only means that no data arrived.
pub fn is_idle(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted
    )
}

/// Opens connections and keeps listening sockets.
#[derive(Default)]
struct Opener {
    tcp: Option<TcpListener>,
    unix: Option<UnixListener>,
}

impl Opener {
    /// Opens the stream; `None` if no client has connected yet.
    fn open(&mut self, address: &Address) -> io::Result<Option<Box<dyn Read>>> {
        Ok(Some(match address {
            Address::Standard => Box::new(io::stdin()),
            Address::File(path) => Box::new(File::open(path)?),
            Address::Tcp(socket) => Box::new(connect(socket)?),
            Address::TcpListen(socket) => {
                let listener = self
                    .tcp
                    .take()
                    .map_or_else(|| TcpListener::bind(socket), Ok)?;
                listener.set_nonblocking(true)?;
                let accepted = listener.accept();
                self.tcp = Some(listener);
                match accepted {
                    Ok((stream, _)) => Box::new(timed(stream)?),
                    Err(error) if is_idle(&error) => return Ok(None),
                    Err(error) => return Err(error),
                }
            }
            Address::Udp(socket) => {
                let socket = UdpSocket::bind(socket)?;
                socket.set_read_timeout(Some(LOOK))?;
                Box::new(Datagrams(socket))
            }
            Address::Unix(path) => Box::new(timed_unix(UnixStream::connect(path)?)?),
            Address::UnixListen(path) => {
                let listener = self.unix.take().map_or_else(|| listen_at(path), Ok)?;
                listener.set_nonblocking(true)?;
                let accepted = listener.accept();
                self.unix = Some(listener);
                match accepted {
                    Ok((stream, _)) => Box::new(timed_unix(stream)?),
                    Err(error) if is_idle(&error) => return Ok(None),
                    Err(error) => return Err(error),
                }
            }
        }))
    }
}

/// Listens at a path. A socket file without a listener is removed because it is from an earlier
/// run.
fn listen_at(path: &Path) -> io::Result<UnixListener> {
    use std::os::unix::fs::FileTypeExt;
    let is_socket = path
        .symlink_metadata()
        .is_ok_and(|it| it.file_type().is_socket());
    if is_socket && UnixStream::connect(path).is_err() {
        std::fs::remove_file(path)?;
    }
    UnixListener::bind(path)
}

/// Connects with a timeout of two seconds.
pub fn connect(socket: &str) -> io::Result<TcpStream> {
    let mut last = io::Error::new(ErrorKind::NotFound, "no such host");
    for address in socket.to_socket_addrs()? {
        match TcpStream::connect_timeout(&address, Duration::from_secs(2)) {
            Ok(stream) => return timed(stream),
            Err(error) => last = error,
        }
    }
    Err(last)
}

fn timed(stream: TcpStream) -> io::Result<TcpStream> {
    stream.set_nonblocking(false)?;
    stream.set_read_timeout(Some(LOOK))?;
    stream.set_write_timeout(Some(LOOK))?;
    stream.set_nodelay(true)?;
    Ok(stream)
}

fn timed_unix(stream: UnixStream) -> io::Result<UnixStream> {
    stream.set_nonblocking(false)?;
    stream.set_read_timeout(Some(LOOK))?;
    Ok(stream)
}

/// Stream of datagrams; each contains one or more lines, with or without a final newline.
struct Datagrams(UdpSocket);

impl Read for Datagrams {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        let room = bytes.len().saturating_sub(1);
        let count = self.0.recv(bytes.get_mut(..room).unwrap_or_default())?;
        if let Some(end) = bytes.get_mut(count) {
            *end = b'\n';
        }
        Ok(count + 1)
    }
}
