//! The state file: pose, calibration and excluded radio heads, saved once a second and resumed at the next start.
//!
//! The file is written under a temporary name, synchronised and renamed, so that a complete file
//! exists at any time. A separate thread writes, because disk access may take long.

use std::fs::{self, File};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;

use onboard::live::SavedState;
use onboard::settings::{Site, TomlFile, Vehicle};
use serde::{Deserialize, Serialize};

use crate::clock::unix_s;
use crate::inbox::{Inbox, Input, Level};

/// Version of the file's format.
const VERSION: u32 = 1;

/// Maximum age of a state that is resumed, in seconds. An older state may have changed in ways that
/// no counter reveals.
pub const MAX_AGE_S: f64 = 600.0;

/// Maximum size of a state file in bytes; a state takes less than 2 kB.
const MAX_BYTES: u64 = 1 << 16;

/// Content of the file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct StateFile {
    version: u32,
    /// Time of saving in seconds since 1970 according to this computer's clock.
    saved_unix_s: f64,
    /// Hash of site and vehicle.
    fingerprint: String,
    state: SavedState,
}

/// Returns the hash (FNV-1a, 64 bit) of site and vehicle. A state is resumed only with equal files.
pub fn fingerprint(site: &Site, vehicle: &Vehicle) -> String {
    let text = [site.to_toml(), vehicle.to_toml()];
    let bytes = text.iter().flat_map(|it| it.bytes());
    let hash = bytes.fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
    });
    format!("{hash:016x}")
}

/// Reads a state file and returns the state with its age in seconds; `None` if the file does not
/// exist.
///
/// # Errors
/// Reason why the file cannot be used.
pub fn read(
    path: &Path,
    fingerprint: &str,
    now_unix_s: f64,
) -> Result<Option<(SavedState, f64)>, String> {
    let named = |why: String| format!("{}: {why}", path.display());
    let size = match fs::metadata(path) {
        Ok(found) => found.len(),
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(named(error.to_string())),
    };
    if size > MAX_BYTES {
        return Err(named(format!(
            "has {size} bytes; a state file has at most {MAX_BYTES}"
        )));
    }
    let bytes = fs::read(path).map_err(|error| named(error.to_string()))?;
    let file: StateFile = serde_json::from_slice(&bytes)
        .map_err(|error| named(format!("is not a state file: {error}")))?;
    if file.version != VERSION {
        let version = file.version;
        return Err(named(format!("version is {version}; it must be {VERSION}")));
    }
    if file.fingerprint != fingerprint {
        return Err(named("was saved with another site or vehicle".to_owned()));
    }
    let age_s = now_unix_s - file.saved_unix_s;
    if !(0.0..=MAX_AGE_S).contains(&age_s) {
        return Err(named(format!(
            "is {age_s:.1} s old; it must be from 0 to {MAX_AGE_S} s"
        )));
    }
    let state = file.state;
    let is_valid = [state.position_std_m, state.heading_std_rad]
        .iter()
        .all(|it| *it >= 0.0);
    if !is_valid {
        return Err(named("a standard deviation is negative".to_owned()));
    }
    Ok(Some((state, age_s)))
}

/// Replaces a file atomically, including on the disk.
fn write(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let mut temporary = path.as_os_str().to_owned();
    temporary.push(".new");
    let temporary = PathBuf::from(temporary);
    let mut file = File::create(&temporary)?;
    file.write_all(bytes)?;
    file.sync_all()?;
    fs::rename(&temporary, path)?;
    let folder = path.parent().filter(|it| !it.as_os_str().is_empty());
    File::open(folder.unwrap_or(Path::new(".")))?.sync_all()
}

#[derive(Debug, Default)]
struct Slot {
    newest: Option<SavedState>,
    fingerprint: String,
    is_closed: bool,
}

/// Queue of the newest state for the writer thread.
#[derive(Debug, Default)]
pub struct StateStore {
    slot: Mutex<Slot>,
    came: Condvar,
}

impl StateStore {
    /// Creates the queue for a site and vehicle with this fingerprint.
    pub fn new(fingerprint: String) -> Self {
        Self {
            slot: Mutex::new(Slot {
                fingerprint,
                ..Slot::default()
            }),
            came: Condvar::new(),
        }
    }

    fn lock(&self) -> MutexGuard<'_, Slot> {
        self.slot.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Requests that a state is written; replaces an unwritten one.
    pub fn put(&self, state: SavedState) {
        self.lock().newest = Some(state);
        self.came.notify_one();
    }

    /// Changes the fingerprint after a change of site or vehicle.
    pub fn set_fingerprint(&self, fingerprint: String) {
        let mut slot = self.lock();
        slot.fingerprint = fingerprint;
        slot.newest = None;
    }

    /// Ends the writer thread after the last state.
    pub fn close(&self) {
        self.lock().is_closed = true;
        self.came.notify_one();
    }

