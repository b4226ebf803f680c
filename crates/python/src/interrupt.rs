//! The end that Ctrl-C makes where Python cannot: a library may hold the interpreter for seconds, so
//! a thread of its own cleans up and leaves.

use std::collections::BTreeSet;
use std::io::{IsTerminal, Read, Write};
use std::os::fd::IntoRawFd;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;

use pyo3::{PyResult, pyfunction};

/// What shells expect of a program that Ctrl-C ended.
pub const INTERRUPTED: i32 = 130;
/// The signal of Ctrl-C, as POSIX numbers it and Python's wakeup descriptor is told it.
const SIGINT: u8 = 2;
/// How long an exception may take to come up and end the program first.
const GRACE: Duration = Duration::from_millis(200);

static CAME: AtomicBool = AtomicBool::new(false);
/// Folders whose partial files are this program's.
static WRITING: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

/// From here on a signal's number written to the returned descriptor is known at once, and Ctrl-C's
/// ends the program.
#[pyfunction]
pub fn watch() -> PyResult<i32> {
    let (mut told, tells) = std::io::pipe()?;
    thread::Builder::new().spawn(move || {
        let mut signal = [0];
        while told.read_exact(&mut signal).is_ok() {
            if signal == [SIGINT] {
                CAME.store(true, Ordering::Release);
                thread::sleep(GRACE);
                end();
            }
        }
    })?;
    Ok(tells.into_raw_fd())
}

/// Whether Ctrl-C has come.
#[pyfunction]
pub fn came() -> bool {
    CAME.load(Ordering::Acquire)
}

/// Remember a folder in which files are written beside their places.
#[pyfunction]
pub fn writing(folder: PathBuf) -> PyResult<()> {
    let folder = std::path::absolute(folder)?;
    folders().insert(folder);
    Ok(())
}

/// Leave no partial file behind, and no folder with nothing in it.
#[pyfunction]
pub fn clean() {
    for folder in &*folders() {
        for entry in folder.read_dir().into_iter().flatten().flatten() {
            let name = entry.file_name();
            let name = name.to_string_lossy();
            if name.starts_with('.') && name.ends_with(".partial") {
                // Somebody else may have been faster, and what cannot be removed stays.
                let _ = std::fs::remove_file(entry.path());
            }
        }
        let _ = std::fs::remove_dir(folder); // only where it is empty
    }
}

fn folders() -> MutexGuard<'static, BTreeSet<PathBuf>> {
    WRITING.lock().unwrap_or_else(PoisonError::into_inner)
}

/// End the program now, whoever holds the interpreter.
#[pyfunction]
pub fn end() {
    clean();
    let mut stderr = std::io::stderr();
    if stderr.is_terminal() {
        let _ = write!(stderr, "\x1b[?25h"); // a bar has hidden the cursor
    }
    let _ = writeln!(stderr, "error: interrupted; what was finished is kept");
    // SAFETY: ends the process and returns never; nothing of it is used afterwards. What is
    // registered to run at exit is left out, for it may wait for a thread that is busy.
    #[allow(unsafe_code)]
    unsafe {
        libc::_exit(INTERRUPTED)
    }
}
