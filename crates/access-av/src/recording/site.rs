//! What a vehicle has to know of a site: radio heads where they were surveyed, the road, its array.
//!
//! A site file has the tables of a scenario that a vehicle needs, with a vehicle's defaults: the
//! tracker, every SSB, all pilots. Beside them it may have
//!
//! ```toml
//! pci_allow_list = [1, 7]              # cells to listen to; all of the radio heads' without
//! channel_gains = [[1.0, 0.0], [0.9, 0.1], [1.0, -0.2], [1.1, 0.0]] # re, im of each antenna
//!
//! [initial_pose]                       # without it the vehicle is found along the road
//! x_m = 0.0
//! y_m = 0.0
//! heading_rad = 0.0
//! ```

use std::fs;
use std::path::Path;

use num_complex::Complex64;
use serde::{Deserialize, Serialize};
use toml::{Table, Value};

use crate::geometry::Pose;
use crate::observation::ANTENNAS;
use crate::receive::ReceiverConfig;
use crate::scenario::{Check, LocalizerSettings, Scenario, ScenarioError, read};

/// Keys of a site file that a scenario does not have.
const OWN_KEYS: [&str; 3] = ["pci_allow_list", "channel_gains", "initial_pose"];

/// A site as the vehicle knows it.
#[derive(Debug, Clone, PartialEq)]
pub struct Site {
    /// Radio heads, road, array and localizer.
    pub scenario: Scenario,
    /// Where the vehicle starts; `None` to find it along the road.
    pub initial_pose: Option<Pose>,
    /// Complex gain of each channel, by which it is divided.
    pub channel_gains: [Complex64; ANTENNAS],
}

#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct OwnKeys {
    #[serde(skip_serializing_if = "Option::is_none")]
    pci_allow_list: Option<Vec<u16>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    channel_gains: Option<[[f64; 2]; ANTENNAS]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    initial_pose: Option<Pose>,
}

impl Site {
    /// Reads a site file.
    ///
    /// # Errors
    /// [`ScenarioError`] naming the key and what is allowed: two radio heads in one place or with
    /// one identity, a cell on the list that no radio head has, no initial pose where it takes one.
    pub fn read(file: &Path) -> Result<Self, ScenarioError> {
        let origin = file.display().to_string();
        let text = fs::read_to_string(file).map_err(|source| ScenarioError::Read {
            file: origin.clone(),
            source,
        })?;
        Self::from_toml(&text, &origin)
    }

