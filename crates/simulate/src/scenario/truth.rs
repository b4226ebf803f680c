//! How the world departs from what is believed of it.

use onboard::settings::{
    Check, Library, SettingsError, Shipped, Site, TomlFile, Vehicle, lay_over,
};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use toml::{Table, Value};

/// `[truth]`: by default every value of site and vehicle that has a standard deviation is drawn
/// from it, once per run. Under `site` and `vehicle` stand values that are otherwise than believed,
/// by the same keys; radio heads by their names, or as `all`. A value given here is not drawn,
/// unless its standard deviation is given too, from which it then is.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct TruthSettings {
    /// Whether what is uncertain is drawn.
    pub draw: Draw,
    /// By what every standard deviation is multiplied that is drawn from.
    #[schemars(range(min = 0.0, max = 1000.0))]
    pub std_factor: f64,
    /// What of the site is otherwise: `road`, `radio_heads`, `rician_k_db`, `walls`.
    #[serde(skip_serializing_if = "Table::is_empty")]
    #[schemars(with = "serde_json::Map<String, serde_json::Value>")]
    pub site: Table,
    /// What of the vehicle is otherwise: `array`, `odometer`, `gyroscope`, `receiver`,
    /// `lane_keeping`, `top_speed_kmh`, `acceleration_mps2`.
    #[serde(skip_serializing_if = "Table::is_empty")]
    #[schemars(with = "serde_json::Map<String, serde_json::Value>")]
    pub vehicle: Table,
}

/// Whether what is uncertain is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Draw {
    /// From the standard deviations that site and vehicle state.
    #[default]
    AsStated,
    /// Nothing is: all is as believed, but for what stands here.
    None,
}

impl Default for TruthSettings {
    fn default() -> Self {
        Self {
            draw: Draw::AsStated,
            std_factor: 1.0,
            site: Table::new(),
            vehicle: Table::new(),
        }
    }
}

/// What of a site and of a vehicle is a fact of the world; the rest is how the vehicle is set.
const SITE_FACTS: [&str; 4] = ["road", "radio_heads", "rician_k_db", "walls"];
const VEHICLE_FACTS: [&str; 7] = [
    "array",
    "odometer",
    "gyroscope",
    "receiver",
    "lane_keeping",
    "top_speed_kmh",
    "acceleration_mps2",
];

/// Values and the standard deviations they are drawn from.
const DRAWN: [(&str, &str); 7] = [
    ("position_m", "position_std_m"),
    ("eirp_dbm", "eirp_std_db"),
    ("mounting_rad", "mounting_std_rad"),
    ("phase_rad", "phase_std_rad"),
    ("scale", "scale_std"),
    ("bias_radps", "bias_std_radps"),
    ("lateness_s", "lateness_std_s"),
];

impl TruthSettings {
    /// Site and vehicle as they are on average: believed values, but for those that are otherwise.
    ///
    /// # Errors
    /// [`SettingsError`] for a key that there is not, or that nothing believes in.
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
            "the gains of simulated channels are drawn: iq.channel_gain_db, iq.channel_phase_rad; a \
             phase that calibration left is array.phase_rad",
        )?;
        Ok((
            depart(site, &self.site, &SITE_FACTS, check)?,
            depart(vehicle, &self.vehicle, &VEHICLE_FACTS, check)?,
        ))
    }

    /// By what a standard deviation is multiplied that is drawn from.
    pub const fn factor(&self) -> f64 {
        match self.draw {
            Draw::AsStated => self.std_factor,
            Draw::None => 0.0,
        }
    }
}

fn depart<T: TomlFile + Clone>(
    believed: &T,
    over: &Table,
    facts: &[&str],
    check: Check<'_>,
) -> Result<T, SettingsError> {
    if over.is_empty() {
        return Ok(believed.clone());
    }
    let path = format!("truth.{}", T::WHAT);
    let mut table = Table::try_from(believed).unwrap_or_default();
    let base = table.clone();
    let mut laid = over.clone();
    not_drawn(&mut laid);
    lay_over(&mut table, laid, &path, check)?;
    // Whatever it reads is already in the table.
    let library: &dyn Library = &Shipped;
    let departed =
        T::from_table(table, check.file, library).map_err(|error| error.beneath(check.file, &path));
    for key in over.keys() {
        // What else there is not, the reader knows better.
        let exists = base.contains_key(key) || departed.is_ok();
        check.that(
            facts.contains(&key.as_str()) || !exists,
            &format!("{path}.{key}"),
            "given",
            &format!("only facts can be otherwise: {}", facts.join(", ")),
        )?;
    }
    let departed = departed?;
    believed_in(&base, over, &path, check)?;
    Ok(departed)
}

/// A value that is given is not drawn.
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

/// Refuses what the belief has no place for, such as a gyroscope that the vehicle lacks.
fn believed_in(
    base: &Table,
    over: &Table,
    path: &str,
    check: Check<'_>,
) -> Result<(), SettingsError> {
    for (key, value) in over {
        let path = format!("{path}.{key}");
        match (base.get(key), value) {
            // A wall may stand where nobody has told of one.
            (None, Value::Array(_)) if key == "walls" => {}
            (None, _) => {
                return Err(check.error(&path, "given", "nothing believes in such a thing"));
            }
            (Some(Value::Table(base)), Value::Table(over)) => {
                believed_in(base, over, &path, check)?;
            }
            _ => {}
        }
    }
    Ok(())
}
