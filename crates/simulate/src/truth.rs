//! Derivation of the truth from the nominal models. No other module derives truth.

use std::sync::Arc;

use onboard::geometry::Pose;
use onboard::radio_head::RadioHead;
use onboard::road::Road;
use onboard::settings::{
    Check, EstimatorSettings, LocalizerSettings, PlatformSettings, RadioHeadSettings,
    SettingsError, Site, Vehicle,
};
use rand::RngExt;
use rand_distr::StandardNormal;

use crate::channel::tr38901::Environment;
use crate::channel::{Link, Propagation, RicianPropagation, Tr38901Propagation, TracedPropagation};
use crate::random::{Purpose, Streams};
use crate::scenario::{Fidelity, Scenario, TruthSettings};
use crate::world::{MotionProfile, Odometer, Path, TrueArray};

/// Factory of the propagation over a link.
pub type PropagationMaker = dyn Fn(&Link<'_>) -> Box<dyn Propagation> + Send + Sync;

/// Environment of all runs of a scenario: nominal models and systematic deviations of the truth.
#[derive(Clone)]
pub struct World {
    scenario: Arc<Scenario>,
    site: Site,
    vehicle: Vehicle,
    road: Road,
    motion: MotionProfile,
    propagation: Arc<PropagationMaker>,
}

/// Truth of one run.
pub struct Truth {
    /// Site with the true positions and transmit powers of the radio heads.
    pub site: Site,
    /// Vehicle with its true properties.
    pub vehicle: Vehicle,
    /// Radio heads of the true site, including those that the vehicle does not use.
    pub heads: Vec<RadioHead>,
    /// Array at the start of the run.
    pub array: TrueArray,
    /// Odometer at the start of the run.
    pub odometer: Odometer,
    /// Path of the vehicle.
    pub path: Path,
    /// Initial pose with a random error of its specified covariance, as given to the vehicle.
    pub given_start: Pose,
    /// Propagation from each radio head.
    pub propagation: Vec<Box<dyn Propagation>>,
}

impl World {
    /// Creates the environment of a scenario.
    ///
    /// # Errors
    /// [`SettingsError`] if the scenario was changed by code to an invalid one. A scenario that was
    /// read from a file is valid.
    pub fn new(scenario: &Scenario) -> Result<Self, SettingsError> {
        let check = Check {
            file: &scenario.name,
        };
        let (site, vehicle, road) = scenario.actual(check)?;
        let motion = MotionProfile::new(&scenario.motion, &vehicle, road.length_m());
        Ok(Self {
            scenario: Arc::new(scenario.clone()),
            site,
            vehicle,
            road,
            motion,
            propagation: default_propagation(scenario, check)?,
        })
    }

    /// Replaces the propagation.
    #[must_use]
    pub fn with_propagation(mut self, propagation: Arc<PropagationMaker>) -> Self {
        self.propagation = propagation;
        self
    }

    /// Returns the scenario.
    pub fn scenario(&self) -> &Scenario {
        &self.scenario
    }

    /// Returns the duration of the drive in seconds. Lateral wander does not change it.
    pub const fn duration_s(&self) -> f64 {
        self.motion.duration_s()
    }

    /// Whether the signal of an SSB is independent of the time of processing and of the reception
    /// of other SSBs.
    pub(crate) fn is_independent_of_listening(&self) -> bool {
        let scenario = &self.scenario;
        scenario.fidelity == Fidelity::Snapshots
            && scenario.ssb_latency_ms == 0.0
            && self.vehicle.receiver.snr_noise_db == 0.0
    }

    /// Whether the vehicle receives equal signals in another environment in each run. Both
    /// environments are assumed to use the propagation of their scenario.
    pub(crate) fn has_equal_signals(&self, other: &Self) -> bool {
        let without_compared_parts = |scenario: &Scenario| Scenario {
            name: String::new(),
            description: String::new(),
            site: self.site.clone(),
            vehicle: physical_properties(&scenario.vehicle),
            truth: TruthSettings {
                std_factor: scenario.truth.std_factor,
                ..TruthSettings::default()
            },
            ..scenario.clone()
        };
        self.site == other.site
            && physical_properties(&self.vehicle) == physical_properties(&other.vehicle)
            && self.road == other.road
            && without_compared_parts(&self.scenario) == without_compared_parts(&other.scenario)
    }

    /// Draws the truth of the run that `streams` belongs to. Each value gets an error with its
    /// standard deviation.
    pub fn draw(&self, streams: Streams) -> Truth {
        let factor = self.scenario.truth.std_factor;
        let (mut site, mut vehicle) = (self.site.clone(), self.vehicle.clone());
        for (index, head) in site.radio_heads.iter_mut().enumerate() {
            let mut rng = streams.generator(Purpose::Survey, index);
            let mut normal = || factor * rng.sample::<f64, _>(StandardNormal);
            let [x_m, y_m, _] = &mut head.position_m;
            *x_m += head.position_std_m * normal();
            *y_m += head.position_std_m * normal();
            let eirp_dbm = head.eirp_dbm + head.eirp_std_db * normal();
            // Limit the drawn power to the range of a site file.
            let (least, most) = (
                RadioHeadSettings::MIN_EIRP_DBM,
                RadioHeadSettings::MAX_EIRP_DBM,
            );
            head.eirp_dbm = eirp_dbm.clamp(least, most);
        }
        let mut walk = streams.generator(Purpose::Array, 0);
        let mut normal = || factor * walk.sample::<f64, _>(StandardNormal);
        let array = &mut vehicle.array;
        array.mounting_rad += array.mounting_std_rad.unwrap_or(0.0) * normal();
        array.phase_rad += array.phase_std_rad.unwrap_or(0.0) * normal();
        let mut place = streams.generator(Purpose::Array, 1);
        let mut normal = || factor * place.sample::<f64, _>(StandardNormal);
        let [forward_m, left_m, _] = &mut array.position_m;
        *forward_m += array.position_std_m * normal();
        *left_m += array.position_std_m * normal();
        // One generator draws first the constants and then the noise of the odometer.
        let mut noise = streams.generator(Purpose::Odometer, 0);
        let mut normal = || factor * noise.sample::<f64, _>(StandardNormal);
        vehicle.odometer.scale += vehicle.odometer.scale_std * normal();
        let bias = normal();
        if let Some(gyroscope) = &mut vehicle.gyroscope {
            gyroscope.bias_radps += gyroscope.bias_std_radps * bias;
        }
        let mut clock = streams.generator(Purpose::Clock, 0);
        let receiver = &mut vehicle.receiver;
        let angle_time_offset_std_s = factor * receiver.angle_time_offset_std_s.unwrap_or_default();
        receiver.angle_time_offset_s +=
            angle_time_offset_std_s * clock.sample::<f64, _>(StandardNormal);

        let keeping = vehicle.lane_keeping.process();
        let path = Path::new(self.road.clone(), self.motion.clone(), keeping, streams);
        let start = path.at(0.0);
        let specified = &self.scenario.vehicle.start;
        let mut rng = streams.generator(Purpose::Start, 0);
        let mut normal = || factor * rng.sample::<f64, _>(StandardNormal);
        let given_start = Pose {
            x_m: start.pose.x_m + specified.position_std_m * normal(),
            y_m: start.pose.y_m + specified.position_std_m * normal(),
            heading_rad: start.pose.heading_rad + specified.heading_std_rad * normal(),
        };
        Truth {
            heads: site.radio_heads.iter().map(RadioHead::from).collect(),
            array: TrueArray::new(vehicle.array.clone(), walk),
            odometer: Odometer::new(vehicle.odometer, vehicle.gyroscope, noise, start),
            propagation: (0..site.radio_heads.len())
                .map(|head| {
                    (self.propagation)(&Link {
                        site: &site,
                        vehicle: &vehicle,
                        road: &self.road,
                        duration_s: self.motion.duration_s(),
                        head,
                        streams,
                    })
                })
                .collect(),
            path,
            given_start,
            site,
            vehicle,
        }
    }
}

/// Returns the physical properties of a vehicle, with default estimator, localizer, wake-up policy
/// and computer.
fn physical_properties(vehicle: &Vehicle) -> Vehicle {
    Vehicle {
        name: String::new(),
        description: String::new(),
        estimator: EstimatorSettings::default(),
        localizer: LocalizerSettings::default(),
        integrity: None,
        wake_up: None,
        platform: PlatformSettings::default(),
        ..vehicle.clone()
    }
}

/// Returns the propagation of the scenario's channel model.
fn default_propagation(
    scenario: &Scenario,
    check: Check<'_>,
) -> Result<Arc<PropagationMaker>, SettingsError> {
    let channel = scenario.channel.clone();
    let paths = scenario.traced_paths(check)?.map(Arc::new);
    Ok(Arc::new(move |link| {
        let traced = (paths.clone()).and_then(|it| TracedPropagation::new(it, &channel, link));
        if let Some(traced) = traced {
            return Box::new(traced);
        }
        let carrier_ghz = 1e-3 * link.site.carrier_mhz;
        let environment = Environment::of(channel.model, carrier_ghz, channel.hall);
        match environment.and_then(|it| Tr38901Propagation::new(it, &channel, link)) {
            Some(propagation) => Box::new(propagation),
            None => Box::new(RicianPropagation::new(&channel, link)),
        }
    }))
}
