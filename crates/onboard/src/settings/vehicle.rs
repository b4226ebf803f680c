//! Vehicle: components and configuration.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::array::ArraySettings;
use super::check::Check;
use super::error::SettingsError;
use super::integrity::IntegritySettings;
use super::localizer::LocalizerSettings;
use super::odometry::{DriveKind, GyroscopeSettings, LaneKeepingSettings, OdometerSettings};
use super::ranging::{RangingKind, RangingSettings};
use super::receiver::{EstimatorMethod, EstimatorSettings, Pilots, ReceiverSettings};
use super::site::Site;
use super::start::StartSettings;
use super::toml_file::{TomlFile, TomlFormat};
use super::wake_up::{UncertaintySettings, WakeUpSettings};

/// Vehicle file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Vehicle {
    /// Short name.
    pub name: String,
    /// Description of the vehicle.
    #[serde(default)]
    pub description: String,
    /// Drive type, which determines the possible motions.
    #[serde(default)]
    pub drive: DriveKind,
    /// Top speed in km/h.
    #[serde(default = "default_top_speed_kmh")]
    #[schemars(range(min = 0.1, max = 200.0))]
    pub top_speed_kmh: f64,
    /// Acceleration and deceleration in m/s².
    #[serde(default = "gentle")]
    #[schemars(range(min = 0.01, max = 20.0))]
    pub acceleration_mps2: f64,
    /// Lane keeping of the vehicle.
    #[serde(default)]
    pub lane_keeping: LaneKeepingSettings,
    /// Antenna array.
    #[serde(default)]
    pub array: ArraySettings,
    /// Receiver.
    #[serde(default)]
    pub receiver: ReceiverSettings,
    /// Ranging to the radio heads, if the vehicle measures ranges or delays. The localizer then
    /// estimates the states of the ranges.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ranging: Option<RangingSettings>,
    /// Odometer.
    #[serde(default)]
    pub odometer: OdometerSettings,
    /// Gyroscope, if the vehicle has one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gyroscope: Option<GyroscopeSettings>,
    /// Uncertainty of the initial pose.
    #[serde(default)]
    pub start: StartSettings,
    /// Estimator of the angle.
    #[serde(default)]
    pub estimator: EstimatorSettings,
    /// Localizer: computation of a pose from angles and odometry.
    #[serde(default)]
    pub localizer: LocalizerSettings,
    /// Integrity monitoring. Default: the tracker is monitored with default values; dead reckoning
    /// is not monitored.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub integrity: Option<IntegritySettings>,
    /// Wake-up policy. Default: the tracker's own covariance determines the wake-ups, dead
    /// reckoning uses every SSB, and a recorded drive uses all its angles.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wake_up: Option<WakeUpSettings>,
    /// Onboard computer.
    #[serde(default)]
    pub platform: PlatformSettings,
}

const fn default_top_speed_kmh() -> f64 {
    15.0
}

const fn gentle() -> f64 {
    0.5
}

/// `[platform]`: the onboard computer and its power mode.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct PlatformSettings {
    /// Name of a shipped platform, or path of a platform file.
    pub name: String,
    /// Number of the power mode in the platform file.
    pub mode: u32,
}

impl Default for PlatformSettings {
    fn default() -> Self {
        Self {
            name: "jetson-agx-xavier-engine".to_owned(),
            mode: 0,
        }
    }
}

impl Vehicle {
    /// Whether the localizer uses delays of received SSBs: a tracker with one-way ranging.
    pub fn has_one_way_ranging(&self) -> bool {
        let is_one_way = |it: &RangingSettings| it.kind == RangingKind::OneWay;
        self.ranging.as_ref().is_some_and(is_one_way)
            && matches!(self.localizer, LocalizerSettings::Tracker(_))
    }

    /// Returns the top speed in m/s.
    pub fn top_speed_mps(&self) -> f64 {
        self.top_speed_kmh / 3.6
    }

    /// Whether the localizer computes its own covariance.
    const fn tracks(&self) -> bool {
        matches!(self.localizer, LocalizerSettings::Tracker(_))
    }

    /// Returns the wake-up policy: as configured, otherwise determined by the localizer's
    /// covariance if it has one.
    pub fn wake_up_policy(&self) -> WakeUpSettings {
        self.wake_up.unwrap_or(if self.tracks() {
            WakeUpSettings::Uncertainty(UncertaintySettings::default())
        } else {
            WakeUpSettings::EVERY_SSB
        })
    }

