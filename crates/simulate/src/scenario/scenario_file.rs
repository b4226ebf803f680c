//! Scenario file.

use std::path::Path;

use onboard::settings::{
    Check, Library, SettingsError, Site, TomlFile, TomlFormat, Vehicle, check_together,
};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Serialize};
use toml::{Table, Value};

use super::channel::ChannelSettings;
use super::faults::FaultSettings;
use super::iq::IqSettings;
use super::motion::MotionSettings;
use super::size::DriveSize;
use super::truth::TruthSettings;
use crate::channel::{Paths, PathsError};
use onboard::road::Road;

/// Scenario: everything that determines a simulated run, except the seed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scenario {
    /// Short name of the scenario and of its results.
    pub name: String,
    /// Purpose of the scenario.
    #[serde(default)]
    pub description: String,
    /// Level of detail of the simulated radio.
    #[serde(default)]
    pub fidelity: Fidelity,
    /// Whether drives are allowed that need more than the usual memory or computing time.
    #[serde(default)]
    pub allow_large: bool,
    /// Delay from the reception of an SSB to its arrival at the localizer, in ms.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 10_000.0))]
    pub ssb_latency_ms: f64,
    /// Nominal site: a name or a table.
    #[schemars(schema_with = "named_or_held::<Site>")]
    pub site: Site,
    /// Nominal vehicle: a name or a table.
    #[schemars(schema_with = "named_or_held::<Vehicle>")]
    pub vehicle: Vehicle,
    /// Motion of the vehicle.
    #[serde(default)]
    pub motion: MotionSettings,
    /// Channel between radio heads and vehicle.
    #[serde(default)]
    pub channel: ChannelSettings,
    /// Receiver hardware in simulations with IQ samples.
    #[serde(default)]
    pub iq: IqSettings,
    /// Deviations of the truth from the nominal models.
    #[serde(default)]
    pub truth: TruthSettings,
    /// Faults during the run.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(length(max = 1000))]
    pub faults: Vec<FaultSettings>,
}

/// Level of detail of the simulated radio.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Fidelity {
    /// Array snapshots drawn from the channel, as in the paper.
    #[default]
    Snapshots,
    /// IQ samples of every SSB at every antenna, processed by the receiver (`[iq]`).
    Iq,
}

pub(super) fn named_or_held<T: JsonSchema>(generator: &mut SchemaGenerator) -> Schema {
    let held = generator.subschema_for::<T>();
    json_schema!({
        "oneOf": [
            { "type": "string", "description": "Name of a shipped file, or path of a file." },
            held,
        ],
    })
}

