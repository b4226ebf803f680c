//! Tests of the program: connections that end and return, signals, and complete files.
#![allow(clippy::unwrap_used, clippy::expect_used, missing_docs)]

mod common;

use std::fs;
use std::io::{BufRead, Write};
use std::net::{TcpListener, TcpStream};
use std::os::unix::net::UnixDatagram;
use std::path::PathBuf;
use std::process::Command;
use std::time::{Duration, Instant};

use access_av_node::settings::NodeSettings;
use onboard::settings::{Shipped, TomlFile};
use serde_json::{Value, json};

use common::{Node, odometry, scratch};

#[test]
fn interruptions_of_sources_are_reported_within_a_second() {
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
    node.until_event("messages", "no data has arrived for");
    assert!(came.elapsed() < Duration::from_secs(1));
    drop(stream);
    node.until_event("messages", "ended");
    let mut stream = connect();
    stream
        .write_all(b"{\"type\":\"odometry\"\n\xff\xfe\n")
        .unwrap();
    stream.write_all(odometry(2.0).as_bytes()).unwrap();
    node.until_event("messages", "message ignored");
    assert_eq!(node.until(|it| it["type"] == "pose")["time_s"], 2.0);
    // A time stamp that goes back is rejected.
    stream.write_all(odometry(0.5).as_bytes()).unwrap();
    node.until_event(
        "odometry",
        "rejected: odometry: time_s is 0.500, 1.500 s before",
    );
    // A permanent step back of the clock is accepted, and the pose is resumed.
    for number in 0..20 {
        let time_s = 0.5 + 0.05 * f64::from(number);
        stream.write_all(odometry(time_s).as_bytes()).unwrap();
        std::thread::sleep(Duration::from_millis(50));
    }
    node.until_event("odometry", "the clock has stepped by -");
    let pose = node.until(|it| it["type"] == "pose");
    assert!(pose["time_s"].as_f64() < Some(1.5), "{pose}");
    let last = node.terminate().pop().unwrap();
    assert_eq!(last["text"], "test ends");
}

#[test]
fn poses_can_be_set_radio_heads_excluded_and_rejected_commands_are_reported() {
    let folder = scratch("commands");
    let mut node = Node::start(&folder, "-", "");
    let mut input = node.process.stdin.take().unwrap();
    input.write_all(odometry(0.0).as_bytes()).unwrap();
    for (command, expected) in [
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
        node.until_event("messages", expected);
    }
    input.write_all(odometry(0.1).as_bytes()).unwrap();
    assert_eq!(node.until(|it| it["type"] == "pose")["state"], "searching");
    drop(input);
    // All input has ended.
    assert!(node.process.wait().unwrap().success());
}

#[test]
fn implausible_time_stamps_are_reported_by_cause_and_do_not_change_the_pose() {
    let folder = scratch("stamps");
    let mut node = Node::start(&folder, "-", "");
    let mut input = node.process.stdin.take().unwrap();
    for number in 0..10 {
        let time_s = 100.0 + 0.02 * f64::from(number);
        input.write_all(odometry(time_s).as_bytes()).unwrap();
        std::thread::sleep(Duration::from_millis(20));
    }
    for (line, expected) in [
        (odometry(102.2), "after its expected time"),
        (odometry(1e300), "it must be in seconds and at most"),
        (odometry(1.7e12), "milliseconds"),
        (odometry(100.18), "of which it is a copy"),
        (odometry(100.0), "before the last accepted message"),
    ] {
        input.write_all(line.as_bytes()).unwrap();
        node.until_event("odometry", expected);
    }
    let wrong = r#"{"type":"odometry","time_s":"abc","speed_mps":1}"#;
    input.write_all(format!("{wrong}\n").as_bytes()).unwrap();
    node.until_event("messages", "time_s: invalid type: string");
    for _ in 0..500 {
        input.write_all(odometry(100.18).as_bytes()).unwrap();
    }
    input.write_all(odometry(100.21).as_bytes()).unwrap();
    assert_eq!(node.until(|it| it["type"] == "pose")["time_s"], 100.21);
    let repeated = |it: &Value| {
        it["text"]
            .as_str()
            .is_some_and(|it| it.contains("is a copy"))
    };
    node.until(|it| repeated(it) && it["count"].as_u64() > Some(400));
    node.terminate();
}

