//! Program end by Ctrl-C. A library may hold the interpreter lock for seconds, so that a separate
//! thread cleans up and exits.

use std::collections::BTreeSet;
use std::io::{IsTerminal, Read, Write};
use std::os::fd::IntoRawFd;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;

use pyo3::{PyResult, pyfunction};

/// Exit code of a program that Ctrl-C ended, by convention of shells.
pub const INTERRUPTED: i32 = 130;
/// Signal number of Ctrl-C in POSIX, as written to Python's wakeup descriptor.
const SIGINT: u8 = 2;
/// Time for a KeyboardInterrupt to end the program first.
const GRACE: Duration = Duration::from_millis(200);

static CAME: AtomicBool = AtomicBool::new(false);
/// Folders with partial files of this program.
static WRITING: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

/// Start the thread that watches for Ctrl-C. Signal numbers written to the returned descriptor are
/// processed immediately, and SIGINT ends the program.
#[pyfunction]
pub fn watch() -> PyResult<i32> {
    let (mut receiver, sender) = std::io::pipe()?;
    thread::Builder::new().spawn(move || {
        let mut signal = [0];
        while receiver.read_exact(&mut signal).is_ok() {
            if signal == [SIGINT] {
                CAME.store(true, Ordering::Release);
                thread::sleep(GRACE);
                end();
            }
        }
    })?;
    Ok(sender.into_raw_fd())
}

/// Whether Ctrl-C was pressed.
#[pyfunction]
pub fn came() -> bool {
    CAME.load(Ordering::Acquire)
}

/// Register a folder in which partial files are written next to their final path.
#[pyfunction]
pub fn writing(folder: PathBuf) -> PyResult<()> {
    let folder = std::path::absolute(folder)?;
    folders().insert(folder);
    Ok(())
}

/// Remove partial files and empty folders.
#[pyfunction]
pub fn clean() {
    for folder in &*folders() {
        for entry in folder.read_dir().into_iter().flatten().flatten() {
            let name = entry.file_name();
            let name = name.to_string_lossy();
            if name.starts_with('.') && name.ends_with(".partial") {
                // Another process may have removed the file; errors are ignored.
                let _ = std::fs::remove_file(entry.path());
            }
        }
        let _ = std::fs::remove_dir(folder); // fails unless the folder is empty
    }
}

fn folders() -> MutexGuard<'static, BTreeSet<PathBuf>> {
    WRITING.lock().unwrap_or_else(PoisonError::into_inner)
}

/// End the program immediately, even if another thread holds the interpreter lock.
#[pyfunction]
pub fn end() {
    clean();
    let mut stderr = std::io::stderr();
    if stderr.is_terminal() {
        let _ = write!(stderr, "\x1b[?25h"); // show the cursor, which a progress bar hides
    }
    let _ = writeln!(stderr, "error: interrupted; what was finished is kept");
    // SAFETY: the call ends the process and never returns. Exit handlers are skipped because they
    // may wait for a busy thread.
    #[allow(unsafe_code)]
    unsafe {
        libc::_exit(INTERRUPTED)
    }
}
