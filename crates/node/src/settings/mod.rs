//! `node.toml`: what comes from where and goes whereto.

mod node;
mod outputs;
mod samples;

pub use node::{AngleFile, NodeSettings, OdometryFile, Pace};
pub use outputs::{JsonOutput, McapOutput, MqttOutput, Outputs, PageSettings, VdaVersion};
pub use samples::{Clock, Radio, SampleFormat, SampleSource, Stream};
