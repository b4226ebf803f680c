//! Site: model of a plant, one file for the whole fleet.

use nr_ssb::band::likely_lmax;
use nr_ssb::{Lmax, SubcarrierSpacing};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use toml::{Table, Value};

use super::check::Check;
use super::error::SettingsError;
use super::radio::{RadioHeadSettings, SsbSettings};
use super::road::RoadSettings;
use super::toml_file::{Library, TomlFile, TomlFormat};
use super::underlay::UnderlaySettings;
use super::walls::WallSettings;
use crate::geometry::Point;
use crate::road::Road;

/// Site file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Site {
    /// Short name.
    pub name: String,
    /// Description of the site.
    #[serde(default)]
    pub description: String,
    /// Carrier frequency of the SSBs' centre, in MHz.
    #[serde(default = "default_carrier_mhz")]
    #[schemars(range(min = 100.0, max = 100_000.0))]
    pub carrier_mhz: f64,
    /// Expected Rician K-factor in dB: power of the line of sight divided by the power of the
    /// scatter.
    #[serde(default = "default_rician_k_db")]
    #[schemars(range(min = -30.0, max = 200.0))]
    pub rician_k_db: f64,
    /// SSBs that the cells transmit.
    #[serde(default)]
    pub ssb: SsbSettings,
    /// Road. Omitted if vehicles move freely.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub road: Option<RoadSettings>,
    /// The radio heads.
    #[schemars(length(min = 1, max = 1000))]
    pub radio_heads: Vec<RadioHeadSettings>,
    /// Walls that obstruct lines of sight.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(length(max = 1000))]
    pub walls: Vec<WallSettings>,
    /// Background image of the maps.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub underlay: Option<UnderlaySettings>,
}

const fn default_carrier_mhz() -> f64 {
    3500.0
}

const fn default_rician_k_db() -> f64 {
    10.0
}

/// Speed of light in m/s (SI, exact).
pub const SPEED_OF_LIGHT_MPS: f64 = 299_792_458.0;

impl Site {
    /// Returns the wavelength of the carrier in metres.
    pub fn wavelength_m(&self) -> f64 {
        SPEED_OF_LIGHT_MPS / (self.carrier_mhz * 1e6)
    }

    /// Returns the number of SSB indices per burst at the site's carrier, from the subcarrier
    /// spacing (TS 38.213, 4.1). If bands at this carrier differ, the larger number is returned.
    pub fn ssb_indices(&self) -> u8 {
        let spacing = match self.ssb.subcarrier_spacing_khz as u16 {
            15 => SubcarrierSpacing::Khz15,
            30 => SubcarrierSpacing::Khz30,
            120 => SubcarrierSpacing::Khz120,
            _ => SubcarrierSpacing::Khz240,
        };
        let size = likely_lmax(spacing, Some(self.carrier_mhz * 1e6));
        let most = if size.certain {
            size.likely
        } else {
            size.likely.max(Lmax::L8)
        };
        most.count()
    }

    /// Returns the road, if the site has one.
    ///
    /// # Errors
    /// [`SettingsError`] if the site was modified into an impossible one; never directly after
    /// reading.
    pub fn build_road(&self) -> Result<Option<Road>, SettingsError> {
        let road = self.road.as_ref();
        road.map(|road| road.build("road", Check { file: &self.name }))
            .transpose()
    }
}

impl TomlFile for Site {
    const WHAT: &'static str = "site";
    const SHIPPED: &'static [(&'static str, &'static str)] = &[
        ("paper", include_str!("../../../../sites/paper.toml")),
        ("trip-1", include_str!("../../../../sites/trip-1.toml")),
        ("trip-2", include_str!("../../../../sites/trip-2.toml")),
        ("trip-4", include_str!("../../../../sites/trip-4.toml")),
        ("yard", include_str!("../../../../sites/yard.toml")),
        ("campus", include_str!("../../../../sites/campus.toml")),
    ];

    fn format() -> &'static TomlFormat<Self> {
        static FORMAT: TomlFormat<Site> = TomlFormat::new();
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
        if let Some(Value::Table(underlay)) = table.get_mut("underlay") {
            UnderlaySettings::resolve(underlay, origin, library);
        }
        match table.get_mut("road") {
            Some(Value::Table(road)) => RoadSettings::resolve(road, "road", origin, library),
            _ => Ok(()),
        }
    }

    fn check(&self, check: Check<'_>) -> Result<(), SettingsError> {
        let road = self.road.as_ref();
        let road = road.map(|road| road.build("road", check)).transpose()?;
        for (index, head) in self.radio_heads.iter().enumerate() {
            head.check(check, index, &self.radio_heads, road.as_ref())?;
        }
        Ok(())
    }
}

impl RadioHeadSettings {
    fn check(
        &self,
        check: Check<'_>,
        index: usize,
        all: &[Self],
        road: Option<&Road>,
    ) -> Result<(), SettingsError> {
        let key = format!("radio_heads[{index}]");
        let is_text = |sign: char| !sign.is_control();
        check.that(
            self.name.chars().count() <= 64 && self.name.chars().all(is_text),
            &format!("{key}.name"),
            format!("{:?}", self.name.chars().take(64).collect::<String>()),
            "it must be of at most 64 characters, none of them a control character",
        )?;
        let [x_m, y_m, _] = self.position_m;
        let position = format!("{:?}", self.position_m);
        if let Some(road) = road {
            let projection = road.project(Point::new(x_m, y_m));
            let half_m = 0.5 * road.width_m();
            let is_on_the_road = (0.0..=road.length_m()).contains(&projection.along_m)
                && projection.lateral_m.abs() <= half_m;
            check.that(
                !is_on_the_road,
                &format!("{key}.position_m"),
                &position,
                &format!(
                    "that is on the road, {:.1} m along it; it must be more than {half_m} m from \
                     its middle",
                    projection.along_m
                ),
            )?;
        }
        if let Some(group) = self.clock_group {
            let members = all.iter().filter(|it| it.clock_group == Some(group));
            check.that(
                members.count() > 1,
                &format!("{key}.clock_group"),
                group,
                "no other radio head has this clock_group; remove it if the radio head has an \
                 oscillator of its own",
            )?;
        }
        for (other_index, other) in all.iter().take(index).enumerate() {
            check.that(
                self.position_m != other.position_m,
                &format!("{key}.position_m"),
                &position,
                &format!("radio_heads[{other_index}] has the same position"),
            )?;
            check.that(
                (self.pci, self.ssb_index) != (other.pci, other.ssb_index),
                &format!("{key}.pci"),
                self.pci,
                &format!(
                    "radio_heads[{other_index}] has the same pci and ssb_index; the pair must be \
                     different for each"
                ),
            )?;
        }
        Ok(())
    }
}