impl TomlFile for Scenario {
    const WHAT: &'static str = "scenario";
    const SHIPPED: &'static [(&'static str, &'static str)] = &[
        ("paper", include_str!("../../../../scenarios/paper.toml")),
        (
            "paper-stop-and-go",
            include_str!("../../../../scenarios/paper-stop-and-go.toml"),
        ),
        (
            "paper-real-odometry",
            include_str!("../../../../scenarios/paper-real-odometry.toml"),
        ),
        (
            "paper-real-odometry-2",
            include_str!("../../../../scenarios/paper-real-odometry-2.toml"),
        ),
        (
            "paper-real-odometry-4",
            include_str!("../../../../scenarios/paper-real-odometry-4.toml"),
        ),
        ("yard", include_str!("../../../../scenarios/yard.toml")),
        (
            "yard-surveyed",
            include_str!("../../../../scenarios/yard-surveyed.toml"),
        ),
        (
            "nlos-and-faults",
            include_str!("../../../../scenarios/nlos-and-faults.toml"),
        ),
        (
            "campus-handover",
            include_str!("../../../../scenarios/campus-handover.toml"),
        ),
        (
            "yard-array-off",
            include_str!("../../../../scenarios/yard-array-off.toml"),
        ),
        (
            "yard-heads-off",
            include_str!("../../../../scenarios/yard-heads-off.toml"),
        ),
        (
            "yard-odometer-noisy",
            include_str!("../../../../scenarios/yard-odometer-noisy.toml"),
        ),
    ];

    fn format() -> &'static TomlFormat<Self> {
        static FORMAT: TomlFormat<Scenario> = TomlFormat::new();
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
        hold::<Site>(table, origin, library)?;
        hold::<Vehicle>(table, origin, library)?;
        let channel = table.get_mut("channel").and_then(Value::as_table_mut);
        if let Some(Value::String(file)) = channel.and_then(|it| it.get_mut("paths")) {
            // Make the path absolute, so that a copy of the scenario elsewhere refers to the same
            // file.
            let folder = Path::new(origin).parent().unwrap_or(Path::new(""));
            if let Ok(path) = std::path::absolute(folder.join(&*file)) {
                *file = path.display().to_string();
            }
        }
        Ok(())
    }

    fn check(&self, check: Check<'_>) -> Result<(), SettingsError> {
        check_together(&self.site, &self.vehicle, check)?;
        let road = self.path(check)?;
        self.check_motion(check, &road)?;
        self.channel.check(check)?;
        self.traced_paths(check)?;
        self.check_iq(check)?;
        let (heads, elements) = (self.site.radio_heads.len(), self.vehicle.array.elements);
        for (index, fault) in self.faults.iter().enumerate() {
            fault.check(check, index, heads, elements)?;
        }
        let size = self.size(check)?;
        if self.allow_large {
            return Ok(());
        }
        size.check(check)
    }
}

/// Replaces the name of a site or vehicle by its table.
pub(super) fn hold<T: TomlFile>(
    table: &mut Table,
    origin: &str,
    library: &dyn Library,
) -> Result<(), SettingsError> {
    let held = match table.get(T::WHAT).cloned() {
        Some(Value::String(name)) => {
            let named = library.text(T::WHAT, T::SHIPPED, &name, origin);
            let named = named.map_err(|error| error.with_path_prefix(origin, T::WHAT))?;
            T::from_toml(&named.text, &named.origin, library)?
        }
        Some(Value::Table(held)) => T::from_table(held, origin, library)
            .map_err(|error| error.with_path_prefix(origin, T::WHAT))?,
        _ => return Ok(()), // the deserializer reports a missing value or a wrong type
    };
    let held = held.to_table();
    table.insert(T::WHAT.to_owned(), Value::Table(held));
    Ok(())
}

impl Scenario {
    /// Returns the nominal path: the path of the motion, or the site's road.
    ///
    /// # Errors
    /// [`SettingsError::Value`] if the scenario has no path and the site no road.
    pub fn path(&self, check: Check<'_>) -> Result<Road, SettingsError> {
        match (&self.motion.path, &self.site.road) {
            (Some(path), _) => path.build("motion.path", check),
            (None, Some(road)) => road.build("site.road", check),
            (None, None) => {
                let allowed = "the site has no road; add `motion.path`";
                Err(check.error("motion.path", "missing", allowed))
            }
        }
    }

    /// Returns the ray-traced paths; `None` if the scenario has none.
    ///
    /// # Errors
    /// [`SettingsError::Value`] if the file cannot be read or belongs to another site.
    pub fn traced_paths(&self, check: Check<'_>) -> Result<Option<Paths>, SettingsError> {
        let Some(file) = &self.channel.paths else {
            return Ok(None);
        };
        let refused = |why: PathsError| check.error("channel.paths", file, &why.to_string());
        let paths = Paths::read(Path::new(file)).map_err(refused)?;
        paths
            .check(&self.site, &self.path(check)?)
            .map_err(refused)?;
        Ok(Some(paths))
    }

    /// Returns the true site, vehicle and path before random errors are drawn.
    ///
    /// # Errors
    /// [`SettingsError`] for an invalid truth.
    pub fn actual(&self, check: Check<'_>) -> Result<(Site, Vehicle, Road), SettingsError> {
        let (site, vehicle) = self.truth.depart(&self.site, &self.vehicle, check)?;
        let road = match (&self.motion.path, &site.road) {
            (None, Some(road)) => road.build("truth.site.road", check)?,
            _ => self.path(check)?,
        };
        Ok((site, vehicle, road))
    }

