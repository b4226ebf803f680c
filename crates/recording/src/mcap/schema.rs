//! Schemas of the messages.

/// Type name and definition of a message.
pub struct Schema {
    pub name: &'static str,
    pub definition: &'static str,
}

/// Variance of an unobserved quantity: large but finite, because infinity breaks filters
/// downstream.
pub const UNOBSERVED: f64 = 1e6;

/// Schema of the odometry messages.
pub const ODOMETRY: Schema = Schema {
    name: "nav_msgs/msg/Odometry",
    definition: include_str!("definitions/nav_msgs-Odometry.msg"),
};
/// Schema of the diagnostic messages.
pub const DIAGNOSTICS: Schema = Schema {
    name: "diagnostic_msgs/msg/DiagnosticArray",
    definition: include_str!("definitions/diagnostic_msgs-DiagnosticArray.msg"),
};
/// Schema of the angle verdicts.
pub const VERDICT: Schema = Schema {
    name: "access_av_msgs/msg/AngleVerdict",
    definition: include_str!("definitions/access_av_msgs-AngleVerdict.msg"),
};
/// Schema of the transforms.
pub const TRANSFORMS: Schema = Schema {
    name: "tf2_msgs/msg/TFMessage",
    definition: include_str!("definitions/tf2_msgs-TFMessage.msg"),
};
