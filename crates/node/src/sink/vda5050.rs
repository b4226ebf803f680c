//! The position object of VDA 5050.

use onboard::geometry::{Pose, wrap_angle};
use onboard::live::{State, Status};
use schemars::JsonSchema;
use serde::Serialize;

use crate::clock::unix_s;
use crate::settings::{MqttOutput, VdaVersion};

/// Decides whether the vehicle is reported as localized.
///
/// The result becomes true when the pose has been valid for `localized_after_s`. It becomes false
/// immediately when the pose is not valid, so that the fleet manager stops the vehicle. A pose is
/// valid while its protection level is at most the alert limit.
#[derive(Debug, Clone)]
pub struct Localized {
    after_s: f64,
    alert_limit_m: f64,
    /// Start of the valid poses (s).
    valid_since_s: Option<f64>,
}

impl Localized {
    /// Creates the state of a vehicle that is not localized.
    pub const fn new(settings: &MqttOutput, alert_limit_m: f64) -> Self {
        Self {
            after_s: settings.localized_after_s,
            alert_limit_m,
            valid_since_s: None,
        }
    }

    /// Returns whether the vehicle is localized, given its newest status.
    pub fn is_localized(&mut self, status: &Status) -> bool {
        let level_m = status.protection_level_m;
        let is_within = level_m.is_some_and(|it| it <= self.alert_limit_m);
        let is_valid = match status.state {
            State::Ok | State::Degraded => is_within,
            // The pose is not monitored, and no protection level contradicts it.
            State::Unmonitored => level_m.is_none_or(|_| is_within),
            State::Waiting | State::Searching | State::Lost | State::Unavailable => false,
        };
        if !is_valid || status.pose.is_none() {
            self.reset();
            return false;
        }
        let time_s = status.time_s;
        // The time decreases after a restart of the drive.
        let since_s = self.valid_since_s.filter(|it| *it <= time_s);
        let since_s = since_s.unwrap_or(time_s);
        self.valid_since_s = Some(since_s);
        time_s - since_s >= self.after_s
    }

    /// Resets the state to not localized.
    pub const fn reset(&mut self) {
        self.valid_since_s = None;
    }
}

/// Fields of a position that both versions of VDA 5050 have.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(rename_all = "camelCase")]
pub struct PositionFields {
    /// Time of publication in UTC, as in the header of a VDA 5050 message (ISO 8601).
    #[schemars(extend("format" = "date-time"))]
    pub timestamp: String,
    /// Position along the map's x axis in metres.
    pub x: f64,
    /// Position along the map's y axis in metres.
    pub y: f64,
    /// Heading in radians from −π to π, counter-clockwise from the map's x axis.
    #[schemars(range(min = -std::f64::consts::PI, max = std::f64::consts::PI))]
    pub theta: f64,
    /// Name of the map, as configured.
    pub map_id: String,
    /// Protection level in metres; absent while there is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0))]
    pub deviation_range: Option<f64>,
}

/// Position of VDA 5050 3.0: `mobileRobotPosition`, with a time stamp.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(extend("additionalProperties" = false))]
pub struct MobileRobotPosition {
    /// Whether the protection level was at most the alert limit for at least `localized_after_s`.
    pub localized: bool,
    /// The position.
    #[serde(flatten)]
    pub position: PositionFields,
}

/// Position of VDA 5050 2.1: `agvPosition`, with a time stamp.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(rename_all = "camelCase")]
#[schemars(extend("additionalProperties" = false))]
pub struct AgvPosition {
    /// Whether the protection level was at most the alert limit for at least `localized_after_s`.
    pub position_initialized: bool,
    /// The position.
    #[serde(flatten)]
    pub position: PositionFields,
}

/// Position of the configured version of VDA 5050.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum VdaPosition {
    /// Version 3.0.
    MobileRobot(MobileRobotPosition),
    /// Version 2.1.
    Agv(AgvPosition),
}

/// Returns the position object at the present time.
pub fn position(
    pose: Pose,
    protection_level_m: Option<f64>,
    localized: bool,
    settings: &MqttOutput,
) -> VdaPosition {
    let position = PositionFields {
        timestamp: utc(unix_s()),
        x: pose.x_m,
        y: pose.y_m,
        theta: wrap_angle(pose.heading_rad),
        map_id: settings.map_id.clone(),
        deviation_range: protection_level_m.filter(|it| it.is_finite()),
    };
    match settings.vda5050 {
        VdaVersion::V2 => VdaPosition::Agv(AgvPosition {
            position_initialized: localized,
            position,
        }),
        VdaVersion::V3 => VdaPosition::MobileRobot(MobileRobotPosition {
            localized,
            position,
        }),
    }
}

