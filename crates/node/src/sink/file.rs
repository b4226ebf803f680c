//! Files that grow while the node runs.

use std::fs::{self, File, OpenOptions};
use std::io::{self, ErrorKind, Seek, SeekFrom, Write};
use std::os::unix::fs::{FileTypeExt, MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use rustix::fs::OFlags;

/// Number of buffered bytes above which the buffer is written before the next flush.
const BUFFER_BYTES: usize = 1 << 16;
/// Interval at which a file is checked for having been deleted or replaced.
const CHECK: Duration = Duration::from_millis(500);

#[derive(Default)]
struct Shared {
    /// Length after the last successful flush, in bytes.
    flushed: AtomicU64,
    /// Whether all later writes must fail.
    is_stopped: AtomicBool,
    /// Whether the owner writes the end of the file itself.
    is_final: AtomicBool,
}

/// A file, FIFO or device that is appended to.
///
/// Bytes are kept in a buffer until [`flush`](Write::flush). After a failed write, [`repair`](Self::repair)
/// removes the bytes after the last successful flush, so that the file ends with a complete record.
///
/// A file may have an end, such as a footer. Each flush writes it, and the next write replaces it: the file is valid
/// at any time, also after `kill -9`.
pub struct GrowingFile {
    path: PathBuf,
    file: File,
    is_regular: bool,
    end: &'static [u8],
    buffer: Vec<u8>,
    /// Shared with [`Tail`], because a writer of a format owns this file.
    shared: Arc<Shared>,
    written: u64,
    /// Whether a write has failed. All later writes fail, until the file is repaired.
    has_failed: bool,
    checked: Instant,
}

impl GrowingFile {
    /// Creates the file and its folders. A FIFO is opened for writing; without a reader this fails.
    ///
    /// # Errors
    /// Those of the file system, with the name of the file.
    pub fn create(path: &Path) -> Result<Self> {
        Self::create_with_end(path, &[])
    }

    /// Creates a file like [`create`](Self::create), with the given end.
    ///
    /// # Errors
    /// Those of the file system, with the name of the file.
    pub fn create_with_end(path: &Path, end: &'static [u8]) -> Result<Self> {
        let file = open(path).with_context(|| path.display().to_string())?;
        let is_regular = file.metadata().is_ok_and(|it| it.is_file());
        Ok(Self {
            path: path.to_owned(),
            file,
            is_regular,
            end,
            buffer: Vec::with_capacity(BUFFER_BYTES),
            shared: Arc::default(),
            written: 0,
            has_failed: false,
            checked: Instant::now(),
        })
    }

    /// Returns a handle that can remove what was written since the last flush after this file was dropped.
    ///
    /// # Errors
    /// Those of the file system.
    pub fn tail(&self) -> io::Result<Tail> {
        Ok(Tail {
            path: self.path.clone(),
            file: self.file.try_clone()?,
            end: self.end,
            shared: Arc::clone(&self.shared),
            checked: Instant::now(),
        })
    }

    /// Fails if the file does not exist any more under its name; checks every 0.5 s.
    ///
    /// # Errors
    /// If the file was deleted or replaced.
    pub fn check_exists(&mut self) -> Result<()> {
        if self.is_regular {
            check_exists(&self.path, &self.file, &mut self.checked)?;
        }
        Ok(())
    }

    /// Removes what was written since the last flush, and allows writes again. Returns `false` if that is not
    /// possible and the file has to be created again.
    pub fn repair(&mut self) -> bool {
        self.buffer.clear();
        self.written = self.shared.flushed.load(Ordering::Relaxed);
        let cut = self.is_regular && cut(&mut self.file, self.written).is_ok();
        self.has_failed = !cut;
        self.checked = Instant::now();
        cut && is_at(&self.path, &self.file)
    }

    fn write_buffer(&mut self, end: &[u8]) -> io::Result<()> {
        if self.has_failed || self.shared.is_stopped.load(Ordering::Relaxed) {
            return Err(io::Error::new(
                ErrorKind::BrokenPipe,
                "an earlier write has failed",
            ));
        }
        let written = self.written + self.buffer.len() as u64;
        // One call, so that the kernel does not see the content without its end.
        self.buffer.extend_from_slice(end);
        let mut done = self.file.write_all(&self.buffer);
        if done.is_ok() && !end.is_empty() {
            done = self.file.seek(SeekFrom::Start(written)).map(drop);
        }
        if done.is_ok() {
            self.written = written;
        }
        self.has_failed = done.is_err();
        self.buffer.clear();
        done
    }
}

impl Write for GrowingFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.buffer.extend_from_slice(bytes);
        if self.buffer.len() >= BUFFER_BYTES || self.has_failed {
            self.write_buffer(&[])?;
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        if !self.buffer.is_empty() || self.has_failed {
            let is_final = self.shared.is_final.load(Ordering::Relaxed);
            let end = if is_final { &[] } else { self.end };
            self.write_buffer(end)?;
        }
        self.shared.flushed.store(self.written, Ordering::Relaxed);
        Ok(())
    }
}

