//! Settings of the outputs and of the page.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::address::Address;

/// `[output]`
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Outputs {
    /// All messages as newline JSON.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub json: Option<JsonOutput>,
    /// File for the poses as a TUM trajectory.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tum: Option<PathBuf>,
    /// MCAP files for ROS 2 tools.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mcap: Option<McapOutput>,
    /// The position object of VDA 5050 to an MQTT broker.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mqtt: Option<MqttOutput>,
}

/// `[output.json]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct JsonOutput {
    /// `-` (standard output), `tcp-listen://` (for clients that connect), `udp://`, or the path of a file or FIFO.
    pub address: Address,
    /// Maximum number of poses per second.
    #[serde(default = "every")]
    #[schemars(range(min = 0.1, max = 1000.0))]
    pub rate_hz: f64,
}

const fn every() -> f64 {
    1000.0
}

/// `[output.mcap]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct McapOutput {
    /// Folder of the files.
    pub folder: PathBuf,
    /// Maximum number of poses and transforms per second.
    #[serde(default = "five")]
    #[schemars(range(min = 0.1, max = 1000.0))]
    pub pose_hz: f64,
    /// Maximum number of verdicts per second and radio head.
    #[serde(default = "one")]
    #[schemars(range(min = 0.0, max = 10_000.0))]
    pub verdict_hz: f64,
    /// Size in MB at which the next file begins.
    #[serde(default = "hundred")]
    #[schemars(range(min = 0.1, max = 100_000.0))]
    pub rotate_mb: f64,
    /// Duration of a file in seconds, after which the next file begins.
    #[serde(default = "hour")]
    #[schemars(range(min = 1.0, max = 1e6))]
    pub rotate_s: f64,
    /// Minimum free space on the disk in MB. With less, the oldest of these files are deleted; if that is not enough,
    /// writing stops and the failure is reported. 0 is no limit.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1e9))]
    pub min_free_mb: f64,
    /// Maximum number of files; the oldest is deleted. All files are kept without it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1, max = 100_000))]
    pub keep: Option<usize>,
}

const fn five() -> f64 {
    5.0
}
const fn hundred() -> f64 {
    100.0
}
const fn hour() -> f64 {
    3600.0
}

/// Version of VDA 5050.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
pub enum VdaVersion {
    /// `agvPosition` with `positionInitialized`.
    #[serde(rename = "2.1")]
    V2,
    /// `mobileRobotPosition` with `localized`.
    #[default]
    #[serde(rename = "3.0")]
    V3,
}

/// `[output.mqtt]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MqttOutput {
    /// Host of the broker.
    pub host: String,
    /// Port of the broker.
    #[serde(default = "mqtt_port")]
    pub port: u16,
    /// Topic of the position object.
    pub topic: String,
    /// Version of VDA 5050.
    #[serde(default)]
    pub vda5050: VdaVersion,
    /// `mapId` of the position.
    pub map_id: String,
    /// Messages per second.
    #[serde(default = "one")]
    #[schemars(range(min = 0.1, max = 30.0))]
    pub rate_hz: f64,
    /// Time that the pose must have been valid before the vehicle is reported as localized, in seconds. A pose is
    /// valid while its protection level is at most the alert limit.
    #[serde(default = "one")]
    #[schemars(range(min = 0.0, max = 600.0))]
    pub localized_after_s: f64,
}

const fn mqtt_port() -> u16 {
    1883
}
const fn one() -> f64 {
    1.0
}

/// `[page]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct PageSettings {
    /// Address and port of the page; port 0 is any free port.
    pub listen: String,
    /// Updates per second.
    #[schemars(range(min = 0.1, max = 20.0))]
    pub rate_hz: f64,
}

impl Default for PageSettings {
    fn default() -> Self {
        Self {
            listen: "127.0.0.1:8400".to_owned(),
            rate_hz: 10.0,
        }
    }
}