#[test]
fn the_state_is_saved_and_resumed_after_a_kill() {
    let folder = scratch("state");
    let file = folder.join("state.json");
    let more = format!("state_file = {:?}", file.display().to_string());
    let set = json!({"type": "set-pose", "x_m": 30.0, "y_m": 0.0, "heading_rad": 0.0});
    let mut node = Node::start(&folder, "-", &more);
    node.until_event("state", "first start");
    let mut input = node.process.stdin.take().unwrap();
    let stands = |time_s: f64| {
        let message =
            json!({"type": "odometry", "time_s": time_s, "speed_mps": 0.0, "distance_m": 5.0});
        format!("{message}\n")
    };
    input.write_all(stands(0.0).as_bytes()).unwrap();
    input.write_all(format!("{set}\n").as_bytes()).unwrap();
    for number in 1..80 {
        let time_s = 0.02 * f64::from(number);
        input.write_all(stands(time_s).as_bytes()).unwrap();
        std::thread::sleep(Duration::from_millis(20));
    }
    // On a busy computer the state is saved late.
    let until = Instant::now() + Duration::from_secs(10);
    while !file.exists() && Instant::now() < until {
        std::thread::sleep(Duration::from_millis(20));
    }
    node.process.kill().unwrap();
    node.process.wait().unwrap();
    let saved: Value = serde_json::from_slice(&fs::read(&file).unwrap()).unwrap();
    let x_m = saved["state"]["pose"]["x_m"].as_f64().unwrap();
    let mut node = Node::start(&folder, "-", &more);
    let mut input = node.process.stdin.take().unwrap();
    input.write_all(stands(0.0).as_bytes()).unwrap();
    node.until_event("state", "is resumed after 0.00 m by the odometer");
    let pose = node.until(|it| it["type"] == "pose");
    assert!(
        (pose["x_m"].as_f64().unwrap() - x_m).abs() < 0.2,
        "{pose} {x_m}"
    );
    assert_eq!(pose["state"], "unavailable");
    node.terminate();
    // An unusable file is reported, and the pose is searched for.
    fs::write(&file, "{").unwrap();
    let mut node = Node::start(&folder, "-", &more);
    node.until_event("state", "state.json: is not a state file");
    let mut input = node.process.stdin.take().unwrap();
    input.write_all(stands(0.0).as_bytes()).unwrap();
    assert_eq!(node.until(|it| it["type"] == "pose")["state"], "searching");
    node.terminate();
}

