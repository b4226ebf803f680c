//! Reader of the messages of an MCAP file with odometry, IMU or angles.

use std::collections::HashMap;
use std::io::{BufReader, ErrorKind, Read};
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
    let syntax = |message: String| RecordingError::Syntax {
        file: file.display().to_string(),
        format: "MCAP",
        message,
    };
    let opened = files::open(file).map_err(|source| RecordingError::io(file, source))?;
    let mut source = BufReader::new(opened);
    // The limit prevents a huge allocation for a damaged length.
    let options = LinearReaderOptions::default().with_record_length_limit(LONGEST_RECORD);
    let mut reader = LinearReader::new_with_options(options);
    let mut has_records = false;
    while let Some(event) = reader.next_event() {
        let event = match event {
            Ok(event) => event,
            Err(McapError::UnexpectedEof) if has_records => return Ok(FileEnd::Truncated),
            Err(error) => {
                let message = format!("{error}; `mcap recover` keeps the undamaged part");
                return Err(syntax(message));
            }
        };
        match event {
            LinearReadEvent::ReadRequest(need) => match source.read(reader.insert(need)) {
                Ok(read) => reader.notify_read(read),
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return Err(RecordingError::io(file, error)),
            },
            LinearReadEvent::Record { opcode, data } => {
                has_records = true;
                let taken = take(opcode, data)
                    .ok_or_else(|| syntax(format!("a record of type {opcode} is damaged")))?;
                if taken.is_break() {
                    break;
                }
            }
        }
    }
    Ok(FileEnd::Complete)
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
