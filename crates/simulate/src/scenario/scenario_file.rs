//! A scenario file.

use std::path::Path;

use onboard::settings::{Check, Library, SettingsError, Site, TomlFile, Vehicle, check_together};
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

/// Everything a simulated drive depends on, besides the seed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scenario {
    /// Short name; also the name of its results.
    pub name: String,
    /// What the scenario is for.
    #[serde(default)]
    pub description: String,
    /// How much of the radio is simulated.
    #[serde(default)]
    pub fidelity: Fidelity,
    /// Whether a drive may be longer than fits into usual memory and patience.
    #[serde(default)]
    pub allow_large: bool,
    /// How long after its reception an SSB reaches the localizer, in ms.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 10_000.0))]
    pub ssb_latency_ms: f64,
    /// The site, as it is believed to be: a name, or the site itself.
    #[schemars(schema_with = "named_or_held::<Site>")]
    pub site: Site,
    /// The vehicle, as it is believed to be: a name, or the vehicle itself.
    #[schemars(schema_with = "named_or_held::<Vehicle>")]
    pub vehicle: Vehicle,
    /// How the vehicle drives.
    #[serde(default)]
    pub motion: MotionSettings,
    /// What happens to the signal on its way.
    #[serde(default)]
    pub channel: ChannelSettings,
    /// What the receiver's hardware does to the samples, where they are simulated.
    #[serde(default)]
    pub iq: IqSettings,
    /// How the world departs from what is believed.
    #[serde(default)]
    pub truth: TruthSettings,
    /// What goes wrong on the way.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(length(max = 1000))]
    pub faults: Vec<FaultSettings>,
}

/// How much of the radio is simulated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Fidelity {
    /// Array snapshots drawn from the channel, as in the paper.
    #[default]
    Snapshots,
    /// Samples of every SSB at every antenna, received as a recording is (`[iq]`).
    Iq,
}

pub(super) fn named_or_held<T: JsonSchema>(generator: &mut SchemaGenerator) -> Schema {
    let held = generator.subschema_for::<T>();
    json_schema!({
        "oneOf": [
            { "type": "string", "description": "A shipped name, or the path of a file." },
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
            // Written out elsewhere, the scenario still means the same file.
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

/// Puts a site or vehicle in the place of its name.
pub(super) fn hold<T: TomlFile>(
    table: &mut Table,
    origin: &str,
    library: &dyn Library,
) -> Result<(), SettingsError> {
    let held = match table.get(T::WHAT).cloned() {
        Some(Value::String(name)) => {
            let named = library.text(T::WHAT, T::SHIPPED, &name, origin);
            let named = named.map_err(|error| error.beneath(origin, T::WHAT))?;
            T::from_toml(&named.text, &named.origin, library)?
        }
        Some(Value::Table(held)) => {
            T::from_table(held, origin, library).map_err(|error| error.beneath(origin, T::WHAT))?
        }
        _ => return Ok(()), // missing, or of another type, is for the reader to refuse
    };
    let held = Table::try_from(&held).unwrap_or_default();
    table.insert(T::WHAT.to_owned(), Value::Table(held));
    Ok(())
}

impl Scenario {
    /// What is driven along, as it is believed to lie: the motion's path, or the site's road.
    ///
    /// # Errors
    /// [`SettingsError::Value`] where there is neither.
    pub fn path(&self, check: Check<'_>) -> Result<Road, SettingsError> {
        match (&self.motion.path, &self.site.road) {
            (Some(path), _) => path.build("motion.path", check),
            (None, Some(road)) => road.build("site.road", check),
            (None, None) => {
                let allowed = "the site has no road to drive along; give a path";
                Err(check.error("motion.path", "missing", allowed))
            }
        }
    }

    /// The traced paths, of a scenario that has them.
    ///
    /// # Errors
    /// [`SettingsError::Value`] for a file that cannot be read, or is of another site.
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

    /// What is so on average, over all runs: the site, the vehicle, and what it drives along.
    ///
    /// # Errors
    /// [`SettingsError`] for a truth that cannot be.
    pub fn actual(&self, check: Check<'_>) -> Result<(Site, Vehicle, Road), SettingsError> {
        let (site, vehicle) = self.truth.depart(&self.site, &self.vehicle, check)?;
        let road = match (&self.motion.path, &site.road) {
            (None, Some(road)) => road.build("truth.site.road", check)?,
            _ => self.path(check)?,
        };
        Ok((site, vehicle, road))
    }

    /// How large a drive is.
    ///
    /// # Errors
    /// [`SettingsError`] for a truth that cannot be.
    pub fn size(&self, check: Check<'_>) -> Result<DriveSize, SettingsError> {
        let (site, vehicle, road) = self.actual(check)?;
        Ok(DriveSize::new(&self.motion, &site, &vehicle, &road))
    }

    /// Refuses to hold more runs in memory than it is likely to have.
    ///
    /// # Errors
    /// [`SettingsError`], unless `allow_large`.
    pub fn check_runs(&self, runs: usize) -> Result<(), SettingsError> {
        let check = Check { file: &self.name };
        if self.allow_large {
            return Ok(());
        }
        self.size(check)?.check_runs(runs, check)
    }

    /// Refuses what cannot be sent as samples.
    ///
    /// # Errors
    /// [`SettingsError::Value`] for a numerology or an SSB index of frequency range 2.
    pub fn check_sends_samples(&self, check: Check<'_>) -> Result<(), SettingsError> {
        check.that(
            [15.0, 30.0].contains(&self.site.ssb.subcarrier_spacing_khz),
            "site.ssb.subcarrier_spacing_khz",
            self.site.ssb.subcarrier_spacing_khz,
            "samples can be made at 15 and 30",
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
                &format!("samples can be made of an index below {count} at this carrier"),
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
            &format!("it must be on the road, from 0 to {length_m:.1} m"),
        )?;
        let mut before_m = 0.0;
        for (index, stop) in motion.stops.iter().enumerate() {
            let allowed = format!(
                "stops must be in driving order and on the road, here between {before_m} and \
                 {length_m:.1} m"
            );
            let on_the_way = stop.at_m > before_m && stop.at_m < length_m;
            let key = format!("motion.stops[{index}].at_m");
            check.that(on_the_way, &key, stop.at_m, &allowed)?;
            before_m = stop.at_m;
        }
        Ok(())
    }

    /// Refuses delays that snapshots cannot show, or that symbols would run into each other by.
    fn check_iq(&self, check: Check<'_>) -> Result<(), SettingsError> {
        let (key, spread_ns) = ("channel.delay_spread_ns", self.channel.delay_spread_ns);
        // A quarter of the prefix, 18 samples of a symbol's 256: e⁻⁴ of the scatter comes later.
        let prefix_ns = 18.0 / 256.0 * 1e6 / self.site.ssb.subcarrier_spacing_khz;
        let most_ns = 0.25 * prefix_ns;
        let allowed = format!("it must be between 0 and {most_ns}");
        check.that(spread_ns <= most_ns, key, spread_ns, &allowed)?;
        check.that(
            spread_ns == 0.0 || self.fidelity == Fidelity::Iq,
            key,
            spread_ns,
            "it acts on samples only, with fidelity = \"iq\"; else it must be 0",
        )?;
        if self.fidelity == Fidelity::Iq {
            self.check_sends_samples(check)?;
        }
        Ok(())
    }
}
