//! Recorded drives, in and out: IQ, angles, odometry, surveyed radio heads, trajectories.
//!
//! | what | format | read | written |
//! |---|---|---|---|
//! | IQ of one or more antennas | [SigMF](sigmf), or one raw file per antenna | yes | SigMF |

mod error;
pub mod sigmf;

pub use error::RecordingError;
pub use sigmf::{
    Annotation, Capture, Datatype, Recording, RecordingWarning, RecordingWriter, WriterSettings,
};
