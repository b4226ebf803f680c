//! The position object of VDA 5050.

use onboard::live::{State, Status};
use serde_json::{Value, json};

use crate::settings::{MqttOutput, VdaVersion};

/// Whether the vehicle is called localized. A fleet manager stops a vehicle that is not, so that neither a
/// moment's doubt nor a moment's confidence counts.
#[derive(Debug, Clone)]
pub struct Localized {
    after_s: f64,
    lost_after_s: f64,
    now: bool,
    /// Since when the state says otherwise (s).
    since_s: Option<f64>,
}

impl Localized {
    /// Not localized yet.
    pub const fn new(settings: &MqttOutput) -> Self {
        Self {
            after_s: settings.localized_after_s,
            lost_after_s: settings.lost_after_s,
            now: false,
            since_s: None,
        }
    }

    /// Whether it is, now that the state is this.
    pub fn judge(&mut self, state: State, time_s: f64) -> bool {
        let says = state.is_localized();
        if says == self.now {
            self.since_s = None;
            return self.now;
        }
        let since_s = *self.since_s.get_or_insert(time_s);
        let wait_s = if says {
            self.after_s
        } else {
            self.lost_after_s
        };
        if time_s - since_s >= wait_s {
            (self.now, self.since_s) = (says, None);
        }
        self.now
    }
}

/// `agvPosition` (2.1) or `mobileRobotPosition` (3.0); `None` where there is no pose at all.
pub fn position(status: &Status, localized: bool, settings: &MqttOutput) -> Option<Value> {
    let pose = status.pose?;
    let theta = pose.heading_rad;
    let mut object =
        json!({"x": pose.x_m, "y": pose.y_m, "theta": theta, "mapId": settings.map_id});
    let name = match settings.vda5050 {
        VdaVersion::V2 => "positionInitialized",
        VdaVersion::V3 => "localized",
    };
    object[name] = json!(localized);
    if let Some(level_m) = status.protection_level_m.filter(|it| it.is_finite()) {
        object["deviationRange"] = json!(level_m);
    }
    Some(object)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neither_a_moments_doubt_nor_a_moments_confidence_counts() {
        let settings = MqttOutput {
            host: "localhost".to_owned(),
            port: 1883,
            topic: "t".to_owned(),
            vda5050: VdaVersion::V3,
            map_id: "yard".to_owned(),
            rate_hz: 1.0,
            localized_after_s: 2.0,
            lost_after_s: 0.5,
        };
        let mut localized = Localized::new(&settings);
        let mut judge = |state, time_s| localized.judge(state, time_s);
        assert!(!judge(State::Ok, 0.0));
        assert!(!judge(State::Lost, 1.0));
        assert!(!judge(State::Ok, 1.5));
        assert!(!judge(State::Degraded, 3.4));
        assert!(judge(State::Ok, 3.5));
        assert!(judge(State::Unavailable, 4.0));
        assert!(judge(State::Ok, 4.4));
        assert!(judge(State::Lost, 5.0));
        assert!(!judge(State::Lost, 5.5));
    }
}
