//! Faults of the outputs of the running program: each is reported, does not affect the other outputs, and ends.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::print_stderr,
    missing_docs
)]

mod common;

use std::fs::{self, File};
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::os::unix::net::UnixDatagram;
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use recording::{OdometryIssue, read_odometry_mcap, read_tum};
use serde_json::{Value, json};

use common::{odometry, scratch, spawn};

/// Interval of the odometry.
const PERIOD: Duration = Duration::from_millis(20);
/// Required maximum time from the end of the cause to the recovery.
const RECOVERY: Duration = Duration::from_secs(5);
/// Required maximum time to the report of a failure, including a margin for a loaded computer.
const REPORT: Duration = Duration::from_secs(4);

/// Thread that sends odometry in real time to the standard input of a node, after a first pose.
struct Feed {
    stop: Arc<AtomicBool>,
    sent: Arc<AtomicU64>,
    thread: Option<JoinHandle<()>>,
}

impl Feed {
    fn start(mut input: ChildStdin) -> Self {
        let (stop, sent) = (
            Arc::new(AtomicBool::new(false)),
            Arc::new(AtomicU64::new(0)),
        );
        let (ends, counter) = (Arc::clone(&stop), Arc::clone(&sent));
        let feed = move || {
            let pose = json!({"type": "set-pose", "x_m": 10.0, "y_m": 0.0, "heading_rad": 0.0});
            let first = odometry(0.0) + &format!("{pose}\n");
            let mut sent = input.write_all(first.as_bytes());
            let began = Instant::now();
            let mut number = 1;
            while sent.is_ok() && !ends.load(Ordering::Relaxed) {
                thread::sleep((number * PERIOD).saturating_sub(began.elapsed()));
                sent = input.write_all(odometry(0.02 * f64::from(number)).as_bytes());
                counter.store(u64::from(number), Ordering::Relaxed);
                number += 1;
            }
        };
        Self {
            stop,
            sent,
            thread: Some(thread::spawn(feed)),
        }
    }

    /// Returns the time of the newest odometry (s).
    fn sent_s(&self) -> f64 {
        0.02 * self.sent.load(Ordering::Relaxed) as f64
    }
}

impl Drop for Feed {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// A running node with its page, whose outputs the test configures.
struct Running {
    process: Child,
    feed: Feed,
    page: String,
}

impl Running {
    fn start(folder: &Path, outputs: &str) -> Self {
        Self::start_with(folder, outputs, &[])
    }

    fn start_with(folder: &Path, outputs: &str, environment: &[(&str, &str)]) -> Self {
        let settings = format!(
            "name = \"test\"\nmessages = [\"-\"]\npage.listen = \"127.0.0.1:0\"\n{outputs}\n"
        );
        let mut process = spawn(folder, &settings, environment, Stdio::piped());
        let mut errors = BufReader::new(process.stderr.take().unwrap());
        let mut line = String::new();
        errors.read_line(&mut line).unwrap();
        let page = line.trim().strip_prefix("page: http://").expect(&line);
        let page = page.trim_end_matches('/').to_owned();
        thread::spawn(move || std::io::copy(&mut errors, &mut std::io::sink()));
        let feed = Feed::start(process.stdin.take().unwrap());
        Self {
            process,
            feed,
            page,
        }
    }

    fn get(&self, path: &str) -> String {
        let mut stream = TcpStream::connect(&self.page).unwrap();
        let request = format!("GET {path} HTTP/1.0\r\nHost: {}\r\n\r\n", self.page);
        stream.write_all(request.as_bytes()).unwrap();
        let mut answer = String::new();
        stream.read_to_string(&mut answer).unwrap();
        let (_, body) = answer.split_once("\r\n\r\n").unwrap();
        body.to_owned()
    }

    /// Returns the health of an output according to the page.
    fn output(&self, name: &str) -> Value {
        let state: Value = serde_json::from_str(&self.get("/state.json")).unwrap();
        let outputs = state["outputs"].as_array().unwrap();
        outputs
            .iter()
            .find(|it| it["name"] == name)
            .unwrap()
            .clone()
    }

