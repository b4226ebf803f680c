//! SigMF recordings: IQ samples in `NAME.sigmf-data`, interleaved across channels, and metadata in
//! `NAME.sigmf-meta` (JSON). <https://sigmf.org>
//!
//! The datatypes `cf32_le` and `ci16_le` are supported. Samples are read in blocks, so that a
//! recording may be larger than the memory. Keys of extensions (`nr:ssb`, `aoa:truth`) remain JSON.
//!
//! ```no_run
//! use recording::Recording;
//! let mut recording = Recording::open("drive.sigmf-meta")?;
//! let mut antennas = Vec::new();
//! recording.read(0, 1024, &mut antennas)?;
//! assert_eq!(antennas.len(), recording.channels());
//! # Ok::<(), recording::RecordingError>(())
//! ```

mod archive;
mod checksum;
pub(crate) mod date;
mod frequency;
mod metadata;
mod reader;
mod sample_format;
mod samples;
mod segment;
mod timeline;
mod writer;

pub use frequency::check_centre_hz;
pub use metadata::{Annotation, Capture, Global, Metadata};
pub use reader::{Recording, RecordingWarning};
pub use samples::Datatype;
pub use segment::Segment;
pub use writer::{RecordingWriter, WriterSettings};
