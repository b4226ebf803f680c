//! Requesting side of ZMTP 3.0, ZeroMQ's protocol (rfc.zeromq.org/spec/23), without security.
//!
//! This implementation limits memory: the existing Rust libraries allocate the length that a frame
//! announces.

use std::io::{self, BufRead, ErrorKind, Read, Write};

/// Maximum length of a frame in bytes: 4 million complex floats.
pub const LONGEST: usize = 32 << 20;

/// Number of bytes that are allocated at once for a frame.
const CHUNK: usize = 1 << 16;
/// Maximum number of read timeouts within a frame.
const MAX_READ_TIMEOUTS: u32 = 10;

const MORE: u8 = 1;
const LONG: u8 = 2;
const COMMAND: u8 = 4;
const READY: &[u8] = b"\x05READY\x0bSocket-Type\0\0\0\x03REQ\x08Identity\0\0\0\0";

/// Exchanges greetings with the peer, which must be a REP socket.
///
/// # Errors
/// Errors of the stream; [`ErrorKind::InvalidData`] for another kind of peer.
pub fn greet(stream: &mut (impl Read + Write)) -> io::Result<()> {
    let mut greeting = [0_u8; 64];
    for (place, bytes) in [(0, &b"\xff"[..]), (9, b"\x7f\x03\0"), (12, b"NULL")] {
        if let Some(into) = greeting.get_mut(place..place + bytes.len()) {
            into.copy_from_slice(bytes);
        }
    }
    stream.write_all(&greeting)?;
    let mut greeting = [0_u8; 64];
    read_exact(stream, &mut greeting)?;
    let [
        0xff,
        _,
        _,
        _,
        _,
        _,
        _,
        _,
        _,
        0x7f,
        version,
        _,
        mechanism @ ..,
    ] = &greeting
    else {
        return Err(invalid("the peer is not ZeroMQ"));
    };
    if *version < 3 {
        return Err(invalid("the peer is ZeroMQ of a version before 3"));
    }
    if !mechanism.starts_with(b"NULL\0") {
        return Err(invalid("the transmitter requires a security mechanism"));
    }
    stream.write_all(&[COMMAND, READY.len() as u8])?;
    stream.write_all(READY)?;
    let mut answer = Vec::new();
    let Header { flags, length } = read_header(stream)?;
    read_body(stream, length, &mut answer)?;
    if flags & COMMAND == 0 || !answer.starts_with(b"\x05READY") {
        return Err(invalid("the transmitter refuses the connection"));
    }
    let answers = |kind: &[u8]| answer.windows(kind.len()).any(|it| it == kind);
    if !answers(b"\0\0\0\x03REP") && !answers(b"\0\0\0\x06ROUTER") {
        return Err(invalid("the transmitter's socket is not of the type REP"));
    }
    Ok(())
}

/// Sends `times` requests for samples.
///
/// # Errors
/// Errors of the stream.
pub fn request(stream: &mut impl Write, times: usize) -> io::Result<()> {
    // The empty frame before the request, and the request of one byte.
    stream.write_all(&[MORE, 0, 0, 1, 0xff].repeat(times))
}

/// Appends the answer of a request. If `is_wanted` returns false for its length, the answer is
/// dropped. Returns the number of dropped bytes.
///
/// # Errors
/// Errors of the stream; [`ErrorKind::InvalidData`] for an invalid answer.
pub fn answer(
    peer: &mut impl BufRead,
    into: &mut Vec<u8>,
    is_wanted: impl Fn(usize) -> bool,
) -> io::Result<usize> {
    let before = into.len();
    let mut in_body = false;
    loop {
        let Header { flags, length } = read_header(peer)?;
        if flags & COMMAND != 0 {
            pass_over(peer, length)?; // commands do not concern the answer
            continue;
        }
        if !in_body && length != 0 {
            return Err(invalid("an answer must begin with an empty frame"));
        }
        let is_last = flags & MORE == 0;
        if is_last && in_body && into.len() == before && !is_wanted(length) {
            pass_over(peer, length)?;
            return Ok(length);
        }
        read_body(peer, length, into)?;
        let is_body = std::mem::replace(&mut in_body, true);
        if is_last {
            if !is_body {
                return Err(invalid("the answer has no samples"));
            }
            return Ok(0);
        }
        if into.len() - before > LONGEST {
            return Err(invalid("the answer does not end"));
        }
    }
}

/// Header of a frame.
struct Header {
    flags: u8,
    length: usize,
}

/// Reads the header of a frame.
///
/// # Errors
/// Errors of the stream; [`ErrorKind::InvalidData`] for a frame that is too long or of an unknown
/// kind.
fn read_header(stream: &mut impl Read) -> io::Result<Header> {
    let mut flags = [0];
    read_exact(stream, &mut flags)?;
    let [flags] = flags;
    if flags & !(MORE | LONG | COMMAND) != 0 || flags & (MORE | COMMAND) == MORE | COMMAND {
        return Err(invalid("not a frame of ZeroMQ"));
    }
    let length = if flags & LONG == 0 {
        let mut length = [0];
        read_exact(stream, &mut length)?;
        u64::from(length[0])
    } else {
        let mut length = [0; 8];
        read_exact(stream, &mut length)?;
        u64::from_be_bytes(length)
    };
    let length = usize::try_from(length).ok().filter(|it| *it <= LONGEST);
    let length = length.ok_or_else(|| invalid("the frame is longer than 32 MiB"))?;
    Ok(Header { flags, length })
}

