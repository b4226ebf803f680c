//! Plant: the task of a fleet on a site, the required accuracy and the prices.

use onboard::settings::{Check, Library, SettingsError, Site, TomlFile, Vehicle};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use toml::{Table, Value};

use super::channel::{ChannelModel, ChannelSettings};
use super::iq::IqSettings;
use super::motion::MotionSettings;
use super::price::Price;
use super::scenario_file::{Fidelity, Scenario, hold, named_or_held};
use super::target::Target;
use super::truth::TruthSettings;

/// Plant file: a site, a vehicle, the fleet and the required accuracy.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Plant {
    /// Short name of the plant and of its results.
    pub name: String,
    /// Description of the plant.
    #[serde(default)]
    pub description: String,
    /// Maximum horizontal error and the fraction of time for which it is required: `"0.3 m 99 %"`.
    pub target: Target,
    /// Site: a name or a table.
    #[schemars(schema_with = "named_or_held::<Site>")]
    pub site: Site,
    /// Vehicle: a name or a table.
    #[schemars(schema_with = "named_or_held::<Vehicle>")]
    pub vehicle: Vehicle,
    /// Trip of a vehicle along the site's road, with its stops.
    #[serde(default)]
    pub motion: MotionSettings,
    /// Nominal channel.
    #[serde(default)]
    pub channel: ChannelSettings,
    /// Channel with a poor line of sight, for comparison [default: street canyon].
    #[serde(default = "street_canyon")]
    pub poor_channel: ChannelSettings,
    /// Size and use of the fleet.
    pub fleet: Fleet,
    /// Prices; missing ones are replaced by published prices.
    #[serde(default)]
    pub prices: Prices,
}

/// `[fleet]`
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Fleet {
    /// Number of vehicles.
    #[schemars(range(min = 1, max = 100_000))]
    pub vehicles: u32,
    /// Operating time of a vehicle in hours per day.
    #[schemars(range(min = 0.1, max = 24.0))]
    pub hours_per_day: f64,
    /// Number of trips of a vehicle per day.
    #[schemars(range(min = 1, max = 100_000))]
    pub trips_per_day: u32,
    /// Number of operating days per year.
    #[serde(default = "weekdays")]
    #[schemars(range(min = 1.0, max = 366.0))]
    pub days_per_year: f64,
    /// Period of the cost calculation in years.
    #[serde(default = "usual_life")]
    #[schemars(range(min = 0.1, max = 50.0))]
    pub years: f64,
}

/// `[prices]`, in one currency.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Prices {
    /// Currency [default: US dollars]. Published prices are in US dollars and are not converted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub currency: Option<String>,
    /// Price of electricity per kWh.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub electricity_per_kwh: Option<Price>,
    /// Carbon intensity of electricity in gCO2e per kWh [default: Germany's].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub grid_g_per_kwh: Option<Price>,
    /// Price of the receiver and the antennas of a vehicle.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub receiver: Option<Price>,
    /// Price of the LiDAR of a vehicle, for comparison.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lidar: Option<Price>,
    /// Price of a roadside unit, for comparison.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub roadside_unit: Option<Price>,
    /// Maintenance cost of a roadside unit per year.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub roadside_unit_yearly: Option<Price>,
    /// Price of an additional radio head with its mast.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub radio_head: Option<Price>,
    /// Cost of moving a radio head.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub move_radio_head: Option<Price>,
    /// Cost of surveying the position of a radio head.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub survey: Option<Price>,
    /// Cost of calibrating the antenna array of a vehicle.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub calibration: Option<Price>,
    /// Price of a better odometer for a vehicle.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub odometer: Option<Price>,
    /// Cost of changing the settings of all cells.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cell_settings: Option<Price>,
    /// Cost of changing the software settings of a vehicle.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub vehicle_settings: Option<Price>,
}

fn street_canyon() -> ChannelSettings {
    ChannelSettings {
        model: ChannelModel::Umi,
        ..ChannelSettings::default()
    }
}

const fn weekdays() -> f64 {
    250.0
}

const fn usual_life() -> f64 {
    5.0
}

