//! Deviations of the truth from the nominal models.

use onboard::settings::{
    Check, Library, SettingsError, Shipped, Site, TomlFile, Vehicle, merge_table,
};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use toml::{Table, Value};

/// `[truth]`: deviations of the truth. Every value of site and vehicle with a standard
/// deviation gets a random error, once per run. The tables `site` and `vehicle` contain true values
/// with the keys of the nominal models. Radio heads are addressed by name or as `all`. A value in
/// these tables gets no random error unless its standard deviation is given there too.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct TruthSettings {
    /// Factor for all standard deviations of the drawn errors. With 0, all values are nominal
    /// except those in `[truth]`.
    #[schemars(range(min = 0.0, max = 1000.0))]
    pub std_factor: f64,
    /// True values of the site: `road`, `radio_heads`, `rician_k_db`, `walls`.
    #[serde(skip_serializing_if = "Table::is_empty")]
    #[schemars(with = "serde_json::Map<String, serde_json::Value>")]
    pub site: Table,
    /// True values of the vehicle: `array`, `odometer`, `gyroscope`, `receiver`, `lane_keeping`,
    /// `top_speed_kmh`, `acceleration_mps2`.
    #[serde(skip_serializing_if = "Table::is_empty")]
    #[schemars(with = "serde_json::Map<String, serde_json::Value>")]
    pub vehicle: Table,
}

impl Default for TruthSettings {
    fn default() -> Self {
        Self {
            std_factor: 1.0,
            site: Table::new(),
            vehicle: Table::new(),
        }
    }
}

/// Physical keys of a site. Other keys are settings of the software.
const SITE_FACTS: [&str; 4] = ["road", "radio_heads", "rician_k_db", "walls"];
/// Physical keys of a vehicle. Other keys are settings of the software.
const VEHICLE_FACTS: [&str; 7] = [
    "array",
    "odometer",
    "gyroscope",
    "receiver",
    "lane_keeping",
    "top_speed_kmh",
    "acceleration_mps2",
];

/// Values and the keys of their standard deviations.
const DRAWN: [(&str, &str); 7] = [
    ("position_m", "position_std_m"),
    ("eirp_dbm", "eirp_std_db"),
    ("mounting_rad", "mounting_std_rad"),
    ("phase_rad", "phase_std_rad"),
    ("scale", "scale_std"),
    ("bias_radps", "bias_std_radps"),
    ("angle_time_offset_s", "angle_time_offset_std_s"),
];

impl TruthSettings {
    /// Returns the true site and vehicle: nominal values, replaced by the given true values.
    ///
    /// # Errors
    /// [`SettingsError`] for an unknown key, or for a key that the nominal model does not contain.
    pub fn depart(
        &self,
        site: &Site,
        vehicle: &Vehicle,
        check: Check<'_>,
    ) -> Result<(Site, Vehicle), SettingsError> {
        let array = self.vehicle.get("array").and_then(Value::as_table);
        check.that(
            array.is_none_or(|array| !array.contains_key("channel_gains")),
            "truth.vehicle.array.channel_gains",
            "given",
            "remove it: the gains of simulated channels are drawn from iq.channel_gain_db and \
             iq.channel_phase_rad; array.phase_rad is the residual phase of the calibration",
        )?;
        Ok((
            depart(site, &self.site, &SITE_FACTS, check)?,
            depart(vehicle, &self.vehicle, &VEHICLE_FACTS, check)?,
        ))
    }
}

fn depart<T: TomlFile + Clone>(
    nominal: &T,
    over: &Table,
    facts: &[&str],
    check: Check<'_>,
) -> Result<T, SettingsError> {
    if over.is_empty() {
        return Ok(nominal.clone());
    }
    let path = format!("truth.{}", T::WHAT);
    let mut table = nominal.to_table();
    let base = table.clone();
    let mut merged = over.clone();
    not_drawn(&mut merged);
    merge_table(&mut table, merged, &path, check)?;
    // All referenced files are already part of the table.
    let library: &dyn Library = &Shipped;
    let departed = T::from_table(table, check.file, library)
        .map_err(|error| error.with_path_prefix(check.file, &path));
    for key in over.keys() {
        // Errors of unknown keys are reported by the deserializer.
        let exists = base.contains_key(key) || departed.is_ok();
        check.that(
            facts.contains(&key.as_str()) || !exists,
            &format!("{path}.{key}"),
            "given",
            &format!(
                "the truth can differ from the nominal model only in physical keys: {}",
                facts.join(", ")
            ),
        )?;
    }
    let departed = departed?;
    check_nominal_keys(&base, over, &path, check)?;
    Ok(departed)
}

/// Sets the standard deviation of a given value to zero, so that no error is drawn.
fn not_drawn(over: &mut Table) {
    for (value, std) in DRAWN {
        if over.contains_key(value) && !over.contains_key(std) {
            over.insert(std.to_owned(), Value::Float(0.0));
        }
    }
    over.iter_mut()
        .filter_map(|(_, value)| value.as_table_mut())
        .for_each(not_drawn);
}

/// Rejects keys that the nominal model does not contain, such as a gyroscope that the vehicle
/// lacks.
fn check_nominal_keys(
    base: &Table,
    over: &Table,
    path: &str,
    check: Check<'_>,
) -> Result<(), SettingsError> {
    for (key, value) in over {
        let path = format!("{path}.{key}");
        match (base.get(key), value) {
            // Walls may be missing in the nominal model.
            (None, Value::Array(_)) if key == "walls" => {}
            (None, _) => {
                return Err(check.error(&path, "given", "the nominal model has no such key"));
            }
            (Some(Value::Table(base)), Value::Table(over)) => {
                check_nominal_keys(base, over, &path, check)?;
            }
            _ => {}
        }
    }
    Ok(())
}
