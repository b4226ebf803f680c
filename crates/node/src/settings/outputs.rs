//! Where poses go.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::address::Address;

/// `[output]`
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Outputs {
    /// Everything as newline JSON.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub json: Option<JsonOutput>,
    /// Poses as a TUM trajectory, in this file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tum: Option<PathBuf>,
    /// MCAP files for ROS 2 tools.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mcap: Option<McapOutput>,
    /// The pose to a fleet's MQTT broker, as VDA 5050 has it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mqtt: Option<MqttOutput>,
}

/// `[output.json]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct JsonOutput {
    /// `-` (standard output), `tcp-listen://` (whoever connects is told), `udp://`, or the path of a file.
    pub address: Address,
    /// Poses per second at most.
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
    /// Folder that the files are made in.
    pub folder: PathBuf,
    /// Poses and transforms per second at most.
    #[serde(default = "five")]
    #[schemars(range(min = 0.1, max = 1000.0))]
    pub pose_hz: f64,
    /// Verdicts on angles per second and radio head at most.
    #[serde(default = "one")]
    #[schemars(range(min = 0.0, max = 10_000.0))]
    pub verdict_hz: f64,
    /// Size in MB at which the next file is begun.
    #[serde(default = "hundred")]
    #[schemars(range(min = 0.1, max = 100_000.0))]
    pub rotate_mb: f64,
    /// Time in seconds after which the next file is begun.
    #[serde(default = "hour")]
    #[schemars(range(min = 1.0, max = 1e6))]
    pub rotate_s: f64,
    /// Files kept; the oldest is removed beyond. All without.
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

/// Which VDA 5050.
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
    /// Its port.
    #[serde(default = "mqtt_port")]
    pub port: u16,
    /// Topic that the position object is published to.
    pub topic: String,
    /// Which VDA 5050.
    #[serde(default)]
    pub vda5050: VdaVersion,
    /// `mapId` of the position.
    pub map_id: String,
    /// Messages per second.
    #[serde(default = "one")]
    #[schemars(range(min = 0.1, max = 30.0))]
    pub rate_hz: f64,
    /// How long the pose must have been one to rely on before it is called localized, in seconds.
    #[serde(default = "one")]
    #[schemars(range(min = 0.0, max = 600.0))]
    pub localized_after_s: f64,
    /// How long it must not have been one before it is no longer called localized, in seconds: a fleet manager
    /// stops the vehicle then.
    #[serde(default = "one")]
    #[schemars(range(min = 0.0, max = 600.0))]
    pub lost_after_s: f64,
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
    /// Address and port it is served at; port 0 is any that is free.
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