    /// Waits until the health of an output is `ok`; panics after `limit`.
    fn wait_for(&self, name: &str, ok: bool, limit: Duration) -> Value {
        let began = Instant::now();
        loop {
            let output = self.output(name);
            if output["ok"] == ok {
                return output;
            }
            assert!(began.elapsed() < limit, "{name} is not {ok}: {output}");
            thread::sleep(Duration::from_millis(50));
        }
    }

    /// Waits until the vehicle has driven for the given time.
    fn drive(&self, duration_s: f64) {
        let until_s = self.feed.sent_s() + duration_s;
        while self.feed.sent_s() < until_s {
            thread::sleep(Duration::from_millis(10));
        }
    }

    fn signal(&self, signal: &str) {
        let id = self.process.id().to_string();
        let sent = Command::new("kill").args([signal, &id]).status().unwrap();
        assert!(sent.success());
    }

    /// Terminates the node; returns its exit code.
    fn terminate(mut self) -> i32 {
        self.signal("-TERM");
        self.process.wait().unwrap().code().unwrap()
    }
}

/// Returns the lines of a JSON file. Each must be complete.
fn lines(file: &Path) -> Vec<Value> {
    let text = fs::read_to_string(file).unwrap();
    assert!(text.ends_with('\n'));
    text.lines()
        .map(|it| serde_json::from_str(it).unwrap())
        .collect()
}

/// Asserts that there is a pose for every odometry sample of a JSON output.
fn assert_no_gap(records: &[Value]) {
    let poses = records
        .iter()
        .filter(|it| it["type"] == "pose" && it["by"] == "odometry");
    let times_s: Vec<f64> = poses.map(|it| it["time_s"].as_f64().unwrap()).collect();
    assert!(times_s.len() > 100);
    for pair in times_s.windows(2) {
        assert!((pair[1] - pair[0] - 0.02).abs() < 1e-6, "a gap: {pair:?}");
    }
}

/// Asserts that the events of an output are one failure and one recovery.
fn assert_one_failure_and_recovery(records: &[Value], name: &str) {
    let events = records
        .iter()
        .filter(|it| it["type"] == "event" && it["source"] == name);
    let found: Vec<(&Value, &Value)> = events.map(|it| (&it["level"], &it["count"])).collect();
    assert_eq!(
        found,
        [(&json!("warn"), &json!(1)), (&json!("info"), &json!(1))]
    );
}

/// A small file system in memory; `None` if this user may not mount one.
struct Tmpfs(PathBuf);

impl Tmpfs {
    fn mount(folder: &Path) -> Option<Self> {
        let path = folder.join("disk");
        fs::create_dir_all(&path).unwrap();
        let options = ["-t", "tmpfs", "-o", "size=256k", "tmpfs"];
        let mounted = Command::new("mount")
            .args(options)
            .arg(&path)
            .stderr(Stdio::null())
            .status();
        if mounted.is_ok_and(|it| it.success()) {
            return Some(Self(path));
        }
        eprintln!("skipped: this user may not mount a tmpfs");
        None
    }

    /// Fills the file system; the returned file holds the space.
    fn fill(&self) -> PathBuf {
        let path = self.0.join("ballast");
        let mut file = File::create(&path).unwrap();
        for size in [4096, 1] {
            while file.write_all(&vec![0; size]).is_ok() {}
        }
        path
    }
}

impl Drop for Tmpfs {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg("-l").arg(&self.0).status();
    }
}

