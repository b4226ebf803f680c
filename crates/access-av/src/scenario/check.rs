//! Ranges, and values that contradict each other. Types cannot say these.

use std::fmt::Display;

use super::{
    EstimatorMethod, LocalizerSettings, PidSettings, Pilots, Scenario, ScenarioError, SnrSetPoint,
    TrackSettings, WakeUpSettings,
};
use crate::geometry::Point;
use crate::observation::{ANTENNAS, MAX_SNAPSHOTS};
use crate::world::{Segment, Track, TrackError};

/// Collects nothing: the first bad value is the error.
pub(crate) struct Check<'a> {
    /// The file that errors name.
    pub file: &'a str,
}

impl Check<'_> {
    /// The error for a value that is not `allowed`.
    pub fn error(&self, key: &str, value: impl Display, allowed: &str) -> ScenarioError {
        ScenarioError::Value {
            file: self.file.to_owned(),
            key: key.to_owned(),
            value: value.to_string(),
            allowed: allowed.to_owned(),
        }
    }

    /// Refuses a value for which `good` is false.
    pub fn that(
        &self,
        good: bool,
        key: &str,
        value: impl Display,
        allowed: &str,
    ) -> Result<(), ScenarioError> {
        if good {
            Ok(())
        } else {
            Err(self.error(key, value, allowed))
        }
    }

    /// Refuses a number that is not above zero.
    pub fn positive(&self, key: &str, value: f64) -> Result<(), ScenarioError> {
        self.that(value > 0.0, key, value, "it must be above 0")
    }

    /// Refuses a negative number.
    pub fn not_negative(&self, key: &str, value: f64) -> Result<(), ScenarioError> {
        self.that(value >= 0.0, key, value, "it must not be negative")
    }

    /// Refuses a number outside of `from..=to`.
    pub fn between(&self, key: &str, value: f64, from: f64, to: f64) -> Result<(), ScenarioError> {
        let allowed = format!("it must be between {from} and {to}");
        self.that((from..=to).contains(&value), key, value, &allowed)
    }
}

impl Scenario {
    /// Refuses values out of range and values that contradict each other.
    pub(super) fn check(&self, file: &str) -> Result<(), ScenarioError> {
        let check = Check { file };
        check.that(
            !self.name.trim().is_empty(),
            "name",
            "empty",
            "a scenario needs a name",
        )?;
        let track = self.track.build(file)?;
        self.check_motion(&check, &track)?;
        self.check_radio_heads(&check, &track)?;
        self.check_radio(&check)?;
        self.check_iq(&check)?;
        self.check_vehicle(&check)?;
        for (index, fault) in self.faults.iter().enumerate() {
            fault.check(&check, index, self.radio_heads.len())?;
        }
        self.check_wake_up(&check)
    }

    fn check_motion(&self, check: &Check<'_>, track: &Track) -> Result<(), ScenarioError> {
        let motion = &self.motion;
        check.positive("motion.acceleration_mps2", motion.acceleration_mps2)?;
        check.positive("motion.top_speed_kmh", motion.top_speed_kmh)?;
        let on_the_road = (0.0..track.length_m()).contains(&motion.start_at_m);
        let allowed = format!(
            "it must be on the road, from 0 to {:.1} m",
            track.length_m()
        );
        check.that(
            on_the_road,
            "motion.start_at_m",
            motion.start_at_m,
            &allowed,
        )?;
        check.not_negative("motion.lateral_wander.rms_m", motion.lateral_wander.rms_m)?;
        check.positive(
            "motion.lateral_wander.wavelength_m",
            motion.lateral_wander.wavelength_m,
        )?;
        check.between(
            "motion.lateral_wander.damping",
            motion.lateral_wander.damping,
            0.01,
            0.99,
        )?;
        let mut before_m = 0.0;
        for (index, stop) in motion.stops.iter().enumerate() {
            let key = format!("motion.stops[{index}]");
            let allowed = format!(
                "stops must be in driving order and on the track, here between {before_m} and {:.1} m",
                track.length_m()
            );
            let on_the_way = stop.at_m > before_m && stop.at_m < track.length_m();
            check.that(on_the_way, &format!("{key}.at_m"), stop.at_m, &allowed)?;
            check.not_negative(&format!("{key}.dwell_s"), stop.dwell_s)?;
            before_m = stop.at_m;
        }
        Ok(())
    }

