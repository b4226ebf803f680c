//! The node as a child process, for tests.
#![allow(dead_code, reason = "each test binary uses a part of this")]

use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use serde_json::{Value, json};

pub fn scratch(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    folder
}

/// Starts a node for the shipped yard and tugger with piped standard input and output.
pub fn spawn(folder: &Path, settings: &str, environment: &[(&str, &str)], errors: Stdio) -> Child {
    let file = folder.join("node.toml");
    fs::write(&file, settings).unwrap();
    Command::new(env!("CARGO_BIN_EXE_access-av-node"))
        .args(["--site", "yard", "--vehicle", "tugger"])
        .arg(file)
        .envs(environment.iter().copied())
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(errors)
        .spawn()
        .unwrap()
}

/// A node with input by newline JSON and JSON output to its standard output, for the shipped yard and tugger.
pub struct Node {
    pub process: Child,
    pub lines: BufReader<std::process::ChildStdout>,
}

impl Node {
    pub fn start(folder: &Path, messages: &str, more: &str) -> Self {
        Self::start_with(folder, messages, more, &[])
    }

    pub fn start_with(
        folder: &Path,
        messages: &str,
        more: &str,
        environment: &[(&str, &str)],
    ) -> Self {
        // A file is played as fast as possible; messages on standard input arrive in real time.
        let pace = if Path::new(messages).is_file() {
            "fast"
        } else {
            "real-time"
        };
        let settings = format!(
            "name = \"test\"\npace = {pace:?}\nmessages = [{messages:?}]\n{more}\n[output.json]\naddress = \"-\"\n"
        );
        let mut process = spawn(folder, &settings, environment, Stdio::null());
        let lines = BufReader::new(process.stdout.take().unwrap());
        Self { process, lines }
    }

    /// Reads lines until one satisfies the condition, and returns it.
    pub fn until(&mut self, wanted: impl Fn(&Value) -> bool) -> Value {
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

    pub fn until_event(&mut self, source: &str, text: &str) -> Value {
        let is_it = |it: &Value| {
            it["source"] == source && it["text"].as_str().is_some_and(|it| it.contains(text))
        };
        self.until(is_it)
    }

    pub fn terminate(mut self) -> Vec<Value> {
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

pub fn odometry(time_s: f64) -> String {
    json!({"type": "odometry", "time_s": time_s, "speed_mps": 1.5}).to_string() + "\n"
}