#[test]
fn a_full_disk_under_mcap_and_tum_does_not_affect_other_outputs_and_both_recover() {
    let folder = scratch("full-disk");
    let Some(disk) = Tmpfs::mount(&folder) else {
        return;
    };
    let (tum, mcap) = (disk.0.join("poses.tum"), disk.0.join("mcap"));
    let json = folder.join("node.jsonl");
    let outputs = format!(
        "[output]\ntum = {tum:?}\njson.address = {json:?}\nmcap = {{ folder = {mcap:?}, pose_hz = 50.0 }}"
    );
    let node = Running::start(&folder, &outputs);
    node.drive(2.0);
    let filler = disk.fill();
    for name in ["mcap", "tum"] {
        let failed = node.wait_for(name, false, REPORT);
        let cause = failed["cause"].as_str().unwrap();
        assert!(cause.contains("No space left"), "{cause}");
    }
    let metrics = node.get("/metrics");
    for line in [
        "access_av_output_up{output=\"mcap\"} 0",
        "access_av_output_up{output=\"tum\"} 0",
        "access_av_output_up{output=\"json\"} 1",
        "access_av_output_failures_total{output=\"tum\"} 1",
    ] {
        assert!(metrics.lines().any(|it| it == line), "{line}");
    }
    node.drive(3.0);
    fs::remove_file(filler).unwrap();
    let freed = Instant::now();
    for name in ["mcap", "tum"] {
        let output = node.wait_for(name, true, RECOVERY);
        assert_eq!(output["failures"], 1);
        assert!(output["dropped"].as_u64() > Some(50), "{output}");
    }
    assert!(freed.elapsed() < RECOVERY);
    node.drive(2.0);
    let end_s = node.feed.sent_s();
    assert_eq!(node.terminate(), 0);
    let records = lines(&json);
    assert_no_gap(&records);
    for name in ["mcap", "tum"] {
        assert_one_failure_and_recovery(&records, name);
    }
    let is_failed = |it: &&Value| {
        it["type"] == "status"
            && it["outputs"]
                .as_array()
                .unwrap()
                .iter()
                .any(|it| it["name"] == "tum" && it["ok"] == false)
    };
    assert!(records.iter().filter(is_failed).count() >= 2);
    // No line is damaged, and both files contain the poses from before and after the failure.
    let poses = read_tum(&tum).unwrap();
    let times_s: Vec<f64> = poses.iter().map(|it| it.time_s).collect();
    assert!(times_s.is_sorted() && times_s[0] < 0.1 && *times_s.last().unwrap() > end_s - 0.5);
    let mut times_s = Vec::new();
    for file in fs::read_dir(&mcap).unwrap() {
        let log = read_odometry_mcap(&file.unwrap().path(), None, None).unwrap();
        // Files that were ended by the failure are complete as well.
        let is_truncated = |it: &OdometryIssue| matches!(it, OdometryIssue::Truncated(_));
        assert!(!log.remarks.iter().any(|it| is_truncated(&it.issue)));
        times_s.extend(log.samples.iter().map(|it| it.time_s));
    }
    times_s.sort_by(f64::total_cmp);
    assert!(times_s[0] < 0.1 && *times_s.last().unwrap() > end_s - 0.5);
}

#[test]
fn free_space_is_kept_by_deleting_the_oldest_files_and_then_by_a_reported_failure() {
    let folder = scratch("free-space");
    let Some(disk) = Tmpfs::mount(&folder) else {
        return;
    };
    let mcap = disk.0.join("mcap");
    fs::create_dir_all(&mcap).unwrap();
    // Two older files of 40 kB each; with them, 0.18 MB of 0.26 MB are free.
    for number in 0..2 {
        let file = mcap.join(format!("access-av-00000000001-0000{number}.mcap"));
        fs::write(file, vec![0; 40_000]).unwrap();
    }
    let outputs = format!("[output.mcap]\nfolder = {mcap:?}\nmin_free_mb = 0.2");
    let node = Running::start(&folder, &outputs);
    node.drive(2.0);
    assert_eq!(node.output("mcap")["ok"], true);
    let names = || {
        let names = fs::read_dir(&mcap)
            .unwrap()
            .map(|it| it.unwrap().file_name());
        let mut names: Vec<String> = names.map(|it| it.into_string().unwrap()).collect();
        names.sort();
        names
    };
    assert!(names()[0].ends_with("1-00001.mcap"), "{:?}", names());
    let filler = disk.0.join("ballast");
    fs::write(&filler, vec![0; 80_000]).unwrap();
    let failed = node.wait_for("mcap", false, REPORT);
    let cause = failed["cause"].as_str().unwrap();
    assert!(cause.contains("min_free_mb"), "{cause}");
    fs::remove_file(filler).unwrap();
    node.wait_for("mcap", true, RECOVERY);
    assert_eq!(node.terminate(), 0);
}