    /// Returns the size of a drive.
    ///
    /// # Errors
    /// [`SettingsError`] for an invalid truth.
    pub fn size(&self, check: Check<'_>) -> Result<DriveSize, SettingsError> {
        let (site, vehicle, road) = self.actual(check)?;
        Ok(DriveSize::new(&self.motion, &site, &vehicle, &road))
    }

    /// Checks that the given number of runs fits into the usual memory.
    ///
    /// # Errors
    /// [`SettingsError`] if the runs do not fit, unless `allow_large` is set.
    pub fn check_runs(&self, runs: usize) -> Result<(), SettingsError> {
        let check = Check { file: &self.name };
        if self.allow_large {
            return Ok(());
        }
        self.size(check)?.check_runs(runs, check)
    }

    /// Checks that the signals can be synthesised as samples.
    ///
    /// # Errors
    /// [`SettingsError::Value`] for a numerology or an SSB index of frequency range 2.
    pub fn check_sends_samples(&self, check: Check<'_>) -> Result<(), SettingsError> {
        check.that(
            [15.0, 30.0].contains(&self.site.ssb.subcarrier_spacing_khz),
            "site.ssb.subcarrier_spacing_khz",
            self.site.ssb.subcarrier_spacing_khz,
            "samples can be synthesised at 15 and 30 kHz",
        )?;
        let count = if self.site.carrier_mhz <= 3000.0 {
            4
        } else {
            8
        };
        for (index, head) in self.site.radio_heads.iter().enumerate() {
            check.that(
                head.ssb_index < count,
                &format!("site.radio_heads[{index}].ssb_index"),
                head.ssb_index,
                &format!("samples can be synthesised for an index below {count} at this carrier"),
            )?;
        }
        Ok(())
    }

    fn check_motion(&self, check: Check<'_>, road: &Road) -> Result<(), SettingsError> {
        let (motion, length_m) = (&self.motion, road.length_m());
        check.that(
            (0.0..length_m).contains(&motion.start_at_m),
            "motion.start_at_m",
            motion.start_at_m,
            &format!("must be on the path, from 0 to {length_m:.1} m"),
        )?;
        let mut before_m = 0.0;
        for (index, stop) in motion.stops.iter().enumerate() {
            let allowed = format!(
                "stops must be in driving order and on the road, here between {before_m} and \
                 {length_m:.1} m"
            );
            let is_on_road = stop.at_m > before_m && stop.at_m < length_m;
            let key = format!("motion.stops[{index}].at_m");
            check.that(is_on_road, &key, stop.at_m, &allowed)?;
            before_m = stop.at_m;
        }
        Ok(())
    }

    /// Rejects a delay spread that is used with snapshots or causes intersymbol interference.
    fn check_iq(&self, check: Check<'_>) -> Result<(), SettingsError> {
        let (key, spread_ns) = ("channel.delay_spread_ns", self.channel.delay_spread_ns);
        // Limit: a quarter of the cyclic prefix (18 of 256 samples). A fraction e⁻⁴ of the scatter
        // exceeds the prefix.
        let prefix_ns = 18.0 / 256.0 * 1e6 / self.site.ssb.subcarrier_spacing_khz;
        let max_ns = 0.25 * prefix_ns;
        let allowed = format!("it must be between 0 and {max_ns}");
        check.that(spread_ns <= max_ns, key, spread_ns, &allowed)?;
        check.that(
            spread_ns == 0.0 || self.fidelity == Fidelity::Iq,
            key,
            spread_ns,
            "requires fidelity = \"iq\"; otherwise it must be 0",
        )?;
        if self.fidelity == Fidelity::Iq {
            self.check_sends_samples(check)?;
        }
        Ok(())
    }
}
