//! The program itself: sockets that come and go, signals, files that are whole.
#![allow(clippy::unwrap_used, clippy::expect_used, missing_docs)]

use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::net::{TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use access_av_node::settings::NodeSettings;
use onboard::settings::{Shipped, TomlFile};
use serde_json::{Value, json};

fn scratch(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    folder
}

/// A node that hears angles and odometry by newline JSON, of the shipped yard's tugger on its road.
struct Node {
    process: Child,
    lines: BufReader<std::process::ChildStdout>,
}

impl Node {
    fn start(folder: &Path, messages: &str, more: &str) -> Self {
        let settings = format!(
            "name = \"test\"\nmessages = [{messages:?}]\n{more}\n[output.json]\naddress = \"-\"\n"
        );
        fs::write(folder.join("node.toml"), settings).unwrap();
        let mut process = Command::new(env!("CARGO_BIN_EXE_access-av-node"))
            .args(["--site", "yard", "--vehicle", "tugger"])
            .arg(folder.join("node.toml"))
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let lines = BufReader::new(process.stdout.take().unwrap());
        Self { process, lines }
    }

    /// Reads on until a line is as wanted.
    fn until(&mut self, wanted: impl Fn(&Value) -> bool) -> Value {
        loop {
            let mut line = String::new();
            assert!(
                self.lines.read_line(&mut line).unwrap() > 0,
                "the node has ended"
            );
            let value: Value = serde_json::from_str(&line).unwrap();
            if wanted(&value) {
                return value;
            }
        }
    }

    fn until_event(&mut self, source: &str, said: &str) -> Value {
        let is_it = |it: &Value| {
            it["source"] == source && it["text"].as_str().is_some_and(|it| it.contains(said))
        };
        self.until(is_it)
    }

    fn terminate(mut self) -> Vec<Value> {
        let id = self.process.id().to_string();
        assert!(
            Command::new("kill")
                .args(["-TERM", &id])
                .status()
                .unwrap()
                .success()
        );
        assert!(self.process.wait().unwrap().success());
        let rest = self
            .lines
            .lines()
            .map(|line| serde_json::from_str(&line.unwrap()).unwrap());
        rest.collect()
    }
}

fn odometry(time_s: f64) -> String {
    json!({"type": "odometry", "time_s": time_s, "speed_mps": 1.5}).to_string() + "\n"
}

#[test]
fn sources_vanish_and_return_and_each_silence_is_named_within_a_second() {
    let folder = scratch("vanish");
    let address = {
        let free = TcpListener::bind("127.0.0.1:0").unwrap();
        free.local_addr().unwrap()
    };
    let mut node = Node::start(&folder, &format!("tcp-listen://{address}"), "");
    node.until_event("node", "begins");
    let connect = || {
        let until = Instant::now() + Duration::from_secs(10);
        loop {
            match TcpStream::connect(address) {
                Ok(stream) => return stream,
                Err(_) if Instant::now() < until => std::thread::sleep(Duration::from_millis(20)),
                Err(error) => panic!("{error}"),
            }
        }
    };
    let mut stream = connect();
    stream.write_all(odometry(1.0).as_bytes()).unwrap();
    assert_eq!(node.until(|it| it["type"] == "pose")["time_s"], 1.0);
    let came = Instant::now();
    node.until_event("messages", "nothing has come for");
    assert!(came.elapsed() < Duration::from_secs(1));
    drop(stream);
    node.until_event("messages", "ended");
    let mut stream = connect();
    stream
        .write_all(b"{\"type\":\"odometry\"\n\xff\xfe\n")
        .unwrap();
    stream.write_all(odometry(2.0).as_bytes()).unwrap();
    node.until_event("messages", "left out");
    assert_eq!(node.until(|it| it["type"] == "pose")["time_s"], 2.0);
    // A drive that begins anew.
    stream.write_all(odometry(0.5).as_bytes()).unwrap();
    node.until_event("odometry", "begins anew");
    assert_eq!(node.until(|it| it["type"] == "pose")["time_s"], 0.5);
    let last = node.terminate().pop().unwrap();
    assert_eq!(last["text"], "test ends");
}

#[test]
fn poses_can_be_set_heads_left_out_and_what_is_refused_is_said() {
    let folder = scratch("commands");
    let mut node = Node::start(&folder, "-", "");
    let mut input = node.process.stdin.take().unwrap();
    input.write_all(odometry(0.0).as_bytes()).unwrap();
    for (command, said) in [
        (json!({"type": "exclude", "pci": 12}), "done"),
        (
            json!({"type": "exclude", "pci": 999}),
            "no radio head with PCI 999",
        ),
        (
            json!({"type": "set-pose", "x_m": 10.0, "y_m": 0.0, "heading_rad": 0.0}),
            "done",
        ),
        (json!({"type": "reset"}), "done"),
    ] {
        input.write_all(format!("{command}\n").as_bytes()).unwrap();
        node.until_event("messages", said);
    }
    input.write_all(odometry(0.1).as_bytes()).unwrap();
    assert_eq!(node.until(|it| it["type"] == "pose")["state"], "searching");
    drop(input);
    // All there was has come to its end.
    assert!(node.process.wait().unwrap().success());
}

#[test]
fn mcap_files_are_begun_anew_and_each_is_whole() {
    let folder = scratch("rotation");
    let files = folder.join("mcap");
    let more = format!(
        "[output.mcap]\nfolder = {:?}\nrotate_s = 1.0\nkeep = 3",
        files.display().to_string()
    );
    let mut node = Node::start(&folder, "-", &more);
    let mut input = node.process.stdin.take().unwrap();
    input.write_all(odometry(0.0).as_bytes()).unwrap();
    let set = json!({"type": "set-pose", "x_m": 10.0, "y_m": 0.0, "heading_rad": 0.0});
    input.write_all(format!("{set}\n").as_bytes()).unwrap();
    for number in 1..500 {
        input
            .write_all(odometry(0.02 * f64::from(number)).as_bytes())
            .unwrap();
    }
    node.until(|it| it["type"] == "pose" && it["time_s"].as_f64() > Some(9.97));
    node.terminate();
    let mut found: Vec<PathBuf> = fs::read_dir(&files)
        .unwrap()
        .map(|it| it.unwrap().path())
        .collect();
    found.sort();
    assert_eq!(found.len(), 3);
    for file in found.iter().take(2) {
        let log = recording::read_odometry_mcap(file, None, None).unwrap();
        assert!(
            log.samples.len() >= 3,
            "{}: {}",
            file.display(),
            log.samples.len()
        );
    }
}

#[test]
fn the_schema_is_printed_and_names_every_key() {
    let told = Command::new(env!("CARGO_BIN_EXE_access-av-node"))
        .arg("schema")
        .output()
        .unwrap();
    let schema: Value = serde_json::from_slice(&told.stdout).unwrap();
    for key in ["samples", "messages", "output", "page", "sleep"] {
        assert!(schema["properties"][key].is_object(), "{key}");
    }
    let stated = access_av_node::settings::NodeSettings::schema_json();
    assert_eq!(schema, serde_json::from_str::<Value>(&stated).unwrap());
}

#[test]
fn a_new_node_file_is_one_that_the_program_takes() {
    let template = include_str!("../../../python/access_av/site_files/templates/node.toml");
    let text = template
        .replace("$name", "new")
        .replace("$file", "node.toml");
    let settings = NodeSettings::from_toml(&text, "node.toml", &Shipped).unwrap();
    assert_eq!(settings.name, "new");
    assert!(settings.samples.is_some() && settings.page.is_some());
}
