//! Plant: the task of a fleet on a site, the required accuracy and the prices.

use onboard::plausible::Warning;
use onboard::settings::{Check, Library, SettingsError, Site, TomlFile, TomlFormat, Vehicle};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use toml::{Table, Value};

use super::channel::{ChannelModel, ChannelSettings};
use super::iq::IqSettings;
use super::motion::MotionSettings;
use super::place_target::PlaceTarget;
use super::price::Price;
use super::scenario_file::{Fidelity, Scenario, hold, named_or_held};
use super::target::Target;
use super::truth::TruthSettings;
use super::unusual_prices;

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
    /// Targets of single positions or stretches, in addition to `target`, which applies to the whole trip.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(length(max = 50))]
    pub targets: Vec<PlaceTarget>,
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

/// `[fleet]`: size and use of the fleet.
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
    /// Currency of all prices [default: US dollars].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub currency: Option<String>,
    /// Price of one US dollar in `currency`. Published prices are in US dollars and are converted by it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub currency_per_usd: Option<Price>,
    /// Price of electricity per kWh.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub electricity_per_kwh: Option<Price>,
    /// Carbon intensity of electricity in gCO2e per kWh [default: Germany's].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub grid_g_per_kwh: Option<Price>,
    /// Price of the receiver and the antennas of a vehicle.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub receiver: Option<Price>,
    /// Price of the onboard computer of a vehicle.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub computer: Option<Price>,
    /// Price of the LiDAR of a vehicle, for comparison.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lidar: Option<Price>,
    /// Price of a roadside unit, for comparison.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub roadside_unit: Option<Price>,
    /// Maintenance cost of a roadside unit per year.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub roadside_unit_yearly: Option<Price>,
    /// Price of an ultra-wideband (UWB) anchor with its installation, for comparison.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub uwb_anchor: Option<Price>,
    /// Length of road for each UWB anchor in metres.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub uwb_anchor_spacing_m: Option<Price>,
    /// Price of the UWB tag of a vehicle.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub uwb_tag: Option<Price>,
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

    fn format() -> &'static TomlFormat<Self> {
        static FORMAT: TomlFormat<Plant> = TomlFormat::new();
        &FORMAT
    }

    fn name(&self) -> &str {
        &self.name
    }

    fn resolve(
        table: &mut Table,
        origin: &str,
        library: &dyn Library,
    ) -> Result<(), SettingsError> {
        let site = stated::<Site>(table, origin, library)?;
        needs_cells(&site, Check { file: origin })?;
        let vehicle = stated::<Vehicle>(table, origin, library)?;
        hold::<Site>(table, origin, library)?;
        hold::<Vehicle>(table, origin, library)?;
        let integrity = vehicle.get("integrity").and_then(Value::as_table);
        if !integrity.is_some_and(|it| it.contains_key("alert_limit_m")) {
            limit_by_target(table, origin, library);
        }
        Ok(())
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
            let allowed = "`low`, `value` and `high` must be in ascending order";
            check.that(rise, &key, format!("{ends:?}"), allowed)?;
        }
        self.check_targets(check)?;
        self.check_currency(check)?;
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

/// Ratio of the alert limit to the error of the target. The containment limit of required
/// navigation performance is twice its accuracy (ICAO Doc 9613, 1.2).
const ALERT_LIMIT_PER_TARGET: f64 = 2.0;
/// Currencies with a published rate (`economics/prices.toml`).
const CONVERTED: [&str; 2] = ["USD", "EUR"];

/// Returns the keys of a site or vehicle that a plant's file, and the files that it names, contain.
fn stated<T: TomlFile>(
    table: &Table,
    origin: &str,
    library: &dyn Library,
) -> Result<Table, SettingsError> {
    match table.get(T::WHAT) {
        Some(Value::String(name)) => {
            let named = library.text(T::WHAT, T::SHIPPED, name, origin);
            let named = named.map_err(|error| error.with_path_prefix(origin, T::WHAT))?;
            // A text that is not TOML is rejected by its reader, which reports the position.
            let keys = named.text.parse().unwrap_or_default();
            T::stated_keys(keys, &named.origin, library)
        }
        Some(Value::Table(held)) => T::stated_keys(held.clone(), origin, library)
            .map_err(|error| error.with_path_prefix(origin, T::WHAT)),
        _ => Ok(Table::new()),
    }
}

/// Rejects radio heads without a cell identity or a radiated power: no default fits any plant.
fn needs_cells(site: &Table, check: Check<'_>) -> Result<(), SettingsError> {
    let heads = site.get("radio_heads").and_then(Value::as_array);
    for (index, head) in heads.into_iter().flatten().enumerate() {
        let needed = [
            (
                "pci",
                "write the physical cell identity, 0 to 1007, by which vehicles recognize the radio head",
            ),
            (
                "eirp_dbm",
                "write the radiated power with the antenna's gain in dBm: 10 mW are 10, 1 W is 30",
            ),
        ];
        for (key, allowed) in needed {
            let is_there = head.as_table().is_none_or(|it| it.contains_key(key));
            let key = format!("site.radio_heads[{index}].{key}");
            check.that(is_there, &key, "missing", allowed)?;
        }
    }
    Ok(())
}

/// Derives the alert limit of a plant's vehicle from the plant's target.
fn limit_by_target(table: &mut Table, origin: &str, library: &dyn Library) {
    let target = table.get("target").and_then(Value::as_str);
    let Some(Ok(target)) = target.map(|it| Target::try_from(it.to_owned())) else {
        return; // the reader rejects it
    };
    let Some(Value::Table(vehicle)) = table.get_mut("vehicle") else {
        return;
    };
    let read = Vehicle::from_table(vehicle.clone(), origin, library);
    if read.is_ok_and(|it| it.integrity_monitor().is_some()) {
        let integrity = vehicle
            .entry("integrity")
            .or_insert_with(|| Value::Table(Table::new()));
        if let Value::Table(integrity) = integrity {
            let limit_m = ALERT_LIMIT_PER_TARGET * target.error_m();
            integrity.insert("alert_limit_m".to_owned(), Value::Float(limit_m));
        }
    }
}

impl Plant {
    /// Returns warnings about implausible values of site, vehicle, trip and prices.
    ///
    /// # Errors
    /// [`SettingsError`] only if the plant was changed by code to an invalid one.
    pub fn warnings(&self) -> Result<Vec<Warning>, SettingsError> {
        let mut found = self.scenario(&self.channel).warnings()?;
        found.extend(unusual_prices::of_plant(self, self.currency()));
        Ok(found)
    }

    /// Returns the currency of all prices.
    pub fn currency(&self) -> &str {
        self.prices.currency.as_deref().unwrap_or("USD")
    }

    /// Rejects a currency without a rate: published prices are US dollars.
    fn check_currency(&self, check: Check<'_>) -> Result<(), SettingsError> {
        let is_known = CONVERTED.contains(&self.currency());
        check.that(
            is_known || self.prices.currency_per_usd.is_some(),
            "prices.currency_per_usd",
            "missing",
            &format!(
                "omitted prices are published in US dollars; write the price of one US \
                 dollar in {}",
                self.currency()
            ),
        )
    }

    /// Rejects targets without a position on the driven road.
    fn check_targets(&self, check: Check<'_>) -> Result<(), SettingsError> {
        let road_m = self.scenario(&self.channel).path(check)?.length_m();
        for (index, target) in self.targets.iter().enumerate() {
            target.check(
                check,
                &format!("targets[{index}]"),
                self.motion.start_at_m,
                road_m,
            )?;
        }
        Ok(())
    }

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