    /// Returns the integrity settings of the tracker unless monitoring is switched off; `None` for
    /// dead reckoning.
    pub fn integrity_monitor(&self) -> Option<IntegritySettings> {
        let settings = self.integrity.unwrap_or_default();
        (self.tracks() && settings.enabled).then_some(settings)
    }

    /// Whether the localizer uses the site's road, if there is one.
    pub fn follows_road(&self) -> bool {
        let maps = matches!(&self.localizer, LocalizerSettings::Tracker(tracker) if tracker.map);
        maps && self.drive == DriveKind::Road
    }
}

impl TomlFile for Vehicle {
    const WHAT: &'static str = "vehicle";
    const SHIPPED: &'static [(&'static str, &'static str)] = &[
        ("default", include_str!("../../../../vehicles/default.toml")),
        ("paper", include_str!("../../../../vehicles/paper.toml")),
        (
            "paper-carrier",
            include_str!("../../../../vehicles/paper-carrier.toml"),
        ),
        ("carrier", include_str!("../../../../vehicles/carrier.toml")),
        ("tugger", include_str!("../../../../vehicles/tugger.toml")),
    ];

    fn format() -> &'static TomlFormat<Self> {
        static FORMAT: TomlFormat<Vehicle> = TomlFormat::new();
        &FORMAT
    }

    fn name(&self) -> &str {
        &self.name
    }

    fn check(&self, check: Check<'_>) -> Result<(), SettingsError> {
        self.array.check(check)?;
        check.that(
            self.receiver.pilots == Pilots::Blind
                || self.estimator.method == EstimatorMethod::MaximumLikelihood,
            "estimator.method",
            self.estimator.method,
            "with known pilots (receiver.pilots) it must be maximum-likelihood",
        )?;
        check.that(
            self.array.shape.is_row()
                || self.estimator.method == EstimatorMethod::MaximumLikelihood,
            "estimator.method",
            self.estimator.method,
            "where the antennas are not in a row (array.shape) it must be maximum-likelihood",
        )?;
        let tracks = self.tracks();
        check.that(
            tracks || self.integrity.is_none_or(|it| !it.enabled),
            "integrity",
            "given",
            "it needs localizer.kind = \"tracker\"; remove it, or write integrity.enabled = false",
        )?;
        check.that(
            tracks || !matches!(self.wake_up, Some(WakeUpSettings::Uncertainty(_))),
            "wake_up.policy",
            "uncertainty",
            "it needs localizer.kind = \"tracker\", the only localizer that estimates its own \
             error",
        )?;
        check.that(
            self.start.known || tracks,
            "start.known",
            false,
            "a search for the vehicle needs localizer.kind = \"tracker\"",
        )?;
        check.that(
            self.start.known || self.start.pose.is_none(),
            "start.known",
            false,
            "it contradicts start.pose: remove one of them",
        )?;
        if let Some(integrity) = &self.integrity {
            integrity.check(check)?;
        }
        self.wake_up_policy().check(self.top_speed_mps(), check)
    }
}

/// Returns an error if the vehicle cannot operate at the site.
///
/// # Errors
/// [`SettingsError::Value`] naming the key of the vehicle and what the site has.
pub fn check_together(
    site: &Site,
    vehicle: &Vehicle,
    check: Check<'_>,
) -> Result<(), SettingsError> {
    for (index, pci) in (vehicle.receiver.pci_allow_list.iter().flatten()).enumerate() {
        check.that(
            site.radio_heads.iter().any(|head| head.pci == *pci),
            &format!("vehicle.receiver.pci_allow_list[{index}]"),
            pci,
            "a radio head of the site must have this pci",
        )?;
    }
    let received = (site.radio_heads.iter()).filter(|head| vehicle.receiver.receives(head.pci));
    let received = received.count();
    check.that(
        received > 0,
        "vehicle.receiver.pci_allow_list",
        "empty",
        "remove it to receive all radio heads",
    )?;
    let along_road = site.road.is_some() && vehicle.follows_road();
    check.that(
        vehicle.start.known || received > if along_road { 1 } else { 2 },
        "vehicle.start.known",
        false,
        "a search for the vehicle needs at least two radio heads along a road that it follows, \
         elsewhere three",
    )
}