    fn check_radio_heads(&self, check: &Check<'_>, track: &Track) -> Result<(), ScenarioError> {
        check.that(
            !self.radio_heads.is_empty(),
            "radio_heads",
            "empty",
            "at least one is needed",
        )?;
        for (index, head) in self.radio_heads.iter().enumerate() {
            let key = format!("radio_heads[{index}]");
            check.between(&format!("{key}.pci"), f64::from(head.pci), 0.0, 1007.0)?;
            check.between(
                &format!("{key}.ssb_index"),
                f64::from(head.ssb_index),
                0.0,
                63.0,
            )?;
            let place = Point::from(head.position_m);
            let position = format!("{:?}", head.position_m);
            let projection = track.project(place);
            let on_the_track = (0.0..=track.length_m()).contains(&projection.along_m)
                && projection.lateral_m.abs() <= 0.5 * track.width_m();
            check.that(
                !on_the_track,
                &format!("{key}.position_m"),
                &position,
                &format!(
                    "that is on the track, {:.1} m along it; it must be more than {} m from its middle",
                    projection.along_m,
                    0.5 * track.width_m()
                ),
            )?;
            for (other_index, other) in self.radio_heads.iter().take(index).enumerate() {
                check.that(
                    place.distance_m(other.position_m.into()) > 0.0,
                    &format!("{key}.position_m"),
                    &position,
                    &format!("radio_heads[{other_index}] stands in the same place"),
                )?;
                check.that(
                    (head.pci, head.ssb_index) != (other.pci, other.ssb_index),
                    &format!("{key}.pci"),
                    head.pci,
                    &format!(
                        "radio_heads[{other_index}] has the same pci and ssb_index; the pair must be \
                         different for each"
                    ),
                )?;
            }
        }
        Ok(())
    }

    fn check_radio(&self, check: &Check<'_>) -> Result<(), ScenarioError> {
        let (ssb, array) = (&self.ssb, &self.array);
        check.that(
            [5.0, 10.0, 20.0, 40.0, 80.0, 160.0].contains(&ssb.period_ms),
            "ssb.period_ms",
            ssb.period_ms,
            "it must be one of 5, 10, 20, 40, 80, 160",
        )?;
        check.that(
            [15.0, 30.0, 120.0, 240.0].contains(&ssb.subcarrier_spacing_khz),
            "ssb.subcarrier_spacing_khz",
            ssb.subcarrier_spacing_khz,
            "it must be one of 15, 30, 120, 240",
        )?;
        check.between("ssb.carrier_mhz", ssb.carrier_mhz, 100.0, 100_000.0)?;
        check.that(
            usize::from(array.elements) == ANTENNAS,
            "array.elements",
            array.elements,
            "it must be 4",
        )?;
        check.between(
            "array.spacing_wavelengths",
            array.spacing_wavelengths,
            0.05,
            0.5,
        )?;
        check.between(
            "array.snapshots",
            f64::from(array.snapshots),
            1.0,
            MAX_SNAPSHOTS as f64,
        )?;
        check.between(
            "array.mounting_angle_rad",
            array.mounting_angle_rad,
            -3.2,
            3.2,
        )?;
        for (key, value) in [
            ("array.mounting_error_std_rad", array.mounting_error_std_rad),
            (
                "array.mounting_drift_rad_per_sqrt_m",
                array.mounting_drift_rad_per_sqrt_m,
            ),
            ("array.phase_error_std_rad", array.phase_error_std_rad),
            (
                "array.phase_drift_rad_per_sqrt_m",
                array.phase_drift_rad_per_sqrt_m,
            ),
        ] {
            check.not_negative(key, value)?;
        }
        check.not_negative("receiver.noise_figure_db", self.receiver.noise_figure_db)?;
        check.positive("receiver.temperature_k", self.receiver.temperature_k)?;
        check.positive("receiver.bandwidth_mhz", self.receiver.bandwidth_mhz)?;
        check.not_negative("receiver.snr_noise_db", self.receiver.snr_noise_db)?;
        check.not_negative("channel.shadowing_std_db", self.channel.shadowing_std_db)?;
        check.not_negative(
            "channel.shadowing_correlation_m",
            self.channel.shadowing_correlation_m,
        )?;
        check.between(
            "channel.rician_k_db",
            self.channel.rician_k_db,
            -30.0,
            200.0,
        )?;
        check.between("channel.rays", f64::from(self.channel.rays), 1.0, 64.0)?;
        self.check_delay_spread(check)
    }