/// Access to the end of a file whose [`GrowingFile`] is owned by a writer of a format.
pub struct Tail {
    path: PathBuf,
    file: File,
    end: &'static [u8],
    shared: Arc<Shared>,
    checked: Instant,
}

impl Tail {
    /// Returns the length after the last successful flush, in bytes.
    pub fn flushed(&self) -> u64 {
        self.shared.flushed.load(Ordering::Relaxed)
    }

    /// Makes all later writes of the [`GrowingFile`] fail.
    pub fn stop(&self) {
        self.shared.is_stopped.store(true, Ordering::Relaxed);
    }

    /// Leaves the end of the file to its owner.
    pub fn finalize(&self) {
        self.shared.is_final.store(true, Ordering::Relaxed);
    }

    /// Fails under the conditions of [`GrowingFile::check_exists`].
    ///
    /// # Errors
    /// If the file was deleted or replaced.
    pub fn check_exists(&mut self) -> Result<()> {
        check_exists(&self.path, &self.file, &mut self.checked)
    }

    /// Removes what was written since the last flush, and writes the end if there is space for it. The
    /// [`GrowingFile`] must have been stopped.
    ///
    /// # Errors
    /// Those of the file system. The file then ends with the last flush.
    pub fn complete(mut self) -> io::Result<()> {
        let flushed = self.flushed();
        cut(&mut self.file, flushed)?;
        let done = self.file.write_all(self.end);
        if done.is_err() {
            cut(&mut self.file, flushed)?;
        }
        done
    }
}

fn cut(file: &mut File, length: u64) -> io::Result<()> {
    file.set_len(length)?;
    file.seek(SeekFrom::Start(length)).map(drop)
}

/// Whether the open file is the one with this path.
fn is_at(path: &Path, file: &File) -> bool {
    let identity = |it: fs::Metadata| (it.dev(), it.ino());
    let named = fs::metadata(path).map(identity).ok();
    named.is_some() && named == file.metadata().map(identity).ok()
}

fn check_exists(path: &Path, file: &File, checked: &mut Instant) -> Result<()> {
    if checked.elapsed() >= CHECK {
        *checked = Instant::now();
        if !is_at(path, file) {
            bail!("{}: the file was deleted or replaced", path.display());
        }
    }
    Ok(())
}

fn open(path: &Path) -> io::Result<File> {
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder)?;
    }
    let is_fifo = fs::metadata(path).is_ok_and(|it| it.file_type().is_fifo());
    if !is_fifo {
        return File::create(path);
    }
    // Without a reader, a blocking open would wait for one.
    let nonblocking = OFlags::NONBLOCK.bits().cast_signed();
    let opened = OpenOptions::new()
        .write(true)
        .custom_flags(nonblocking)
        .open(path);
    let fifo = opened.map_err(|error| {
        if error.raw_os_error() == Some(rustix::io::Errno::NXIO.raw_os_error()) {
            return io::Error::new(ErrorKind::NotConnected, "the FIFO has no reader");
        }
        error
    })?;
    let flags = rustix::fs::fcntl_getfl(&fifo)?;
    rustix::fs::fcntl_setfl(&fifo, flags - OFlags::NONBLOCK)?;
    Ok(fifo)
}

