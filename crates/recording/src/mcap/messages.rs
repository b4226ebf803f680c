//! The records of an MCAP file that carry odometry.

use std::collections::{HashMap, HashSet};
use std::io::{BufReader, ErrorKind, Read};
use std::path::Path;

use mcap::records::op;
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};

use super::schema::ODOMETRY;
use crate::error::RecordingError;
use crate::file as files;

/// Bytes of the longest record that is read; chunks are customarily below 10 MB.
const LONGEST_RECORD: usize = 1 << 28;
/// Of a message record, between channel and data: sequence number and two times.
const SEQUENCE_AND_TIMES_BYTES: usize = 4 + 8 + 8;

/// Hands every CDR message of type `nav_msgs/msg/Odometry` to `take`, with its topic, in the order
/// of the file.
///
/// # Errors
/// [`RecordingError`] when the file is no MCAP, or is cut off or damaged.
pub fn each_odometry_message(
    file: &Path,
    mut take: impl FnMut(&str, &[u8]),
) -> Result<(), RecordingError> {
    let syntax = |message: String| RecordingError::Syntax {
        file: file.display().to_string(),
        format: "MCAP",
        message,
    };
    let opened = files::open(file).map_err(|source| RecordingError::io(file, source))?;
    let mut source = BufReader::new(opened);
    // A damaged length must not be taken for the memory to set aside.
    let options = LinearReaderOptions::default().with_record_length_limit(LONGEST_RECORD);
    let mut reader = LinearReader::new_with_options(options);
    let mut channels = Channels::default();
    while let Some(event) = reader.next_event() {
        match event.map_err(|error| syntax(error.to_string()))? {
            LinearReadEvent::ReadRequest(need) => match source.read(reader.insert(need)) {
                Ok(read) => reader.notify_read(read),
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return Err(RecordingError::io(file, error)),
            },
            LinearReadEvent::Record { opcode, data } => channels
                .record(opcode, data, &mut take)
                .ok_or_else(|| syntax(format!("a record of type {opcode} is damaged")))?,
        }
    }
    Ok(())
}

/// What the file has said of its channels so far.
#[derive(Default)]
struct Channels {
    /// Schemas of odometry.
    schemas: HashSet<u16>,
    /// Topic of each channel that carries odometry in CDR; `None` for the others.
    topics: HashMap<u16, Option<String>>,
}

impl Channels {
    /// `None` where the record is shorter than it says, or of a channel that was not announced.
    /// The crate's own parser sets aside what a damaged string says its length is, up to 4 GiB.
    fn record(
        &mut self,
        opcode: u8,
        mut body: &[u8],
        take: &mut impl FnMut(&str, &[u8]),
    ) -> Option<()> {
        match opcode {
            op::SCHEMA => {
                let id = u16(&mut body)?;
                if string(&mut body)? == ODOMETRY.name.as_bytes() {
                    self.schemas.insert(id);
                }
            }
            op::CHANNEL => {
                let (id, schema) = (u16(&mut body)?, u16(&mut body)?);
                let topic = String::from_utf8(string(&mut body)?.to_vec()).ok()?;
                let is_odometry = string(&mut body)? == b"cdr" && self.schemas.contains(&schema);
                self.topics.insert(id, is_odometry.then_some(topic));
            }
            op::MESSAGE => {
                let channel = u16(&mut body)?;
                let (_, data) = body.split_at_checked(SEQUENCE_AND_TIMES_BYTES)?;
                if let Some(topic) = self.topics.get(&channel)? {
                    take(topic, data);
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

/// A string with its length before it.
fn string<'a>(body: &mut &'a [u8]) -> Option<&'a [u8]> {
    let (length, rest) = body.split_first_chunk()?;
    let (text, rest) = rest.split_at_checked(u32::from_le_bytes(*length) as usize)?;
    *body = rest;
    Some(text)
}
