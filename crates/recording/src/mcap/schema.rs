//! The messages that are written and read.

/// Type name and definition of a message.
pub struct Schema {
    pub name: &'static str,
    pub definition: &'static str,
}

/// Variance of what is not observed: large, finite (an infinite one breaks filters downstream).
pub const UNOBSERVED: f64 = 1e6;

/// See its definition.
pub const ODOMETRY: Schema = Schema {
    name: "nav_msgs/msg/Odometry",
    definition: include_str!("definitions/nav_msgs-Odometry.msg"),
};
/// See its definition.
pub const DIAGNOSTICS: Schema = Schema {
    name: "diagnostic_msgs/msg/DiagnosticArray",
    definition: include_str!("definitions/diagnostic_msgs-DiagnosticArray.msg"),
};
/// See its definition.
pub const VERDICT: Schema = Schema {
    name: "access_av_msgs/msg/AngleVerdict",
    definition: include_str!("definitions/access_av_msgs-AngleVerdict.msg"),
};
/// See its definition.
pub const TRANSFORMS: Schema = Schema {
    name: "tf2_msgs/msg/TFMessage",
    definition: include_str!("definitions/tf2_msgs-TFMessage.msg"),
};