/// Returns the free space for this user on the file system of `folder`, in MB.
///
/// # Errors
/// Those of the file system.
pub fn free_mb(folder: &Path) -> io::Result<f64> {
    let found = rustix::fs::statvfs(folder)?;
    Ok(found.f_bavail as f64 * found.f_frsize as f64 * 1e-6)
}

/// Returns the files of a folder with this prefix and ending, oldest first by name.
///
/// # Errors
/// Those of the file system.
pub fn files_of(folder: &Path, prefix: &str, ending: &str) -> io::Result<Vec<PathBuf>> {
    let mut found: Vec<PathBuf> = Vec::new();
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        if name.starts_with(prefix) && name.ends_with(ending) {
            found.push(path);
        }
    }
    found.sort();
    Ok(found)
}

/// Removes the oldest files of a folder with this prefix and ending, so that `keep` remain.
///
/// # Errors
/// Those of the file system.
pub fn keep_newest(folder: &Path, prefix: &str, ending: &str, keep: usize) -> io::Result<()> {
    let found = files_of(folder, prefix, ending)?;
    let gone = found.len().saturating_sub(keep);
    found.iter().take(gone).try_for_each(fs::remove_file)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scratch(name: &str) -> PathBuf {
        let folder =
            std::env::temp_dir().join(format!("access-av-file-{}-{name}", std::process::id()));
        let _ = fs::remove_dir_all(&folder);
        folder
    }

    #[test]
    fn a_repaired_file_ends_with_the_last_flush() {
        let folder = scratch("repair");
        let path = folder.join("poses.tum");
        let mut file = GrowingFile::create(&path).unwrap();
        file.write_all(b"first line\n").unwrap();
        file.flush().unwrap();
        // More than the buffer holds, so that part of it is in the file.
        file.write_all(&vec![b'x'; 3 * BUFFER_BYTES / 2]).unwrap();
        assert!(fs::metadata(&path).unwrap().len() > BUFFER_BYTES as u64);
        assert!(file.repair());
        file.write_all(b"second line\n").unwrap();
        file.flush().unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"first line\nsecond line\n");
        fs::remove_dir_all(&folder).unwrap();
        assert!(!file.repair());
        file.checked -= CHECK;
        let error = file.check_exists().unwrap_err().to_string();
        assert!(error.contains("deleted"), "{error}");
    }

    #[test]
    fn a_stopped_file_is_truncated_and_completed() {
        let folder = scratch("complete");
        let path = folder.join("log");
        let mut file = GrowingFile::create_with_end(&path, b" end").unwrap();
        let tail = file.tail().unwrap();
        for (chunk, expected) in [("one", "one end"), (", two", "one, two end")] {
            file.write_all(chunk.as_bytes()).unwrap();
            file.flush().unwrap();
            assert_eq!(fs::read_to_string(&path).unwrap(), expected);
        }
        tail.stop();
        file.write_all(b"more").unwrap();
        assert!(file.flush().is_err());
        drop(file);
        tail.complete().unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"one, two end");
        let mut file = GrowingFile::create_with_end(&path, b" end").unwrap();
        file.write_all(b"chunk").unwrap();
        file.flush().unwrap();
        file.tail().unwrap().finalize();
        file.write_all(b" and its own end").unwrap();
        file.flush().unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"chunk and its own end");
        fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn a_full_device_fails_and_cannot_be_repaired() {
        let mut file = GrowingFile::create(Path::new("/dev/full")).unwrap();
        file.write_all(b"line").unwrap();
        assert_eq!(file.flush().unwrap_err().kind(), ErrorKind::StorageFull);
        assert!(file.flush().is_err());
        assert!(!file.repair());
    }

    #[test]
    fn a_fifo_without_a_reader_is_refused_at_once() {
        let folder = scratch("fifo");
        fs::create_dir_all(&folder).unwrap();
        let path = folder.join("pipe");
        let made = std::process::Command::new("mkfifo").arg(&path).status();
        assert!(made.unwrap().success());
        let error = GrowingFile::create(&path).err().unwrap();
        assert!(format!("{error:#}").contains("no reader"), "{error:#}");
        fs::remove_dir_all(&folder).unwrap();
    }
}