impl TomlFile for Plant {
    const WHAT: &'static str = "plant";
    const SHIPPED: &'static [(&'static str, &'static str)] = &[
        ("bends", include_str!("../../../../plants/bends.toml")),
        ("campus", include_str!("../../../../plants/campus.toml")),
        ("paper", include_str!("../../../../plants/paper.toml")),
        ("trip-1", include_str!("../../../../plants/trip-1.toml")),
        ("trip-2", include_str!("../../../../plants/trip-2.toml")),
        ("trip-4", include_str!("../../../../plants/trip-4.toml")),
        ("yard", include_str!("../../../../plants/yard.toml")),
    ];

    fn name(&self) -> &str {
        &self.name
    }

    fn resolve(
        table: &mut Table,
        origin: &str,
        library: &dyn Library,
    ) -> Result<(), SettingsError> {
        hold::<Site>(table, origin, library)?;
        hold::<Vehicle>(table, origin, library)
    }

    fn check(&self, check: Check<'_>) -> Result<(), SettingsError> {
        self.scenario(&self.poor_channel).check(check)?;
        let scenario = self.scenario(&self.channel);
        scenario.check(check)?;
        let written = Table::try_from(&self.prices).unwrap_or_default();
        for (key, price) in &written {
            let number = |name: &str| price.get(name).and_then(Value::as_float);
            let ends = ["low", "value", "high"].map(|name| number(name).unwrap_or(0.0));
            let rise = ends.is_sorted();
            let key = format!("prices.{key}");
            let allowed = "`low`, `value` and `high` must not fall";
            check.that(rise, &key, format!("{ends:?}"), allowed)?;
        }
        let (fleet, trip_s) = (&self.fleet, scenario.size(check)?.duration_s);
        let most = fleet.hours_per_day * 3600.0 / trip_s;
        check.that(
            f64::from(fleet.trips_per_day) <= most,
            "fleet.trips_per_day",
            fleet.trips_per_day,
            &format!(
                "a trip takes {trip_s:.0} s, so that one vehicle makes at most {most:.0} in \
                 {} h (fleet.hours_per_day)",
                fleet.hours_per_day
            ),
        )
    }
}

impl Plant {
    /// Returns the scenario of a trip with the given channel.
    pub fn scenario(&self, channel: &ChannelSettings) -> Scenario {
        Scenario {
            name: self.name.clone(),
            description: self.description.clone(),
            fidelity: Fidelity::default(),
            allow_large: false,
            ssb_latency_ms: 0.0,
            site: self.site.clone(),
            vehicle: self.vehicle.clone(),
            motion: self.motion.clone(),
            channel: channel.clone(),
            iq: IqSettings::default(),
            truth: TruthSettings::default(),
            faults: Vec::new(),
        }
    }
}

#[cfg(test)]
mod tests {
    use onboard::settings::Shipped;

    use super::*;

    const BENDS: &str = include_str!("../../../../plants/bends.toml");

    fn refused(change: (&str, &str)) -> String {
        let text = BENDS.replace(change.0, change.1);
        assert_ne!(text, BENDS);
        Plant::from_toml(&text, "mine.toml", &Shipped)
            .unwrap_err()
            .to_string()
    }

    #[test]
    fn shipped_plants_are_valid_and_round_trip_through_toml() {
        for name in Plant::names() {
            let plant = Plant::from_library(name, &Shipped).unwrap();
            let again = Plant::from_toml(&plant.to_toml(), "again", &Shipped).unwrap();
            assert_eq!(again, plant);
        }
    }

    #[test]
    fn invalid_values_are_reported_with_their_key() {
        let message = refused(("trips_per_day = 40", "trips_per_day = 400"));
        assert!(message.contains("fleet.trips_per_day") && message.contains("at most"));
        let message = refused(("0.3 m 99 %", "0.3 99"));
        assert!(
            message.contains("target") && message.contains("0.3 m 99 %"),
            "{message}"
        );
        let message = refused(("[fleet]", "[prices]\nlidar = \"4000 USD\"\n[fleet]"));
        assert!(
            message.contains("prices.lidar") && message.contains("without its unit"),
            "{message}"
        );
        let lidar = "[prices]\nlidar = { low = 5000.0, value = 4000.0, high = 6000.0 }\n[fleet]";
        let message = refused(("[fleet]", lidar));
        assert!(
            message.contains("prices.lidar") && message.contains("must not fall"),
            "{message}"
        );
    }
}