/// Appends `length` bytes. Memory is allocated in steps as the bytes arrive.
fn read_body(stream: &mut impl Read, length: usize, into: &mut Vec<u8>) -> io::Result<()> {
    piece_by_piece(length, |missing| {
        let start = into.len();
        into.resize(start + missing, 0);
        let read = stream.read(into.get_mut(start..).unwrap_or_default());
        into.truncate(start + read.as_ref().map_or(0, |count| *count));
        read
    })
}

fn pass_over(peer: &mut impl BufRead, length: usize) -> io::Result<()> {
    piece_by_piece(length, |missing| {
        let came = peer.fill_buf()?.len().min(missing);
        peer.consume(came);
        Ok(came)
    })
}

/// Calls `next` with the number of missing bytes, at most [`CHUNK`], until all bytes are read.
/// Within a frame, read timeouts are tolerated.
fn piece_by_piece(
    length: usize,
    mut next: impl FnMut(usize) -> io::Result<usize>,
) -> io::Result<()> {
    let mut missing = length;
    let mut idle = 0;
    while missing > 0 {
        match next(missing.min(CHUNK)) {
            Ok(0) => return Err(ErrorKind::UnexpectedEof.into()),
            Ok(count) => (missing, idle) = (missing.saturating_sub(count), 0),
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            Err(error) if super::connection::is_idle(&error) && idle < MAX_READ_TIMEOUTS => {
                idle += 1;
            }
            Err(error) => return Err(error),
        }
    }
    Ok(())
}

/// Fills the buffer. A timeout before the first byte is returned to the caller; a timeout within a
/// frame is tolerated.
fn read_exact(stream: &mut impl Read, mut into: &mut [u8]) -> io::Result<()> {
    let whole = into.len();
    let mut idle = 0;
    while !into.is_empty() {
        match stream.read(into) {
            Ok(0) => return Err(ErrorKind::UnexpectedEof.into()),
            Ok(count) => into = into.get_mut(count..).unwrap_or_default(),
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            Err(error)
                if super::connection::is_idle(&error)
                    && into.len() < whole
                    && idle < MAX_READ_TIMEOUTS =>
            {
                idle += 1;
            }
            Err(error) => return Err(error),
        }
    }
    Ok(())
}

fn invalid(why: &str) -> io::Error {
    io::Error::new(ErrorKind::InvalidData, why)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Peer that sends these bytes and ignores its input.
    struct Peer<'a>(&'a [u8]);

    impl Read for Peer<'_> {
        fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
            self.0.read(bytes)
        }
    }

    impl BufRead for Peer<'_> {
        fn fill_buf(&mut self) -> io::Result<&[u8]> {
            Ok(self.0)
        }

        fn consume(&mut self, count: usize) {
            self.0 = &self.0[count..];
        }
    }

    impl Write for Peer<'_> {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            Ok(bytes.len())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn answers_of_one_frame_or_several_are_read() {
        let mut samples = Vec::new();
        let long = [&[LONG, 0, 0, 0, 0, 0, 0, 1, 0][..], &[7; 256]].concat();
        let bytes = [&[MORE, 0][..], &long, &[MORE, 0, MORE, 2, 1, 2, 0, 1, 3]].concat();
        let mut peer = Peer(&bytes);
        assert_eq!(answer(&mut peer, &mut samples, |_| true).unwrap(), 0);
        assert_eq!(samples, [7; 256]);
        assert_eq!(answer(&mut peer, &mut samples, |_| true).unwrap(), 0);
        assert_eq!(samples[256..], [1, 2, 3]);
        assert!(answer(&mut peer, &mut samples, |_| true).is_err());
        // A single frame can be dropped; of several frames, the first are not the whole answer.
        let mut peer = Peer(&bytes);
        samples.clear();
        assert_eq!(
            answer(&mut peer, &mut samples, |it| it != 256).unwrap(),
            256
        );
        assert_eq!(answer(&mut peer, &mut samples, |_| false).unwrap(), 0);
        assert_eq!(samples, [1, 2, 3]);
        assert!(peer.0.is_empty());
    }

    #[test]
    fn invalid_answers_are_rejected_before_memory_is_allocated() {
        let endless = [&[MORE, 0, LONG][..], &u64::MAX.to_be_bytes()].concat();
        let cut = [
            &[MORE, 0, LONG][..],
            &(LONGEST as u64).to_be_bytes(),
            &[0; 10],
        ]
        .concat();
        for bytes in [
            &endless[..],
            &cut,
            &[0, 3, 1, 2, 3],
            &[0, 0],
            &[0x80, 0],
            &[MORE, 0],
        ] {
            let mut samples = Vec::new();
            assert!(
                answer(&mut Peer(bytes), &mut samples, |_| true).is_err(),
                "{bytes:?}"
            );
            assert!(samples.capacity() <= 2 << 16);
            assert!(
                answer(&mut Peer(bytes), &mut samples, |_| false).is_err(),
                "{bytes:?}"
            );
        }
    }

    #[test]
    fn a_peer_without_greeting_or_answer_is_rejected() {
        let mut greeting = [0; 64];
        greeting[0] = 0xff;
        greeting[9..12].copy_from_slice(&[0x7f, 3, 1]);
        greeting[12..16].copy_from_slice(b"NULL");
        let ready = |kind: &[u8]| {
            let mut body = b"\x05READY\x0bSocket-Type\0\0\0".to_vec();
            body.push(kind.len() as u8);
            body.extend(kind);
            [&greeting[..], &[COMMAND, body.len() as u8], &body].concat()
        };
        assert!(greet(&mut Peer(&ready(b"REP"))).is_ok());
        for reply in [
            ready(b"PUB"),
            b"HTTP/1.1 200 OK\r\n".to_vec().repeat(8),
            greeting.to_vec(),
        ] {
            assert!(greet(&mut Peer(&reply)).is_err());
        }
    }
}