#[test]
fn a_reader_that_closes_its_fifo_and_returns_gets_whole_lines_again() {
    let folder = scratch("fifo");
    let (fifo, tum) = (folder.join("pipe"), folder.join("poses.tum"));
    assert!(
        Command::new("mkfifo")
            .arg(&fifo)
            .status()
            .unwrap()
            .success()
    );
    let outputs = format!("[output]\ntum = {tum:?}\njson.address = {fifo:?}");
    let node = Running::start(&folder, &outputs);
    // A pipe without a reader is reported, and does not delay the other outputs.
    let failed = node.wait_for("json", false, REPORT);
    assert!(
        failed["cause"].as_str().unwrap().contains("no reader"),
        "{failed}"
    );
    for _ in 0..2 {
        let mut reader = BufReader::new(File::open(&fifo).unwrap());
        for _ in 0..100 {
            let mut line = String::new();
            reader.read_line(&mut line).unwrap();
            serde_json::from_str::<Value>(&line).unwrap();
        }
        node.wait_for("json", true, RECOVERY);
        drop(reader);
        node.wait_for("json", false, REPORT);
    }
    let end_s = node.feed.sent_s();
    // An output that has failed at the end is an error of the program.
    assert_eq!(node.terminate(), 2);
    let poses = read_tum(&tum).unwrap();
    assert!(
        poses
            .windows(2)
            .all(|it| (it[1].time_s - it[0].time_s - 0.02).abs() < 1e-6)
    );
    assert!(poses.last().unwrap().time_s > end_s - 0.5);
}

#[test]
fn a_closed_standard_output_is_reported_in_the_service_status() {
    let folder = scratch("closed-stdout");
    let manager = UnixDatagram::bind(folder.join("notify")).unwrap();
    manager
        .set_read_timeout(Some(Duration::from_secs(10)))
        .unwrap();
    let socket = folder.join("notify").display().to_string();
    let mut node = Running::start_with(
        &folder,
        "[output.json]\naddress = \"-\"",
        &[("NOTIFY_SOCKET", &socket)],
    );
    drop(node.process.stdout.take());
    let status = loop {
        let mut bytes = [0; 1000];
        let count = manager.recv(&mut bytes).unwrap();
        let text = String::from_utf8_lossy(&bytes[..count]).into_owned();
        if text.contains("failed outputs") {
            break text;
        }
    };
    assert!(
        status.starts_with("STATUS=") && status.contains("json (standard output"),
        "{status}"
    );
    assert_eq!(node.terminate(), 2);
}

#[test]
fn a_reader_that_stops_reading_is_reported_and_the_pipeline_continues() {
    let folder = scratch("stalled");
    let tum = folder.join("poses.tum");
    let outputs = format!("[output]\ntum = {tum:?}\njson.address = \"-\"");
    let mut node = Running::start(&folder, &outputs);
    // A pipe holds 64 KiB: the lines of about 3 s.
    let failed = node.wait_for("json", false, Duration::from_secs(20));
    let cause = failed["cause"].as_str().unwrap();
    assert!(cause.contains("does not read"), "{cause}");
    let mut reader = BufReader::new(node.process.stdout.take().unwrap());
    let reading = thread::spawn(move || {
        let mut line = String::new();
        while reader.read_line(&mut line).is_ok_and(|it| it > 0) {
            line.clear();
        }
    });
    node.wait_for("json", true, RECOVERY);
    assert_eq!(node.terminate(), 0);
    reading.join().unwrap();
    let poses = read_tum(&tum).unwrap();
    assert!(
        poses
            .windows(2)
            .all(|it| (it[1].time_s - it[0].time_s - 0.02).abs() < 1e-6)
    );
}

