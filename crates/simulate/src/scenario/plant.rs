//! A plant: what a fleet does on a site, what is asked of it, and what things cost there.

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

/// A plant file: a site, a vehicle, a fleet of it, and the accuracy that is needed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Plant {
    /// Short name; also the name of its results.
    pub name: String,
    /// What the plant is.
    #[serde(default)]
    pub description: String,
    /// Horizontal error, and how much of the time it has to be within it: `"0.3 m 99 %"`.
    pub target: Target,
    /// The site: a name, or the site itself.
    #[schemars(schema_with = "named_or_held::<Site>")]
    pub site: Site,
    /// The vehicle: a name, or the vehicle itself.
    #[schemars(schema_with = "named_or_held::<Vehicle>")]
    pub vehicle: Vehicle,
    /// A trip: along the site's road, with its stops.
    #[serde(default)]
    pub motion: MotionSettings,
    /// What happens to the signal on its way, as it is believed.
    #[serde(default)]
    pub channel: ChannelSettings,
    /// The same where lines of sight are poor, for comparison.
    #[serde(default = "street_canyon")]
    pub poor_channel: ChannelSettings,
    /// How many vehicles, and how much they drive.
    pub fleet: Fleet,
    /// What things cost; what is not stated is taken from published prices.
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
    /// Hours a day that a vehicle is switched on.
    #[schemars(range(min = 0.1, max = 24.0))]
    pub hours_per_day: f64,
    /// Trips of one vehicle in a day.
    #[schemars(range(min = 1, max = 100_000))]
    pub trips_per_day: u32,
    /// Days of work in a year.
    #[serde(default = "weekdays")]
    #[schemars(range(min = 1.0, max = 366.0))]
    pub days_per_year: f64,
    /// Years over which costs are added up.
    #[serde(default = "usual_life")]
    #[schemars(range(min = 0.1, max = 50.0))]
    pub years: f64,
}

/// `[prices]`, in one currency.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Prices {
    /// The currency; US dollars without. Published prices are US dollars, and are not converted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub currency: Option<String>,
    /// Electricity, a kWh.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub electricity_per_kwh: Option<Price>,
    /// Carbon intensity of electricity, gCO2e a kWh; Germany's without.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub grid_g_per_kwh: Option<Price>,
    /// Receiver and antennas of a vehicle.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub receiver: Option<Price>,
    /// LiDAR of a vehicle, which is compared with.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lidar: Option<Price>,
    /// A roadside unit, which is compared with.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub roadside_unit: Option<Price>,
    /// Its upkeep in a year.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub roadside_unit_yearly: Option<Price>,
    /// One further radio head with its mast.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub radio_head: Option<Price>,
    /// Moving a radio head.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub move_radio_head: Option<Price>,
    /// Surveying the place of a radio head.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub survey: Option<Price>,
    /// Calibrating a vehicle's antenna array.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub calibration: Option<Price>,
    /// A better odometer for a vehicle.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub odometer: Option<Price>,
    /// A change of settings in the cells, all of them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cell_settings: Option<Price>,
    /// A change of a vehicle's software settings, all of them.
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
    /// A trip as a scenario, through this channel.
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
    fn shipped_plants_are_sound_and_are_read_again_as_they_were_written() {
        for name in Plant::names() {
            let plant = Plant::from_library(name, &Shipped).unwrap();
            let again = Plant::from_toml(&plant.to_toml(), "again", &Shipped).unwrap();
            assert_eq!(again, plant);
        }
    }

    #[test]
    fn bad_values_are_named() {
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
