//! `node.toml`: inputs and outputs of the node.

mod node;
mod outputs;
mod samples;

pub use node::{AngleFile, NodeSettings, OdometryFile, Pace};
pub use outputs::{JsonOutput, McapOutput, MqttOutput, Outputs, PageSettings, VdaVersion};
pub use samples::{Clock, Radio, SampleFormat, SampleSource, Stream};
