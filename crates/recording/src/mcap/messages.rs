//! Reader of the messages of an MCAP file with odometry, IMU or angles.

use std::collections::HashMap;
use std::io::{self, BufReader, ErrorKind, Read};
use std::ops::ControlFlow;
use std::path::Path;

use mcap::McapError;
use mcap::records::op;
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};

use super::schema::{ODOMETRY, VERDICT};
use crate::error::RecordingError;
use crate::file as files;

/// Maximum length of a record in bytes; chunks are usually below 10 MB.
const LONGEST_RECORD: usize = 1 << 28;
/// Length of the sequence number of a message record in bytes, between channel and times.
const SEQUENCE_BYTES: usize = 4;
/// Length of the two times of a message record in bytes.
const TIMES_BYTES: usize = 8 + 8;
/// Length of the fields of a chunk record before its compression in bytes: two times, size and CRC.
const CHUNK_TIMES_SIZE_CRC_BYTES: usize = 8 + 8 + 8 + 4;

/// Type of a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// `nav_msgs/msg/Odometry`.
    Odometry,
    /// `sensor_msgs/msg/Imu`.
    Imu,
    /// `access_av_msgs/msg/AngleVerdict`.
    Verdict,
}

/// End of an MCAP file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FileEnd {
    /// The file was closed.
    Complete,
    /// The file ends without a footer: its writer was killed, or lost power or disk space.
    Truncated,
}

/// Description of a truncated file, for remarks.
pub const TRUNCATED: &str = "the file was not closed; it is read up to its last complete chunk";

/// Calls `take` for every CDR message of a [`Kind`] with its topic and the recorder's time (ns), in
/// the order of the file. An unclosed file is read up to its last complete chunk.
///
/// # Errors
/// [`RecordingError`] if the file is not MCAP, or is damaged before its end.
pub fn each_message(
    file: &Path,
    mut take: impl FnMut(Kind, &str, u64, &[u8]),
) -> Result<FileEnd, RecordingError> {
    let mut channels = Channels::default();
    each_record(file, |opcode, data| {
        channels.record(opcode, data, &mut take)?;
        Some(ControlFlow::Continue(()))
    })
}

/// Returns the recorder's time of the first message of a file in nanoseconds; `None` for a file
/// without messages.
///
/// # Errors
/// Errors of [`each_message`].
pub fn first_time_ns(file: &Path) -> Result<Option<u64>, RecordingError> {
    let mut time_ns = None;
    each_record(file, |opcode, body| {
        if opcode != op::MESSAGE {
            return Some(ControlFlow::Continue(()));
        }
        let (_, times) = body.split_at_checked(size_of::<u16>() + SEQUENCE_BYTES)?;
        time_ns = Some(u64::from_le_bytes(*times.first_chunk()?));
        Some(ControlFlow::Break(()))
    })?;
    Ok(time_ns)
}

/// Calls `take` for each record until it breaks; `take` returns `None` for a damaged record.
fn each_record(
    file: &Path,
    mut take: impl FnMut(u8, &[u8]) -> Option<ControlFlow<()>>,
) -> Result<FileEnd, RecordingError> {
    let opened = files::open(file).map_err(|source| RecordingError::io(file, source))?;
    // The crate `mcap` subtracts with overflow if a record is longer than its uncompressed chunk.
    let options = LinearReaderOptions::default().with_emit_chunks(true);
    let mut has_records = false;
    let mut take = |opcode, body: &[u8]| take(opcode, body).ok_or(Failure::Record(opcode));
    let read = each_event(options, BufReader::new(opened), |opcode, body| {
        has_records = true;
        if opcode == op::CHUNK {
            each_chunk_record(body, &mut take)
        } else {
            take(opcode, body)
        }
    });
    let message = match read {
        Ok(_) => return Ok(FileEnd::Complete),
        Err(Failure::File(McapError::UnexpectedEof)) if has_records => {
            return Ok(FileEnd::Truncated);
        }
        Err(Failure::Io(source)) => return Err(RecordingError::io(file, source)),
        Err(Failure::File(error)) => format!("{error}; `mcap recover` keeps the undamaged part"),
        Err(Failure::Chunk(error)) => {
            format!("in a chunk: {error}; `mcap recover` keeps the undamaged part")
        }
        Err(Failure::Record(opcode)) => format!("a record of type {opcode} is damaged"),
    };
    Err(RecordingError::Syntax {
        file: file.display().to_string(),
        format: "MCAP",
        message,
    })
}

/// Reason why a file is not read to its end.
enum Failure {
    /// The file cannot be read.
    Io(io::Error),
    /// The sequence of records of the file is damaged or ends early.
    File(McapError),
    /// The sequence of records of a chunk is damaged.
    Chunk(McapError),
    /// The body of a record of this type is damaged.
    Record(u8),
}