    /// Returns the next state with the fingerprint; `None` at the end.
    fn take(&self) -> Option<(SavedState, String)> {
        let mut slot = self.lock();
        loop {
            if let Some(state) = slot.newest.take() {
                return Some((state, slot.fingerprint.clone()));
            }
            if slot.is_closed {
                return None;
            }
            slot = (self.came.wait(slot)).unwrap_or_else(PoisonError::into_inner);
        }
    }
}

/// Starts the thread that writes states to `path`. A failure and its end are events.
///
/// # Errors
/// An error if the thread cannot be started.
pub fn start(
    store: Arc<StateStore>,
    path: PathBuf,
    inbox: Arc<Inbox>,
) -> io::Result<JoinHandle<()>> {
    let named = std::thread::Builder::new().name("state".to_owned());
    named.spawn(move || {
        let mut failed: Option<String> = None;
        while let Some((state, fingerprint)) = store.take() {
            let file = StateFile {
                version: VERSION,
                saved_unix_s: unix_s(),
                fingerprint,
                state,
            };
            let text = serde_json::to_vec(&file).map_err(io::Error::from);
            let error = (text.and_then(|text| write(&path, &text)).err())
                .map(|error| format!("state_file {}: {error}", path.display()));
            if error == failed {
                continue;
            }
            let (level, text) = match &error {
                Some(text) => (Level::Warn, text.clone()),
                None => (
                    Level::Info,
                    format!("state_file {}: written again", path.display()),
                ),
            };
            inbox.put(Input::Remark {
                level,
                source: "state",
                text,
            });
            failed = error;
        }
    })
}

#[cfg(test)]
mod tests {
    use onboard::settings::Shipped;

    use super::*;

    fn state() -> SavedState {
        SavedState {
            time_s: 12.0,
            pose: onboard::geometry::Pose::default(),
            position_std_m: 0.3,
            heading_std_rad: 0.02,
            distance_m: Some(7.0),
            speed_mps: 1.0,
            yaw_rate_radps: None,
            odometer_scale: Some([1.001, 0.002]),
            yaw_rate_bias_radps: None,
            mounting_rad: None,
            phase_rad: None,
            excluded: vec![11],
            faulty: vec![],
        }
    }

    #[test]
    fn states_round_trip_and_unusable_files_are_reported() {
        let folder = std::env::temp_dir().join(format!("access-av-state-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let path = folder.join("state.json");
        assert_eq!(read(&path, "a", 0.0), Ok(None));
        let (store, inbox) = (Arc::new(StateStore::new("a".to_owned())), Arc::default());
        let writing = start(Arc::clone(&store), path.clone(), inbox).unwrap();
        store.put(state());
        store.close();
        writing.join().unwrap();
        let now_s = unix_s();
        let (found, age_s) = read(&path, "a", now_s).unwrap().unwrap();
        assert_eq!(found, state());
        assert!((0.0..60.0).contains(&age_s));
        let text = fs::read_to_string(&path).unwrap();
        for (text, fingerprint, now_s, expected) in [
            (text.as_str(), "b", now_s, "another site or vehicle"),
            (&text, "a", now_s + 601.0, "s old; it must be"),
            (&text, "a", now_s - 60.0, "s old; it must be"),
            (&text[..text.len() / 2], "a", now_s, "is not a state file"),
            ("", "a", now_s, "is not a state file"),
            (
                &text.replace("\"version\":1", "\"version\":9"),
                "a",
                now_s,
                "version is 9",
            ),
            (
                &text.replace("_m\":0.3", "_m\":-0.3"),
                "a",
                now_s,
                "negative",
            ),
            (
                &text.replace("_m\":0.3", "_m\":null"),
                "a",
                now_s,
                "is not a state file",
            ),
            (&"x".repeat(1 << 17), "a", now_s, "bytes"),
        ] {
            fs::write(&path, text).unwrap();
            let error = read(&path, fingerprint, now_s).unwrap_err();
            assert!(error.contains(expected), "{expected}: {error}");
            assert!(error.contains("state.json"), "{error}");
        }
        fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn a_write_failure_is_reported_once() {
        let inbox = Arc::new(Inbox::default());
        let store = Arc::new(StateStore::new("a".to_owned()));
        let path = PathBuf::from("/proc/none/state.json");
        let writing = start(Arc::clone(&store), path, Arc::clone(&inbox)).unwrap();
        for _ in 0..3 {
            store.put(state());
            std::thread::sleep(std::time::Duration::from_millis(30));
        }
        store.close();
        writing.join().unwrap();
        let mut events = 0;
        while let Some((_, Input::Remark { text, .. })) = inbox.take(std::time::Duration::ZERO) {
            assert!(text.contains("state_file /proc/none/state.json"), "{text}");
            events += 1;
        }
        assert_eq!(events, 1);
    }

    #[test]
    fn a_different_vehicle_has_a_different_fingerprint() {
        let site = Site::from_library("yard", &Shipped).unwrap();
        let mut vehicle = Vehicle::from_library("tugger", &Shipped).unwrap();
        let before = fingerprint(&site, &vehicle);
        assert_eq!(before, fingerprint(&site, &vehicle));
        vehicle.array.mounting_rad += 1e-6;
        assert_ne!(before, fingerprint(&site, &vehicle));
    }
}