#[test]
fn a_deleted_log_folder_is_created_again() {
    let folder = scratch("deleted");
    let logs = folder.join("logs");
    let (tum, mcap, json) = (
        logs.join("poses.tum"),
        logs.join("mcap"),
        folder.join("node.jsonl"),
    );
    let outputs =
        format!("[output]\ntum = {tum:?}\njson.address = {json:?}\nmcap = {{ folder = {mcap:?} }}");
    let node = Running::start(&folder, &outputs);
    node.drive(1.5);
    fs::remove_dir_all(&logs).unwrap();
    node.drive(4.0);
    let end_s = node.feed.sent_s();
    assert_eq!(node.terminate(), 0);
    let records = lines(&json);
    assert_no_gap(&records);
    for name in ["mcap", "tum"] {
        assert_one_failure_and_recovery(&records, name);
    }
    let poses = read_tum(&tum).unwrap();
    assert!(poses[0].time_s < 1.5 + 5.0 && poses.last().unwrap().time_s > end_s - 0.5);
    let file = fs::read_dir(&mcap).unwrap().next().unwrap().unwrap().path();
    assert!(read_odometry_mcap(&file, None, None).unwrap().samples.len() > 5);
}

#[test]
fn after_kill_9_the_mcap_file_is_readable_up_to_two_seconds_before() {
    for (number, duration_s) in [3.1, 4.7, 5.4].into_iter().enumerate() {
        let folder = scratch(&format!("kill-{number}"));
        let mcap = folder.join("mcap");
        let outputs = format!("[output.mcap]\nfolder = {mcap:?}\npose_hz = 50.0");
        let mut node = Running::start(&folder, &outputs);
        node.drive(duration_s);
        let end_s = node.feed.sent_s();
        node.signal("-KILL");
        node.process.wait().unwrap();
        let file = fs::read_dir(&mcap).unwrap().next().unwrap().unwrap().path();
        let log = read_odometry_mcap(&file, None, None).unwrap();
        let last_s = log.samples.last().unwrap().time_s;
        assert!(last_s > end_s - 2.0, "{last_s} of {end_s}");
        let is_truncated = |it: &OdometryIssue| matches!(it, OdometryIssue::Truncated(_));
        // The file is complete, so that every MCAP reader accepts it.
        assert!(!log.remarks.iter().any(|it| is_truncated(&it.issue)));
        assert!(fs::read(&file).unwrap().ends_with(b"\x89MCAP0\r\n"));
    }
}

#[test]
fn headings_are_wrapped_in_json_and_metrics() {
    let folder = scratch("headings");
    let json = folder.join("node.jsonl");
    let outputs = format!("[output.json]\naddress = {json:?}");
    let node = Running::start(&folder, &outputs);
    node.drive(0.5);
    let heading = |it: &Value| it["heading_rad"].as_f64();
    let state: Value = serde_json::from_str(&node.get("/state.json")).unwrap();
    assert!(heading(&state["pose"]).is_some());
    assert_eq!(node.terminate(), 0);
    // Six full turns in file playback.
    let pose = json!({"type": "set-pose", "x_m": 0.0, "y_m": 0.0, "heading_rad": 0.0});
    let spin: String = (0..=400)
        .map(|number| {
            let time_s = 0.1 * f64::from(number);
            json!({"type": "odometry", "time_s": time_s, "speed_mps": 0.3, "yaw_rate_radps": 1.0})
                .to_string()
                + "\n"
        })
        .collect();
    fs::write(
        folder.join("spin.jsonl"),
        odometry(-0.1) + &format!("{pose}\n") + &spin,
    )
    .unwrap();
    let settings = format!(
        "name = \"spin\"\npace = \"fast\"\nmessages = [{:?}]\n{outputs}\n",
        folder.join("spin.jsonl")
    );
    fs::write(folder.join("spin.toml"), settings).unwrap();
    let done = Command::new(env!("CARGO_BIN_EXE_access-av-node"))
        .args(["--site", "yard", "--vehicle", "tugger"])
        .arg(folder.join("spin.toml"))
        .status()
        .unwrap();
    assert!(done.success());
    let headings: Vec<f64> = lines(&json).iter().filter_map(heading).collect();
    assert!(headings.len() > 400);
    let pi = std::f64::consts::PI;
    assert!(headings.iter().all(|it| it.abs() <= pi));
    assert!(headings.iter().any(|it| *it > 3.0) && headings.iter().any(|it| *it < -3.0));
}
