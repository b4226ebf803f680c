//! Node file.

use std::path::Path;

use onboard::settings::{Check, SettingsError, TomlFile, TomlFormat};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::outputs::{Outputs, PageSettings};
use super::samples::SampleSource;
use crate::address::Address;

/// `node.toml`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NodeSettings {
    /// Short name of the node, displayed on the web page.
    pub name: String,
    /// Speed of playback.
    #[serde(default)]
    pub pace: Pace,
    /// Samples of all antennas [default: none; angles are from `messages` or `angles`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub samples: Option<SampleSource>,
    /// Inputs of newline-delimited JSON messages: odometry, angles and initial poses.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(length(max = 16))]
    pub messages: Vec<Address>,
    /// Odometry from a file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub odometry: Option<OdometryFile>,
    /// Angles from a file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub angles: Option<AngleFile>,
    /// Whether samples between required SSBs are dropped unprocessed and the radio is switched off.
    #[serde(default = "default_true")]
    pub sleep: bool,
    /// Time without input after which a source is reported as silent, in seconds.
    #[serde(default = "half")]
    #[schemars(range(min = 0.05, max = 60.0))]
    pub silent_after_s: f64,
    /// File in which pose, calibration and excluded radio heads are saved every second and from
    /// which they are resumed at the next start [default: none]. A relative path refers to the
    /// folder of this file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub state_file: Option<String>,
    /// Outputs of poses.
    #[serde(default)]
    pub output: Outputs,
    /// Web page with metrics [default: none].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub page: Option<PageSettings>,
}

const fn default_true() -> bool {
    true
}
const fn half() -> f64 {
    0.5
}

/// Speed of playback.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Pace {
    /// Recorded speed.
    #[default]
    RealTime,
    /// Maximum speed. Requires that all input comes from files, or as messages from one file or
    /// standard input.
    Fast,
}

/// `[odometry]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OdometryFile {
    /// CSV file, MCAP file or folder of a rosbag2, relative to the folder of this file.
    pub file: String,
    /// Topic of the odometry in a bag with several.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub topic: Option<String>,
    /// Topic of the IMU with the yaw rate [default: yaw rate of the odometry].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub imu_topic: Option<String>,
}

/// `[angles]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AngleFile {
    /// CSV file, or MCAP file or folder of a rosbag2 with verdicts that a node recorded, relative
    /// to the folder of this file.
    pub file: String,
    /// Topic of the verdicts [default: all].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub topic: Option<String>,
}

impl NodeSettings {
    /// Whether all input comes from files.
    pub fn is_playback(&self) -> bool {
        let from_file = |it: &SampleSource| matches!(it, SampleSource::Sigmf { .. });
        self.messages.is_empty() && self.samples.as_ref().is_none_or(from_file)
    }

    /// Whether inputs wait until they are processed, because they do not arrive in real time.
    /// Otherwise, inputs that cannot be processed in time are dropped.
    pub fn waits(&self) -> bool {
        self.is_playback() || self.pace == Pace::Fast
    }

    /// Whether all input consists of messages from one file or standard input, which are in order.
    fn is_one_file_of_messages(&self) -> bool {
        let nothing_else =
            self.samples.is_none() && self.odometry.is_none() && self.angles.is_none();
        nothing_else && matches!(&self.messages[..], [Address::Standard | Address::File(_)])
    }

    /// Makes the input paths relative to the folder of `origin`.
    #[must_use]
    pub fn relative_to(mut self, origin: &str) -> Self {
        let folder = Path::new(origin).parent().unwrap_or(Path::new(""));
        let place = |name: &mut String| *name = folder.join(&*name).display().to_string();
        if let Some(SampleSource::Sigmf { recording, .. }) = &mut self.samples {
            place(recording);
        }
        if let Some(file) = &mut self.state_file {
            place(file);
        }
        if let Some(odometry) = &mut self.odometry {
            place(&mut odometry.file);
        }
        if let Some(angles) = &mut self.angles {
            place(&mut angles.file);
        }
        self
    }
}

impl TomlFile for NodeSettings {
    const WHAT: &'static str = "node";
    const SHIPPED: &'static [(&'static str, &'static str)] = &[];

    fn format() -> &'static TomlFormat<Self> {
        static FORMAT: TomlFormat<NodeSettings> = TomlFormat::new();
        &FORMAT
    }

    fn name(&self) -> &str {
        &self.name
    }

    fn check(&self, check: Check<'_>) -> Result<(), SettingsError> {
        let has_radio =
            self.samples.is_some() || self.angles.is_some() || !self.messages.is_empty();
        check.that(
            has_radio,
            "samples",
            "missing",
            "add [samples], [angles], or messages with angles",
        )?;
        check.that(
            self.samples.is_none() || self.angles.is_none(),
            "angles.file",
            "given together with [samples]",
            "angles must come from only one of them",
        )?;
        check.that(
            self.odometry.is_some() || !self.messages.is_empty(),
            "odometry",
            "missing",
            "add [odometry] with a file, or messages with odometry",
        )?;
        check.that(
            self.pace == Pace::RealTime || self.is_playback() || self.is_one_file_of_messages(),
            "pace",
            "fast",
            "only files can be played faster than recorded: remove all messages and use at most \
             the samples of a recording, or use the messages of one file or of `-` as the only \
             input",
        )?;
        check.that(
            self.state_file.is_none() || !self.is_playback(),
            "state_file",
            self.state_file.as_deref().unwrap_or_default(),
            "remove it, because all inputs are files, and a playback is never resumed",
        )?;
        if let Some(SampleSource::Zeromq { endpoints, .. }) = &self.samples {
            for (index, endpoint) in endpoints.iter().enumerate() {
                let key = format!("samples.endpoints[{index}]");
                let good = matches!(endpoint, Address::Tcp(_));
                check.that(good, &key, endpoint, "it must be tcp://HOST:PORT")?;
            }
        }
        if let Some(SampleSource::Raw { address, .. }) = &self.samples {
            let good = !matches!(address, Address::Udp(_));
            let allowed = "lost samples would not be detected: use TCP, Unix or `-`";
            check.that(good, "samples.address", address, allowed)?;
        }
        if let Some(json) = &self.output.json {
            let good = matches!(
                json.address,
                Address::Standard | Address::File(_) | Address::TcpListen(_) | Address::Udp(_)
            );
            let allowed = "it must be `-`, tcp-listen://, udp:// or a path";
            check.that(good, "output.json.address", &json.address, allowed)?;
        }
        let standard = |it: &Address| *it == Address::Standard;
        let samples = match &self.samples {
            Some(SampleSource::Raw { address, .. }) => usize::from(standard(address)),
            _ => 0,
        };
        let readers = samples + self.messages.iter().filter(|it| standard(it)).count();
        let allowed = "only one input can read standard input";
        check.that(readers <= 1, "messages", "-", allowed)?;
        if let Some(stream) = self.samples.as_ref().and_then(SampleSource::stream) {
            let mut sorted = stream.antennas.clone();
            sorted.sort_unstable();
            let each_once = (0..)
                .zip(&sorted)
                .all(|(k, antenna): (u8, _)| k == *antenna);
            check.that(
                each_once,
                "samples.stream.antennas",
                format!("{:?}", stream.antennas),
                "each antenna must occur once, with numbers from 0",
            )?;
            if let Some(SampleSource::Zeromq { endpoints, .. }) = &self.samples {
                check.that(
                    endpoints.len() == stream.antennas.len(),
                    "samples.endpoints",
                    format!("a list of {}", endpoints.len()),
                    "each of samples.stream.antennas needs one endpoint",
                )?;
            }
        }
        Ok(())
    }
}