    fn check_vehicle(&self, check: &Check<'_>) -> Result<(), ScenarioError> {
        let estimator = &self.estimator;
        check.between("estimator.grid_deg", estimator.grid_deg, 0.001, 10.0)?;
        check.that(
            self.receiver.pilots == Pilots::Blind
                || estimator.method == EstimatorMethod::MaximumLikelihood,
            "estimator.method",
            estimator.method,
            "with known pilots (receiver.pilots) it must be maximum-likelihood",
        )?;
        let odometer = &self.odometer;
        check.between("odometer.rate_hz", odometer.rate_hz, 1.0, 1000.0)?;
        check.not_negative("odometer.scale_error_std", odometer.scale_error_std)?;
        check.not_negative("odometer.noise_m_per_sqrt_m", odometer.noise_m_per_sqrt_m)?;
        check.between(
            "odometer.dropout_probability",
            odometer.dropout_probability,
            0.0,
            0.99,
        )?;
        if let Some(gyro) = &odometer.gyro {
            check.not_negative(
                "odometer.gyro.noise_rad_per_sqrt_s",
                gyro.noise_rad_per_sqrt_s,
            )?;
            check.not_negative("odometer.gyro.bias_std_radps", gyro.bias_std_radps)?;
        }
        self.check_start(check)?;
        match &self.localizer {
            LocalizerSettings::DeadReckoning(_) => Ok(()),
            LocalizerSettings::Tracker(tracker) => tracker.check(check),
        }
    }

    fn check_start(&self, check: &Check<'_>) -> Result<(), ScenarioError> {
        let start = &self.start;
        check.not_negative("start.position_std_m", start.position_std_m)?;
        check.not_negative("start.heading_std_rad", start.heading_std_rad)?;
        if start.known {
            return Ok(());
        }
        let map = matches!(&self.localizer, LocalizerSettings::Tracker(tracker) if tracker.map);
        check.that(
            map,
            "start.known",
            false,
            "to find the vehicle along the road takes localizer.kind = \"tracker\" with map = true",
        )?;
        check.that(
            self.radio_heads.len() > 1,
            "start.known",
            false,
            "to find the vehicle takes two radio heads or more; one leaves several places open",
        )
    }

    fn check_wake_up(&self, check: &Check<'_>) -> Result<(), ScenarioError> {
        match &self.wake_up {
            WakeUpSettings::Fixed(fixed) => fixed.interval_ms.map_or(Ok(()), |interval_ms| {
                check.positive("wake_up.interval_ms", interval_ms)
            }),
            WakeUpSettings::Pid(pid) => pid.check(check),
            WakeUpSettings::Uncertainty(uncertainty) => {
                check.positive("wake_up.bound_m", uncertainty.bound_m)?;
                check.between(
                    "wake_up.confidence",
                    uncertainty.confidence,
                    0.01,
                    0.999_999,
                )?;
                check.not_negative("wake_up.wake_up_cost", uncertainty.wake_up_cost)?;
                let least_gain_m2 = uncertainty.least_gain_m2.unwrap_or_default();
                check.not_negative("wake_up.least_gain_m2", least_gain_m2)?;
                check.that(
                    matches!(self.localizer, LocalizerSettings::Tracker(_)),
                    "wake_up.policy",
                    "uncertainty",
                    "it needs localizer.kind = \"tracker\", which knows its own error",
                )
            }
        }
    }
}

