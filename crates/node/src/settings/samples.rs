//! Where samples come from.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::address::Address;

/// How a complex sample stands in a stream, little-endian, real part first. Full scale of integers is one.
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
    /// A recording, played back.
    Sigmf {
        /// Its name, with or without `.sigmf-meta`; a path counts from this file.
        recording: String,
        /// Time of its first sample by the odometry's clock, in seconds.
        #[serde(default)]
        start_time_s: f64,
    },
    /// Samples of all channels in turn, nothing before, between or after them.
    Raw {
        /// `-` (standard input), `tcp://`, `tcp-listen://`, `unix://`, `unix-listen://`, or the path of a file
        /// or pipe.
        address: Address,
        /// Format of a sample.
        format: SampleFormat,
        /// What the samples are.
        stream: Stream,
    },
    /// ZeroMQ as srsRAN, OCUDU and OpenAirInterface speak it: a request of one byte to the transmitter of each
    /// channel is answered by samples, as many as there are. Several channels are aligned by counting.
    Zeromq {
        /// `tcp://HOST:PORT` of each channel's transmitter.
        #[schemars(length(min = 1, max = 16))]
        endpoints: Vec<Address>,
        /// Format of a sample.
        #[serde(default = "cf32")]
        format: SampleFormat,
        /// What the samples are.
        stream: Stream,
    },
    /// A radio that SoapySDR drives; the program must be built with the feature `soapy`.
    Soapy(Radio),
}

const fn cf32() -> SampleFormat {
    SampleFormat::Cf32
}

/// A radio by SoapySDR.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Radio {
    /// Which radio, as `driver=uhd,serial=…`.
    pub device: String,
    /// Gain of every channel in dB; the radio's own choice without.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = -50.0, max = 150.0))]
    pub gain_db: Option<f64>,
    /// What the samples are.
    pub stream: Stream,
}

/// `[samples.stream]`: what the samples of a stream are. Nothing in a stream says so itself.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Stream {
    /// Million samples per second and channel.
    #[schemars(range(min = 0.1, max = 1000.0))]
    pub rate_msps: f64,
    /// Frequency that stands at 0 Hz, in MHz.
    #[schemars(range(min = 100.0, max = 100_000.0))]
    pub centre_mhz: f64,
    /// Which antenna of the vehicle's array each channel is of, from 0: `[0, 1, 2, 3]`.
    #[schemars(length(min = 1, max = 16))]
    pub antennas: Vec<u8>,
    /// Where the samples' time comes from.
    #[serde(default)]
    pub clock: Clock,
}

/// Where the time of samples comes from that carry none.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum Clock {
    /// This computer's clock when they arrive, smoothed: seconds since 1970. The odometry must use the same.
    #[default]
    Arrival,
    /// Counting alone, from this time on in seconds: for simulators.
    StartTimeS(f64),
}

impl SampleSource {
    /// What its samples are, where the settings say so; a recording says it itself.
    pub fn stream(&self) -> Option<&Stream> {
        match self {
            Self::Sigmf { .. } => None,
            Self::Raw { stream, .. } | Self::Zeromq { stream, .. } => Some(stream),
            Self::Soapy(radio) => Some(&radio.stream),
        }
    }

    /// Its name in messages.
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Sigmf { .. } => "sigmf",
            Self::Raw { .. } => "raw",
            Self::Zeromq { .. } => "zeromq",
            Self::Soapy(_) => "soapy",
        }
    }
}