#[test]
fn mcap_files_are_rotated_and_each_is_complete() {
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
fn file_input_is_processed_at_maximum_speed_and_nothing_is_dropped() {
    let folder = scratch("fast");
    // The drive has twice as many samples as the queue holds. Status messages are sent by the time
    // of the drive, not by real time. Without a pose, the search takes most of the time.
    let seconds: u32 = 200;
    let pose =
        json!({"type": "set-pose", "time_s": 0.0, "x_m": 10.0, "y_m": 0.0, "heading_rad": 0.0});
    let lines: String = [odometry(0.0), format!("{pose}\n")]
        .into_iter()
        .chain((1..=50 * seconds).map(|number| odometry(0.02 * f64::from(number))))
        .collect();
    fs::write(folder.join("drive.jsonl"), lines).unwrap();
    let file = folder.join("drive.jsonl").display().to_string();
    let began = Instant::now();
    let node = Node::start(&folder, &file, "");
    let messages: Vec<Value> = node
        .lines
        .lines()
        .map(|line| serde_json::from_str(&line.unwrap()).unwrap())
        .collect();
    let count = |kind: &str| messages.iter().filter(|it| it["type"] == kind).count();
    assert_eq!(count("pose"), 50 * seconds as usize + 1);
    assert!(count("status").abs_diff(seconds as usize) <= 2);
    assert!(began.elapsed() < Duration::from_secs(seconds.into()) / 4);
}

#[test]
fn the_service_manager_is_notified_of_start_watchdog_and_end() {
    let folder = scratch("service");
    let socket = folder.join("notify");
    let manager = UnixDatagram::bind(&socket).unwrap();
    manager
        .set_read_timeout(Some(Duration::from_secs(10)))
        .unwrap();
    let socket = socket.display().to_string();
    let environment = [("NOTIFY_SOCKET", &*socket), ("WATCHDOG_USEC", "400000")];
    let mut node = Node::start_with(&folder, "-", "", &environment);
    let receive = || {
        let mut bytes = [0; 1000];
        let count = manager.recv(&mut bytes).unwrap();
        String::from_utf8_lossy(&bytes[..count]).trim().to_owned()
    };
    let until = |wanted: &str| {
        let mut before = Vec::new();
        loop {
            let notification = receive();
            if notification.starts_with(wanted) {
                return (notification, before);
            }
            before.push(notification);
        }
    };
    until("READY=1");
    // Without input, the pipeline is alive.
    let began = Instant::now();
    (0..5).for_each(|_| drop(until("WATCHDOG=1")));
    assert!(began.elapsed() < 5 * Duration::from_millis(400));
    let mut input = node.process.stdin.take().unwrap();
    input.write_all(odometry(0.0).as_bytes()).unwrap();
    let (notification, _) = until("STATUS=");
    assert!(
        notification.starts_with("STATUS=searching: "),
        "{notification}"
    );
    node.terminate();
    let (_, before) = until("STOPPING=1");
    assert!(before.iter().all(|it| it != "READY=1"), "{before:?}");
}

#[test]
fn the_schema_is_printed_and_contains_every_key() {
    let output = Command::new(env!("CARGO_BIN_EXE_access-av-node"))
        .arg("schema")
        .output()
        .unwrap();
    let schema: Value = serde_json::from_slice(&output.stdout).unwrap();
    for key in ["samples", "messages", "output", "page", "sleep"] {
        assert!(schema["properties"][key].is_object(), "{key}");
    }
    let stated = access_av_node::settings::NodeSettings::schema_json();
    assert_eq!(schema, serde_json::from_str::<Value>(&stated).unwrap());
}

/// Returns the standard output of `access-av-node schema` with these options.
fn printed_schema(options: &[&str]) -> String {
    let done = Command::new(env!("CARGO_BIN_EXE_access-av-node"))
        .arg("schema")
        .args(options)
        .output()
        .unwrap();
    assert!(done.status.success());
    String::from_utf8(done.stdout).unwrap()
}

#[test]
fn the_schema_of_the_outputs_has_a_description_of_every_field() {
    let schema: Value = serde_json::from_str(&printed_schema(&["--outputs"])).unwrap();
    let definitions = schema["$defs"].as_object().unwrap();
    for name in [
        "PoseMessage",
        "StatusMessage",
        "MobileRobotPosition",
        "AgvPosition",
    ] {
        assert!(definitions.contains_key(name), "{name}");
    }
    for (name, definition) in definitions {
        for (field, property) in definition["properties"].as_object().into_iter().flatten() {
            assert!(property["description"].is_string(), "{name}.{field}");
        }
    }
    let done = Command::new(env!("CARGO_BIN_EXE_access-av-node"))
        .args(["schema", "--inputs"])
        .output()
        .unwrap();
    assert_eq!(done.status.code(), Some(2));
}

#[test]
fn the_reference_page_of_the_messages_is_up_to_date() {
    let page = include_str!("../../../docs/node-messages.md");
    let printed = printed_schema(&["--outputs", "--markdown"]);
    let command = "access-av-node schema --outputs --markdown > docs/node-messages.md";
    assert!(printed == page, "run `{command}`");
}

#[test]
fn a_new_node_file_is_accepted_by_the_program() {
    let template = include_str!("../../../python/access_av/site_files/templates/node.toml");
    let text = template
        .replace("$name", "new")
        .replace("$file", "node.toml");
    let settings = NodeSettings::from_toml(&text, "node.toml", &Shipped).unwrap();
    assert_eq!(settings.name, "new");
    assert!(settings.samples.is_some() && settings.page.is_some());
}
