//! What comes of the drive, item by item.

use onboard::live::{HeadStatus, LiveEnergy, Outcome, Status};
use serde::Serialize;
use serde_json::{Value, json};

use crate::inbox::Level;

/// What a pose came by.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum By {
    /// Odometry: one for each sample.
    Odometry,
    /// The angles of a burst.
    Angles,
}

/// A pose and all that goes with it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoseRecord {
    /// How the vehicle stands.
    pub status: Status,
    /// What the pose came by.
    pub by: By,
}

/// What a sink is given.
#[derive(Debug, Clone, PartialEq)]
pub enum Record {
    /// A pose.
    Pose(PoseRecord),
    /// What became of an angle.
    Verdict(Outcome),
    /// How everything stands, once a second.
    Status {
        /// State, pose and why.
        status: Status,
        /// The radio heads.
        heads: Vec<HeadStatus>,
        /// What was done, and its energy.
        energy: LiveEnergy,
        /// Time of the drive (s).
        time_s: f64,
    },
    /// Something somebody should know.
    Event {
        /// Time of the drive (s), once there is one.
        time_s: Option<f64>,
        /// How serious it is.
        level: Level,
        /// Which part it is of.
        source: &'static str,
        /// What it is.
        text: String,
    },
}

impl Record {
    /// As one JSON object.
    pub fn to_json(&self) -> Value {
        match self {
            Self::Pose(PoseRecord { status, by }) => {
                let mut value = status_json(status);
                value["type"] = json!("pose");
                value["by"] = json!(by);
                value
            }
            Self::Verdict(outcome) => {
                let (execution, verdict) = (&outcome.execution, &outcome.execution.verdict);
                json!({
                    "type": "verdict",
                    "time_s": execution.ssb.time_s,
                    "pci": execution.ssb.pci,
                    "ssb_index": execution.ssb.ssb_index,
                    "snr_db": execution.ssb.snr_db,
                    "phase_rad": execution.measured.map(|it| it.phase_rad),
                    "phase_sigma_rad": execution.measured.map(|it| it.phase_sigma_rad),
                    "accepted": verdict.accepted,
                    "reason": verdict.reason.name(),
                    "mahalanobis_squared": verdict.mahalanobis_squared,
                    "threshold": verdict.threshold,
                    "residual_rad": outcome.residual_rad,
                })
            }
            Self::Status {
                status,
                heads,
                energy,
                time_s,
            } => {
                let mut value = status_json(status);
                value["type"] = json!("status");
                value["now_s"] = json!(time_s);
                value["what_to_do"] = json!(status.reason.what_to_do());
                value["heads"] = heads.iter().map(|it| head_json(it, *time_s)).collect();
                value["energy"] = energy_json(energy);
                value
            }
            Self::Event {
                time_s,
                level,
                source,
                text,
            } => json!({
                "type": "event", "time_s": time_s, "level": level, "source": source, "text": text,
            }),
        }
    }
}

/// A status as JSON; what is not known is null.
pub fn status_json(status: &Status) -> Value {
    let pose = status.pose;
    json!({
        "time_s": status.time_s,
        "x_m": pose.map(|it| it.x_m),
        "y_m": pose.map(|it| it.y_m),
        "heading_rad": pose.map(|it| it.heading_rad),
        "covariance": status.covariance,
        "speed_mps": status.speed_mps,
        "yaw_rate_radps": status.yaw_rate_radps,
        "state": status.state.name(),
        "reason": status.reason.to_string(),
        "protection_level_m": status.protection_level_m.filter(|it| it.is_finite()),
        "last_angle_s": status.last_angle_s,
        "tracked": status.tracked,
    })
}

/// A radio head as JSON.
pub fn head_json(status: &HeadStatus, now_s: f64) -> Value {
    json!({
        "pci": status.head.pci,
        "ssb_index": status.head.ssb_index,
        "snr_db": status.snr_db,
        "residual_rad": status.residual_rad,
        "heard_age_s": status.last_heard_s.map(|it| (now_s - it).max(0.0)),
        "accepted_age_s": status.last_accepted_s.map(|it| (now_s - it).max(0.0)),
        "accepted": status.accepted,
        "refused": status.refused,
        "faulty": status.is_faulty,
        "excluded": status.is_excluded,
    })
}

/// What was done and what it took, as JSON.
pub fn energy_json(energy: &LiveEnergy) -> Value {
    json!({
        "duration_s": energy.duration_s,
        "executions": energy.executions,
        "listened": energy.listened,
        "on_time_s": energy.on_time_s,
        "total_j": energy.energy.map(|it| it.total_j()),
        "executions_j": energy.energy.map(|it| it.executions_j),
        "listening_j": energy.energy.map(|it| it.listening_j),
        "idle_j": energy.energy.map(|it| it.idle_j),
        "boundary": energy.boundary.map(|it| it.to_string()),
    })
}
