//! Messages of the JSON output, their JSON Schema and their reference page.

use std::fmt::Write;

use onboard::live::{AngleRecord, HeadStatus, LiveEnergy, State, Status};
use onboard::localize::SelectedHypothesis;
use onboard::monitor::ActiveFault;
use schemars::{JsonSchema, SchemaGenerator};
use serde::Serialize;
use serde_json::Value;

use super::record::{PoseCause, PoseRecord, Record};
use super::vda5050::VdaPosition;
use crate::health::OutputStatus;
use crate::inbox::Level;

/// Returns the names of all states.
fn state_names() -> Vec<&'static str> {
    State::ALL.iter().map(|it| it.name()).collect()
}

/// Returns the names of all selected hypotheses, and null.
fn hypothesis_names() -> Vec<Option<&'static str>> {
    let names = SelectedHypothesis::ALL.iter().map(|it| Some(it.name()));
    names.chain([None]).collect()
}

/// Pose, state and reason at one time.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct PoseFields {
    /// Time of the pose in seconds, by the clock of the odometry.
    pub time_s: f64,
    /// Position along the map's x axis in metres; null before any odometry.
    pub x_m: Option<f64>,
    /// Position along the map's y axis in metres; null before any odometry.
    pub y_m: Option<f64>,
    /// Heading in radians from −π to π, counter-clockwise from the map's x axis; null before any odometry.
    #[schemars(range(min = -std::f64::consts::PI, max = std::f64::consts::PI))]
    pub heading_rad: Option<f64>,
    /// Covariance of x, y and heading, row by row, in m², m·rad and rad²; null while it is unknown.
    pub covariance: Option<[[f64; 3]; 3]>,
    /// Speed along the forward axis in metres per second, by odometry.
    pub speed_mps: f64,
    /// Yaw rate in radians per second, counter-clockwise; null without a sensor for it.
    pub yaw_rate_radps: Option<f64>,
    /// State of the pose, as defined in docs/live.md and docs/integrity.md.
    #[schemars(extend("enum" = state_names()))]
    pub state: &'static str,
    /// Reason for the state.
    pub reason: String,
    /// Horizontal protection level in metres; null while the vehicle is not monitored or has no pose.
    #[schemars(range(min = 0.0))]
    pub protection_level_m: Option<f64>,
    /// Hypothesis that explains the measurements best, and whose position is reported; null while the vehicle is not
    /// monitored or has no pose. The state does not depend on it.
    #[schemars(extend("enum" = hypothesis_names()))]
    pub selected_hypothesis: Option<&'static str>,
    /// Time of the last accepted angle in seconds; null before the first.
    pub last_angle_s: Option<f64>,
    /// Number of SSBs that the receiver tracks.
    pub tracked: usize,
    /// Strongest tones that are subtracted from the samples.
    pub tones: Vec<ToneMessage>,
    /// Active faults of odometry and receive channels.
    pub faults: Vec<FaultMessage>,
}

/// DC offset of the receiver, a spurious tone, or another carrier.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(extend("additionalProperties" = false))]
pub struct ToneMessage {
    /// Frequency in Hz.
    pub frequency_hz: f64,
    /// Power in dB relative to a tone of amplitude 1.
    pub power_dbfs: f64,
}

/// An active fault.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(extend("additionalProperties" = false))]
pub struct FaultMessage {
    /// Name of the fault.
    pub fault: &'static str,
    /// Numbers of the receive channels from 0; empty for the odometry.
    pub subject: String,
    /// Description.
    pub description: String,
    /// Time of the detection in seconds.
    pub since_s: f64,
}

impl From<&ActiveFault> for FaultMessage {
    fn from(active: &ActiveFault) -> Self {
        Self {
            fault: active.fault.name(),
            subject: active.fault.subject(),
            description: active.fault.to_string(),
            since_s: active.since_s,
        }
    }
}

impl From<&Status> for PoseFields {
    fn from(status: &Status) -> Self {
        let pose = status.pose;
        Self {
            time_s: status.time_s,
            x_m: pose.map(|it| it.x_m),
            y_m: pose.map(|it| it.y_m),
            heading_rad: pose.map(|it| it.heading_rad),
            covariance: status.covariance,
            speed_mps: status.speed_mps,
            yaw_rate_radps: status.yaw_rate_radps,
            state: status.state.name(),
            reason: status.reason.to_string(),
            protection_level_m: status.protection_level_m.filter(|it| it.is_finite()),
            selected_hypothesis: status.selected_hypothesis.map(SelectedHypothesis::name),
            last_angle_s: status.last_angle_s,
            tracked: status.tracked,
            tones: (status.tones.iter().flatten())
                .map(|it| ToneMessage {
                    frequency_hz: it.frequency_hz,
                    power_dbfs: it.power_dbfs,
                })
                .collect(),
            faults: status.faults.iter().map(FaultMessage::from).collect(),
        }
    }
}

