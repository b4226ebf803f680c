//! Sources of samples.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::address::Address;

/// Format of a complex sample in a stream, little-endian, real part first. The full scale of
/// integers is one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum SampleFormat {
    /// Two 32-bit floats.
    #[serde(rename = "cf32_le")]
    Cf32,
    /// Two 16-bit integers.
    #[serde(rename = "ci16_le")]
    Ci16,
    /// Two 8-bit integers.
    #[serde(rename = "ci8")]
    Ci8,
}

/// `[samples]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "source", rename_all = "kebab-case", deny_unknown_fields)]
pub enum SampleSource {
    /// Recording for playback.
    Sigmf {
        /// Name of the recording, with or without `.sigmf-meta`, relative to the folder of this
        /// file.
        recording: String,
        /// Time of the first sample according to the odometry's clock, in seconds.
        #[serde(default)]
        start_time_s: f64,
    },
    /// Interleaved samples of all channels without headers.
    Raw {
        /// `-` (standard input), `tcp://`, `tcp-listen://`, `unix://`, `unix-listen://`, or the
        /// path of a file or pipe.
        address: Address,
        /// Format of a sample.
        format: SampleFormat,
        /// Description of the samples.
        stream: Stream,
    },
    /// ZeroMQ protocol of srsRAN, OCUDU and OpenAirInterface: a one-byte request to the transmitter
    /// of each channel is answered with the available samples. Several channels are aligned by
    /// counting.
    Zeromq {
        /// `tcp://HOST:PORT` of each channel's transmitter.
        #[schemars(length(min = 1, max = 16))]
        endpoints: Vec<Address>,
        /// Format of a sample.
        #[serde(default = "cf32")]
        format: SampleFormat,
        /// Description of the samples.
        stream: Stream,
    },
    /// Radio with a SoapySDR driver; requires the feature `soapy` at build time.
    Soapy(Radio),
}

const fn cf32() -> SampleFormat {
    SampleFormat::Cf32
}

/// Radio with a SoapySDR driver.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Radio {
    /// Arguments of the SoapySDR device, for example `driver=uhd,serial=…`.
    pub device: String,
    /// Gain of every channel in dB [default: the radio's choice].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = -50.0, max = 150.0))]
    pub gain_db: Option<f64>,
    /// Description of the samples.
    pub stream: Stream,
}

/// `[samples.stream]`: description of the samples of a stream, which a stream does not contain.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Stream {
    /// Sample rate in million samples per second and channel.
    #[schemars(range(min = 0.1, max = 1000.0))]
    pub rate_msps: f64,
    /// Absolute frequency at 0 Hz in the samples, in MHz.
    #[schemars(range(min = 100.0, max = 100_000.0))]
    pub centre_mhz: f64,
    /// Index of the antenna of each channel in the vehicle's array, from 0: `[0, 1, 2, 3]`.
    #[schemars(length(min = 1, max = 16))]
    pub antennas: Vec<u8>,
    /// Source of the samples' time.
    #[serde(default)]
    pub clock: Clock,
}

/// Source of the time of samples without time stamps.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum Clock {
    /// Clock of this computer at the arrival of the samples, smoothed: seconds since 1970. The
    /// odometry must use the same clock.
    #[default]
    Arrival,
    /// Sample counter, starting at this time in seconds: for simulators.
    StartTimeS(f64),
}

impl SampleSource {
    /// Returns the description of the samples; `None` for a recording, which contains it.
    pub fn stream(&self) -> Option<&Stream> {
        match self {
            Self::Sigmf { .. } => None,
            Self::Raw { stream, .. } | Self::Zeromq { stream, .. } => Some(stream),
            Self::Soapy(radio) => Some(&radio.stream),
        }
    }

    /// Returns the name of the source in messages.
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Sigmf { .. } => "sigmf",
            Self::Raw { .. } => "raw",
            Self::Zeromq { .. } => "zeromq",
            Self::Soapy(_) => "soapy",
        }
    }
}