    /// Reads a site from TOML; errors name `origin` as the file.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn from_toml(text: &str, origin: &str) -> Result<Self, ScenarioError> {
        let check = Check { file: origin };
        let mut table = read::parse(text, origin)?;
        let own = OWN_KEYS
            .iter()
            .filter_map(|key| table.remove_entry(*key))
            .collect();
        let own: OwnKeys = read::settings(own, origin)?;
        let has_road = table.contains_key("track");
        fill_in(&mut table, has_road);
        let known = own.initial_pose.is_some();
        let stated = table.get_mut("start").and_then(|start| {
            start
                .as_table_mut()?
                .insert("known".to_owned(), true.into())
        });
        if let Some(stated) = stated.filter(|stated| *stated != Value::Boolean(known)) {
            let allowed = "in a site file this is for the presence of `initial_pose` to say";
            return Err(check.error("start.known", stated, allowed));
        }
        let mut scenario = Scenario::from_table(table, origin)?;
        if let Some(list) = &own.pci_allow_list {
            for (index, pci) in list.iter().enumerate() {
                check.that(
                    scenario.radio_heads.iter().any(|head| head.pci == *pci),
                    &format!("pci_allow_list[{index}]"),
                    pci,
                    "a radio head with this pci must be among `radio_heads`",
                )?;
            }
            scenario.radio_heads.retain(|head| list.contains(&head.pci));
            let some = !scenario.radio_heads.is_empty();
            check.that(
                some,
                "pci_allow_list",
                "empty",
                "leave it out to listen to all",
            )?;
        }
        let gains = own.channel_gains.unwrap_or([[1.0, 0.0]; ANTENNAS]);
        for (index, [re, im]) in gains.iter().enumerate() {
            let usable = (re * re + im * im).is_normal();
            let key = format!("channel_gains[{index}]");
            check.that(usable, &key, format!("[{re}, {im}]"), "it must not be zero")?;
        }
        Self {
            scenario,
            initial_pose: None,
            channel_gains: gains.map(|[re, im]| Complex64::new(re, im)),
        }
        .starting_at(own.initial_pose, origin)
    }

    /// The site with another start, or with none, to find the vehicle along the road. Errors name
    /// `origin` as the file.
    ///
    /// # Errors
    /// [`ScenarioError`] when there is no start, and not what finding the vehicle takes.
    pub fn starting_at(mut self, start: Option<Pose>, origin: &str) -> Result<Self, ScenarioError> {
        let with_map = matches!(&self.scenario.localizer, LocalizerSettings::Tracker(it) if it.map);
        Check { file: origin }.that(
            start.is_some() || (with_map && self.scenario.radio_heads.len() > 1),
            "initial_pose",
            "missing",
            "to find the vehicle without it takes a `track`, which localizer.map must not be \
             switched off for, and two radio heads or more",
        )?;
        self.scenario.start.known = start.is_some();
        self.initial_pose = start;
        Ok(self)
    }

    /// The site of a scenario, as a surveyor and a calibration would find it.
    pub fn of_scenario(
        scenario: &Scenario,
        initial_pose: Pose,
        channel_gains: [Complex64; ANTENNAS],
    ) -> String {
        let own = OwnKeys {
            pci_allow_list: None,
            channel_gains: Some(channel_gains.map(|gain| [gain.re, gain.im])),
            initial_pose: scenario.start.known.then_some(initial_pose),
        };
        // Settings read from TOML can be written as TOML.
        let mut table = Table::try_from(scenario).unwrap_or_default();
        let simulated = [
            "description",
            "fidelity",
            "iq",
            "estimator",
            "wake_up",
            "platform",
        ];
        table.retain(|key, _| !simulated.contains(&key));
        if !matches!(scenario.localizer, LocalizerSettings::Tracker(_)) {
            table.remove("localizer");
        }
        if let Some(Value::Table(start)) = table.get_mut("start") {
            start.remove("known");
        }
        table.extend(Table::try_from(own).unwrap_or_default());
        if let Some(Value::Table(receiver)) = table.get_mut("receiver") {
            receiver.remove("pilots");
        }
        toml::to_string_pretty(&table).unwrap_or_default()
    }

    /// What the site's receiver is told.
    pub fn receiver_config(&self) -> ReceiverConfig {
        ReceiverConfig {
            calibration: self.channel_gains,
            ..ReceiverConfig::new(&self.scenario)
        }
    }
}

/// A vehicle's defaults in place of a scenario's.
fn fill_in(table: &mut Table, has_road: bool) {
    let mut default = |path: [&str; 2], value: Value| {
        let [key, name] = path;
        let entry = table
            .entry(key)
            .or_insert_with(|| Value::Table(Table::new()));
        if let Value::Table(entry) = entry {
            entry.entry(name).or_insert(value);
        }
    };
    default(["localizer", "kind"], "tracker".into());
    default(["wake_up", "policy"], "fixed".into());
    default(["wake_up", "interval_ms"], Value::Float(1.0));
    default(["receiver", "pilots"], "ssb".into());
    default(["estimator", "method"], "maximum-likelihood".into());
    default(["start", "position_std_m"], Value::Float(0.5));
    default(["start", "heading_std_rad"], Value::Float(0.05));
    if !has_road {
        default(["localizer", "map"], Value::Boolean(false));
        // A scenario needs a road; without a map the tracker never looks at it.
        let far = Table::from_iter([("x_m".to_owned(), Value::Float(1e6))]);
        default(["track", "start"], Value::Table(far));
        let one = Table::from_iter([("length_m".to_owned(), Value::Float(1.0))]);
        default(["track", "segments"], Value::Array(vec![Value::Table(one)]));
    }
    table.entry("name").or_insert("site".into());
}
