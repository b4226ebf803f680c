//! Interface of an output.

use anyhow::Result;

use super::record::Record;

/// An output.
pub trait Sink: Send {
    /// Opens the output. Called at the start and after each failure. Returns whether the output is
    /// known to work. Otherwise, it works once a record is written, because opening succeeds even
    /// with a full disk or a closed pipe.
    ///
    /// # Errors
    /// Reason why the output cannot be opened.
    fn open(&mut self) -> Result<bool>;

    /// Writes a record, possibly to a buffer. Returns `false` for a record that this output does
    /// not contain.
    ///
    /// # Errors
    /// Reason why the record cannot be written. The output is then opened again.
    fn take(&mut self, record: &Record) -> Result<bool>;

    /// Writes buffered records if that is due, and checks the output. Called at least every 200 ms.
    /// Returns whether the buffer is empty.
    ///
    /// # Errors
    /// Reason why the output has failed. It is then opened again.
    fn flush(&mut self) -> Result<bool>;

    /// Discards the unwritten part after a failure, so that all earlier data remain valid.
    fn abandon(&mut self) {}

    /// Completes the output at the end of the node.
    ///
    /// # Errors
    /// Reason why the output could not be completed.
    fn close(&mut self) -> Result<()>;
}