/// A pose: one for each odometry sample, and one for each burst with an angle.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(extend("additionalProperties" = false))]
pub struct PoseMessage {
    /// Type of the message: `pose`.
    #[serde(rename = "type")]
    #[schemars(extend("const" = "pose"))]
    pub kind: &'static str,
    /// Cause of the pose.
    pub by: PoseCause,
    /// Pose, state and reason.
    #[serde(flatten)]
    pub pose: PoseFields,
}

/// The result of the localizer for one angle.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(extend("additionalProperties" = false))]
pub struct VerdictMessage {
    /// Type of the message: `verdict`.
    #[serde(rename = "type")]
    #[schemars(extend("const" = "verdict"))]
    pub kind: &'static str,
    /// Time of the SSB in seconds.
    pub time_s: f64,
    /// Physical cell identity.
    #[schemars(range(min = 0, max = 1007))]
    pub pci: u16,
    /// SSB index within the burst.
    #[schemars(range(min = 0, max = 63))]
    pub ssb_index: u8,
    /// SNR of the SSB in dB.
    pub snr_db: f64,
    /// Measured electrical angle in radians; null if no angle was estimated.
    pub phase_rad: Option<f64>,
    /// Standard deviation of the electrical angle in radians; null if no angle was estimated.
    pub phase_sigma_rad: Option<f64>,
    /// Whether the localizer accepted the angle.
    pub accepted: bool,
    /// Reason for the verdict.
    pub reason: &'static str,
    /// Squared Mahalanobis distance of the innovation; null if it was not computed.
    pub mahalanobis_squared: Option<f64>,
    /// Gate for the squared Mahalanobis distance; null if it was not applied.
    pub threshold: Option<f64>,
    /// Measured minus predicted electrical angle in radians; null if no angle was estimated.
    pub residual_rad: Option<f64>,
}

impl From<&AngleRecord> for VerdictMessage {
    fn from(outcome: &AngleRecord) -> Self {
        let (angle_result, verdict) = (&outcome.angle_result, &outcome.angle_result.verdict);
        Self {
            kind: "verdict",
            time_s: angle_result.ssb.time_s,
            pci: angle_result.ssb.pci,
            ssb_index: angle_result.ssb.ssb_index,
            snr_db: angle_result.ssb.snr_db,
            phase_rad: angle_result.measured.map(|it| it.phase_rad),
            phase_sigma_rad: angle_result.measured.map(|it| it.phase_sigma_rad),
            accepted: verdict.accepted,
            reason: verdict.reason.name(),
            mahalanobis_squared: verdict.mahalanobis_squared.filter(|it| it.is_finite()),
            threshold: verdict.threshold.filter(|it| it.is_finite()),
            residual_rad: outcome.residual_rad,
        }
    }
}

/// State of the whole node, once a second.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(extend("additionalProperties" = false))]
pub struct StatusMessage {
    /// Type of the message: `status`.
    #[serde(rename = "type")]
    #[schemars(extend("const" = "status"))]
    pub kind: &'static str,
    /// Current time in seconds, by the clock of the odometry.
    pub now_s: f64,
    /// Pose, state and reason.
    #[serde(flatten)]
    pub pose: PoseFields,
    /// Recommended action for the reason.
    pub what_to_do: &'static str,
    /// The radio heads of the site.
    pub heads: Vec<HeadMessage>,
    /// Number of operations and their energy.
    pub energy: EnergyMessage,
    /// Health of the outputs.
    pub outputs: Vec<OutputStatus>,
}

/// One radio head.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(extend("additionalProperties" = false))]
pub struct HeadMessage {
    /// Physical cell identity.
    #[schemars(range(min = 0, max = 1007))]
    pub pci: u16,
    /// SSB index within the burst.
    #[schemars(range(min = 0, max = 63))]
    pub ssb_index: u8,
    /// SNR of the last SSB in dB; null before the first.
    pub snr_db: Option<f64>,
    /// Measured minus predicted electrical angle of the last SSB in radians; null before the first.
    pub residual_rad: Option<f64>,
    /// Age of the last received SSB in seconds; null before the first.
    #[schemars(range(min = 0.0))]
    pub angle_age_s: Option<f64>,
    /// Age of the last accepted angle in seconds; null before the first.
    #[schemars(range(min = 0.0))]
    pub accepted_age_s: Option<f64>,
    /// Number of accepted angles since the start of the drive.
    pub accepted: u64,
    /// Number of rejected angles since the start of the drive.
    pub refused: u64,
    /// Whether the integrity monitor has identified the radio head as faulty.
    pub faulty: bool,
    /// Whether the radio head was excluded by a message.
    pub excluded: bool,
}

