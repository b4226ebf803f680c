//! The interface of an output.

use anyhow::Result;

use super::record::Record;

/// An output.
pub trait Sink: Send {
    /// Opens the output. Called at the start and after each failure.
    ///
    /// # Errors
    /// Why the output cannot be opened.
    fn open(&mut self) -> Result<()>;

    /// Writes a record, possibly to a buffer.
    ///
    /// # Errors
    /// Why the record cannot be written. The output is then opened again.
    fn take(&mut self, record: &Record) -> Result<()>;

    /// Writes buffered records if it is time to, and checks the output. Called at least every 200 ms. Returns
    /// whether no record remains in a buffer.
    ///
    /// # Errors
    /// Why the output has failed. It is then opened again.
    fn flush(&mut self) -> Result<bool>;

    /// Discards the unwritten part after a failure, so that what was written before stays valid.
    fn abandon(&mut self) {}

    /// Completes the output at the end of the node.
    ///
    /// # Errors
    /// Why the output could not be completed.
    fn close(&mut self) -> Result<()>;
}