/// Returns a time in seconds since 1970 in UTC as ISO 8601 with milliseconds.
fn utc(since_1970_s: f64) -> String {
    let millis = (1e3 * since_1970_s).round() as u64;
    let (seconds, millis) = (millis / 1000, millis % 1000);
    let (days, second) = (seconds / 86_400, seconds % 86_400);
    // Days since 1970 to a date of the Gregorian calendar (H. Hinnant, `civil_from_days`): years of 365.2425 days
    // that begin on 1 March, in eras of 400 years.
    let shifted = days + 719_468;
    let (era, day_of_era) = (shifted / 146_097, shifted % 146_097);
    let year_of_era =
        (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let from_march = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * from_march + 2) / 5 + 1;
    let month = if from_march < 10 {
        from_march + 3
    } else {
        from_march - 9
    };
    let year = year_of_era + 400 * era + u64::from(month <= 2);
    let (hour, minute, second) = (second / 3600, second / 60 % 60, second % 60);
    format!("{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}.{millis:03}Z")
}

#[cfg(test)]
mod tests {
    use onboard::live::Reason;

    use super::*;

    fn settings() -> MqttOutput {
        MqttOutput {
            host: "localhost".to_owned(),
            port: 1883,
            topic: "t".to_owned(),
            vda5050: VdaVersion::V3,
            map_id: "yard".to_owned(),
            rate_hz: 1.0,
            localized_after_s: 2.0,
        }
    }

    fn status(state: State, protection_level_m: Option<f64>, time_s: f64) -> Status {
        Status {
            time_s,
            pose: Some(Pose::default()),
            covariance: None,
            speed_mps: 0.0,
            yaw_rate_radps: None,
            state,
            reason: Reason::Nominal,
            protection_level_m,
            selected_hypothesis: None,
            faulty: 0,
            last_angle_s: None,
            odometry_age_s: None,
            samples_age_s: None,
            tracked: 0,
            tones: [None; onboard::live::TONES],
            faults: onboard::monitor::ActiveFaults::default(),
        }
    }

    #[test]
    fn a_vehicle_is_localized_after_a_while_and_never_above_the_alert_limit() {
        let mut localized = Localized::new(&settings(), 1.5);
        let mut is_localized =
            |state, level_m, time_s| localized.is_localized(&status(state, level_m, time_s));
        assert!(!is_localized(State::Ok, Some(0.5), 0.0));
        assert!(!is_localized(State::Lost, None, 1.0));
        assert!(!is_localized(State::Ok, Some(0.5), 1.5));
        assert!(!is_localized(State::Degraded, Some(1.5), 3.4));
        assert!(is_localized(State::Ok, Some(0.5), 3.5));
        // One status above the alert limit, or unavailable, ends it at once.
        for (state, level_m) in [
            (State::Degraded, Some(1.51)),
            (State::Degraded, Some(4083.0)),
            (State::Degraded, None),
            (State::Ok, Some(f64::INFINITY)),
            (State::Ok, Some(f64::NAN)),
            (State::Unavailable, Some(0.5)),
            (State::Lost, Some(0.5)),
            (State::Searching, Some(0.5)),
        ] {
            assert!(!is_localized(state, level_m, 6.0), "{state:?} {level_m:?}");
            assert!(!is_localized(State::Ok, Some(0.5), 6.0));
            assert!(is_localized(State::Ok, Some(0.5), 8.0));
        }
        // A drive whose time goes back begins again.
        assert!(!is_localized(State::Ok, Some(0.5), 1.0));
        assert!(!is_localized(State::Unmonitored, None, 2.9));
        assert!(is_localized(State::Unmonitored, None, 3.0));
    }

    #[test]
    fn headings_beyond_half_a_turn_are_wrapped() {
        for (heading_rad, expected) in [(11.9818, -0.5846), (3.1484, -3.1348), (-4.0, 2.2832)] {
            let pose = Pose {
                heading_rad,
                ..Pose::default()
            };
            let VdaPosition::MobileRobot(found) = position(pose, None, false, &settings()) else {
                panic!("version 3.0");
            };
            let theta = found.position.theta;
            assert!((theta - expected).abs() < 1e-4, "{heading_rad}: {theta}");
        }
    }

    #[test]
    fn times_are_written_as_iso_8601() {
        // Reference values: `date -u -d @SECONDS`.
        for (seconds, expected) in [
            (0.0, "1970-01-01T00:00:00.000Z"),
            (951_782_399.5, "2000-02-28T23:59:59.500Z"),
            (951_782_400.0, "2000-02-29T00:00:00.000Z"),
            (4_107_542_400.25, "2100-03-01T00:00:00.250Z"),
            (1_795_702_362.123, "2026-11-26T14:12:42.123Z"),
        ] {
            assert_eq!(utc(seconds), expected);
        }
    }
}