impl HeadMessage {
    /// Creates the message of a radio head at the time `now_s`.
    pub fn new(status: &HeadStatus, now_s: f64) -> Self {
        let age_s = |since_s: Option<f64>| since_s.map(|it| (now_s - it).max(0.0));
        Self {
            pci: status.head.pci,
            ssb_index: status.head.ssb_index,
            snr_db: status.snr_db,
            residual_rad: status.residual_rad,
            angle_age_s: age_s(status.last_angle_s),
            accepted_age_s: age_s(status.last_accepted_s),
            accepted: status.accepted,
            refused: status.refused,
            faulty: status.is_faulty,
            excluded: status.is_excluded,
        }
    }
}

/// Number of operations and their energy since the start of the drive.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(extend("additionalProperties" = false))]
pub struct EnergyMessage {
    /// Duration of the drive in seconds.
    pub duration_s: f64,
    /// Number of estimated angles.
    pub aoa_estimates: u64,
    /// Number of received bursts.
    pub bursts_received: u64,
    /// Time that the receiver was on, in seconds.
    pub on_time_s: f64,
    /// Total energy in joules; null if the platform has no energy model.
    pub total_j: Option<f64>,
    /// Energy of angle estimation in joules; null without an energy model.
    pub aoa_estimates_j: Option<f64>,
    /// Energy of reception in joules; null without an energy model.
    pub listening_j: Option<f64>,
    /// Energy of idle time in joules; null without an energy model.
    pub idle_j: Option<f64>,
    /// Boundary of the energy figures; null without an energy model.
    pub boundary: Option<String>,
}

impl From<&LiveEnergy> for EnergyMessage {
    fn from(energy: &LiveEnergy) -> Self {
        Self {
            duration_s: energy.duration_s,
            aoa_estimates: energy.aoa_estimates as u64,
            bursts_received: energy.bursts_received as u64,
            on_time_s: energy.on_time_s,
            total_j: energy.energy.map(|it| it.total_j()),
            aoa_estimates_j: energy.energy.map(|it| it.aoa_estimates_j),
            listening_j: energy.energy.map(|it| it.listening_j),
            idle_j: energy.energy.map(|it| it.idle_j),
            boundary: energy.boundary.map(|it| it.to_string()),
        }
    }
}

/// An event of the node.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(extend("additionalProperties" = false))]
pub struct EventMessage {
    /// Type of the message: `event`.
    #[serde(rename = "type")]
    #[schemars(extend("const" = "event"))]
    pub kind: &'static str,
    /// Time of the drive in seconds; null before the first input.
    pub time_s: Option<f64>,
    /// Severity.
    pub level: Level,
    /// Part of the node that reports, such as an input or output.
    pub source: &'static str,
    /// Description.
    pub text: String,
    /// Number of occurrences of this cause since its last event.
    #[schemars(range(min = 1))]
    pub count: u64,
}

/// One line of the JSON output.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum Message {
    /// A pose.
    Pose(PoseMessage),
    /// The result for one angle.
    Verdict(VerdictMessage),
    /// State of the node.
    Status(Box<StatusMessage>),
    /// An event.
    Event(EventMessage),
}

impl From<&Record> for Message {
    fn from(record: &Record) -> Self {
        match record {
            Record::Pose(PoseRecord { status, by }) => Self::Pose(PoseMessage {
                kind: "pose",
                by: *by,
                pose: status.into(),
            }),
            Record::Verdict(outcome) => Self::Verdict(outcome.into()),
            Record::Status {
                status,
                heads,
                energy,
                outputs,
                time_s,
            } => Self::Status(Box::new(StatusMessage {
                kind: "status",
                now_s: *time_s,
                pose: status.into(),
                what_to_do: status.reason.what_to_do(),
                heads: heads
                    .iter()
                    .map(|it| HeadMessage::new(it, *time_s))
                    .collect(),
                energy: energy.into(),
                outputs: outputs.clone(),
            })),
            Record::Event {
                time_s,
                level,
                source,
                text,
                count,
            } => Self::Event(EventMessage {
                kind: "event",
                time_s: *time_s,
                level: *level,
                source,
                text: text.clone(),
                count: *count,
            }),
        }
    }
}