/// Calls `take` for each record of an MCAP stream until it breaks.
fn each_event(
    options: LinearReaderOptions,
    mut source: impl Read,
    mut take: impl FnMut(u8, &[u8]) -> Result<ControlFlow<()>, Failure>,
) -> Result<ControlFlow<()>, Failure> {
    // The limit prevents a huge allocation for a damaged length.
    let options = options.with_record_length_limit(LONGEST_RECORD);
    let mut reader = LinearReader::new_with_options(options);
    while let Some(event) = reader.next_event() {
        match event.map_err(Failure::File)? {
            LinearReadEvent::ReadRequest(need) => match source.read(reader.insert(need)) {
                Ok(read) => reader.notify_read(read),
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return Err(Failure::Io(error)),
            },
            LinearReadEvent::Record { opcode, data } => {
                if take(opcode, data)?.is_break() {
                    return Ok(ControlFlow::Break(()));
                }
            }
        }
    }
    Ok(ControlFlow::Continue(()))
}

/// Calls `take` for each record of a chunk until it breaks.
fn each_chunk_record(
    chunk: &[u8],
    mut take: impl FnMut(u8, &[u8]) -> Result<ControlFlow<()>, Failure>,
) -> Result<ControlFlow<()>, Failure> {
    if let Some(records) = uncompressed(chunk) {
        let mut rest = records;
        while !rest.is_empty() {
            let (opcode, body) = record(&mut rest).ok_or(Failure::Record(op::CHUNK))?;
            if take(opcode, body)?.is_break() {
                return Ok(ControlFlow::Break(()));
            }
        }
        return Ok(ControlFlow::Continue(()));
    }
    let options = LinearReaderOptions::default()
        .with_skip_start_magic(true)
        .with_skip_end_magic(true);
    let length = (chunk.len() as u64).to_le_bytes();
    let stream = [op::CHUNK].as_slice().chain(length.as_slice()).chain(chunk);
    each_event(options, stream, take).map_err(|failure| match failure {
        Failure::File(error) => Failure::Chunk(error),
        other => other,
    })
}

/// Returns the records of a chunk without compression; `None` if it is compressed or damaged.
fn uncompressed(mut chunk: &[u8]) -> Option<&[u8]> {
    (_, chunk) = chunk.split_at_checked(CHUNK_TIMES_SIZE_CRC_BYTES)?;
    let compression = string(&mut chunk)?;
    let (length, records) = chunk.split_first_chunk()?;
    let records = records.get(..usize::try_from(u64::from_le_bytes(*length)).ok()?)?;
    compression.is_empty().then_some(records)
}

/// Splits off the first record: its type and its body.
fn record<'a>(records: &mut &'a [u8]) -> Option<(u8, &'a [u8])> {
    let (&opcode, rest) = records.split_first()?;
    let (length, rest) = rest.split_first_chunk()?;
    let length = usize::try_from(u64::from_le_bytes(*length)).ok()?;
    let (body, rest) = rest.split_at_checked(length)?;
    *records = rest;
    Some((opcode, body))
}

/// Schemas and channels up to the current position in the file.
#[derive(Default)]
struct Channels {
    /// Known schemas.
    schemas: HashMap<u16, Kind>,
    /// Kind and topic of each channel with a known schema in CDR; `None` for other channels.
    topics: HashMap<u16, Option<(Kind, String)>>,
}

impl Channels {
    /// Processes a record. Returns `None` if the record is shorter than its lengths, or belongs to
    /// an unknown channel. The parser of the crate `mcap` would allocate up to 4 GiB for a damaged
    /// string length.
    fn record(
        &mut self,
        opcode: u8,
        mut body: &[u8],
        take: &mut impl FnMut(Kind, &str, u64, &[u8]),
    ) -> Option<()> {
        match opcode {
            op::SCHEMA => {
                let id = u16(&mut body)?;
                let name = string(&mut body)?;
                if name == ODOMETRY.name.as_bytes() {
                    self.schemas.insert(id, Kind::Odometry);
                } else if name == b"sensor_msgs/msg/Imu" {
                    self.schemas.insert(id, Kind::Imu);
                } else if name == VERDICT.name.as_bytes() {
                    self.schemas.insert(id, Kind::Verdict);
                }
            }
            op::CHANNEL => {
                let (id, schema) = (u16(&mut body)?, u16(&mut body)?);
                let topic = String::from_utf8(string(&mut body)?.to_vec()).ok()?;
                let is_cdr = string(&mut body)? == b"cdr";
                let kind = self.schemas.get(&schema).filter(|_| is_cdr);
                self.topics.insert(id, kind.map(|kind| (*kind, topic)));
            }
            op::MESSAGE => {
                let channel = u16(&mut body)?;
                let (_, times) = body.split_at_checked(SEQUENCE_BYTES)?;
                let (_, data) = times.split_at_checked(TIMES_BYTES)?;
                let recorded_ns = u64::from_le_bytes(*times.first_chunk()?);
                if let Some((kind, topic)) = self.topics.get(&channel)? {
                    take(*kind, topic, recorded_ns, data);
                }
            }
            _ => {}
        }
        Some(())
    }
}

fn u16(body: &mut &[u8]) -> Option<u16> {
    let (number, rest) = body.split_first_chunk()?;
    *body = rest;
    Some(u16::from_le_bytes(*number))
}

/// Reads a string with a length prefix.
fn string<'a>(body: &mut &'a [u8]) -> Option<&'a [u8]> {
    let (length, rest) = body.split_first_chunk()?;
    let (text, rest) = rest.split_at_checked(u32::from_le_bytes(*length) as usize)?;
    *body = rest;
    Some(text)
}