impl PidSettings {
    fn check(&self, check: &Check<'_>) -> Result<(), ScenarioError> {
        check.positive("wake_up.t_max_ms", self.t_max_ms)?;
        if let Some(base_ms) = self.base_ms {
            check.positive("wake_up.base_ms", base_ms)?;
            check.that(
                self.t_max_ms >= base_ms,
                "wake_up.t_max_ms",
                self.t_max_ms,
                &format!("it must not be below wake_up.base_ms, {base_ms}"),
            )?;
        }
        for (key, value) in [
            ("wake_up.kp", self.kp),
            ("wake_up.ki", self.ki),
            ("wake_up.kd", self.kd),
            ("wake_up.weight_snr", self.weight_snr),
            ("wake_up.weight_velocity", self.weight_velocity),
            ("wake_up.integral_clamp", self.integral_clamp),
        ] {
            check.not_negative(key, value)?;
        }
        check.positive("wake_up.snr_scale_db", self.snr_scale_db)?;
        match self.snr_set_point {
            SnrSetPoint::Expected { offset_db } => {
                check.between("wake_up.snr_set_point.offset_db", offset_db, -60.0, 60.0)
            }
            SnrSetPoint::Absolute { snr_db } => {
                check.between("wake_up.snr_set_point.snr_db", snr_db, -60.0, 100.0)
            }
        }
    }
}

impl TrackSettings {
    /// Builds the road.
    ///
    /// # Errors
    /// [`ScenarioError::Value`] when it has no shape, more than one, or an impossible one.
    pub(crate) fn build(&self, file: &str) -> Result<Track, ScenarioError> {
        let check = Check { file };
        check.positive("track.width_m", self.width_m)?;
        check.positive("track.corner_radius_m", self.corner_radius_m)?;
        let (key, track) = match (&self.segments, &self.polyline_m) {
            (Some(segments), None) => {
                let segments: Vec<Segment> = segments
                    .iter()
                    .map(|s| Segment {
                        length_m: s.length_m,
                        turn_rad: s.turn_rad,
                        surveyed: s.surveyed,
                    })
                    .collect();
                (
                    "segments",
                    Track::from_segments(self.start, &segments, self.width_m),
                )
            }
            (None, Some(polyline)) => {
                let points: Vec<Point> = polyline.iter().map(|&point| point.into()).collect();
                let radius_m = self.corner_radius_m;
                (
                    "polyline_m",
                    Track::from_polyline(&points, radius_m, self.width_m),
                )
            }
            (None, None) => {
                return Err(check.error(
                    "track",
                    "without a shape",
                    "one of `segments`, `polyline_m` and `file` is needed",
                ));
            }
            (Some(_), Some(_)) => {
                return Err(check.error(
                    "track",
                    "given twice",
                    "only one of `segments`, `polyline_m` and `file` is allowed",
                ));
            }
        };
        track.map_err(|error| {
            let (key, value) = match error {
                TrackError::Length { index, length_m } => (
                    format!("track.{key}[{index}].length_m"),
                    length_m.to_string(),
                ),
                TrackError::BentGuess { index, turn_rad } => (
                    format!("track.{key}[{index}].turn_rad"),
                    turn_rad.to_string(),
                ),
                TrackError::RepeatedPoint { index } | TrackError::Reversal { index } => {
                    (format!("track.{key}[{index}]"), "not passable".to_owned())
                }
                TrackError::Empty => (format!("track.{key}"), "too short".to_owned()),
            };
            check.error(&key, value, &error.to_string())
        })
    }
}