/// Any message of an output: a line of `[output.json]`, or a message of `[output.mqtt]`.
#[derive(Serialize, JsonSchema)]
#[serde(untagged)]
#[allow(dead_code, reason = "only its schema is used")]
enum Output {
    Line(Box<Message>),
    Position(VdaPosition),
}

/// Returns the JSON Schema of all messages. Its definitions `PoseMessage`, `VerdictMessage`, `StatusMessage`,
/// `EventMessage`, `MobileRobotPosition` and `AgvPosition` are the schemas of one type each.
pub fn schema() -> Value {
    let mut schema = SchemaGenerator::default()
        .into_root_schema_for::<Output>()
        .to_value();
    schema["title"] = Value::from("Messages of access-av-node");
    schema
}

/// Types on the reference page, in this order.
const PAGE: [(&str, &str); 10] = [
    ("PoseMessage", "`pose`"),
    ("VerdictMessage", "`verdict`"),
    ("StatusMessage", "`status`"),
    ("EventMessage", "`event`"),
    ("FaultMessage", "Items of `faults`"),
    ("ToneMessage", "Items of `tones`"),
    ("HeadMessage", "Items of `heads`"),
    ("EnergyMessage", "`energy`"),
    ("OutputStatus", "Items of `outputs`"),
    ("MobileRobotPosition", "VDA 5050 3.0: `mobileRobotPosition`"),
];

/// Returns the reference page of all messages, in Markdown.
pub fn reference() -> String {
    let schema = schema();
    let mut page = String::from(
        "# Messages of access-av-node\n\n\
         This page is generated by `access-av-node schema --outputs --markdown`. `access-av-node schema --outputs` \
         prints the same as JSON Schema.\n\n\
         Every line of `[output.json]` is one object of the first four types. A value that is not known is null. `[output.mqtt]` publishes a position of VDA 5050.\n",
    );
    for (name, title) in PAGE {
        let definition = &schema["$defs"][name];
        let description = definition["description"].as_str().unwrap_or_default();
        let text = one_line(description);
        // Writing into a string does not fail.
        let _ = writeln!(page, "\n## {title}\n\n{text}\n");
        page += "| field | type | description |\n|---|---|---|\n";
        let properties = definition["properties"].as_object();
        for (field, property) in properties.into_iter().flatten() {
            let text = property["description"].as_str().unwrap_or_default();
            let (kind, text) = (type_text(property, &schema), one_line(text));
            let _ = writeln!(page, "| `{field}` | {kind} | {text} |");
        }
    }
    page += "\n## VDA 5050 2.1: `agvPosition`\n\nAs `mobileRobotPosition`, with `positionInitialized` in place of \
             `localized`.\n";
    page
}

fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Returns the JSON types and the allowed values of a property in words.
fn type_text(property: &Value, schema: &Value) -> String {
    let reference = |it: &Value| it["$ref"].as_str().map(|it| it.replace("#/$defs/", ""));
    if let Some(name) = reference(property) {
        let values = enumeration(&schema["$defs"][&name]);
        return values.unwrap_or_else(|| "object".to_owned());
    }
    if let Some(values) = enumeration(property) {
        return values;
    }
    let of = |it: &Value| it.as_str().unwrap_or_default().to_owned();
    let types = match &property["type"] {
        Value::Array(several) => several.iter().map(of).collect::<Vec<_>>().join(" or "),
        one => of(one),
    };
    match (property.get("minimum"), property.get("maximum")) {
        (Some(min), Some(max)) => format!("{types}, {} to {}", short(min), short(max)),
        (Some(min), None) => format!("{types}, at least {}", short(min)),
        _ => types,
    }
}

fn short(number: &Value) -> String {
    let value = number.as_f64().unwrap_or_default();
    let text = format!("{value:.3}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// Returns the values of an enumeration or constant.
fn enumeration(schema: &Value) -> Option<String> {
    let quoted = |it: &Value| {
        let null = it.is_null().then(|| "null".to_owned());
        it.as_str().map(|it| format!("`{it}`")).or(null)
    };
    if let Some(value) = schema.get("const") {
        return quoted(value);
    }
    let constants = |all: &Value| -> Vec<String> {
        let all = all.as_array().into_iter().flatten();
        all.filter_map(|it| quoted(it.get("const").unwrap_or(it)))
            .collect()
    };
    let values = [constants(&schema["enum"]), constants(&schema["oneOf"])].concat();
    (!values.is_empty()).then(|| values.join(", "))
}
