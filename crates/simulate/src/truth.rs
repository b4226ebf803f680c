//! The one place where truth is made, from what is believed.

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

/// Makes the propagation over a link.
pub type PropagationMaker = dyn Fn(&Link<'_>) -> Box<dyn Propagation> + Send + Sync;

/// What is so on average, over all runs: what is believed, and how the world departs from it.
#[derive(Clone)]
pub struct World {
    scenario: Arc<Scenario>,
    site: Site,
    vehicle: Vehicle,
    road: Road,
    motion: MotionProfile,
    propagation: Arc<PropagationMaker>,
}

/// What is so in one run.
pub struct Truth {
    /// The site: radio heads where they stand, with the power they send.
    pub site: Site,
    /// The vehicle, as it is built and measures.
    pub vehicle: Vehicle,
    /// The radio heads of that site, those that the vehicle does not listen to included.
    pub heads: Vec<RadioHead>,
    /// The array, at the start of the drive.
    pub array: TrueArray,
    /// The odometer, at the start of the drive.
    pub odometer: Odometer,
    /// Where the vehicle drives.
    pub path: Path,
    /// The initial pose as the vehicle is told it: a measurement, as wrong as stated.
    pub told_start: Pose,
    /// How each radio head's signal comes to the vehicle.
    pub propagation: Vec<Box<dyn Propagation>>,
}

impl World {
    /// The world of a scenario.
    ///
    /// # Errors
    /// [`SettingsError`] when the scenario has been changed by hand into an impossible one; never
    /// after reading.
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

    /// The world with another propagation.
    #[must_use]
    pub fn with_propagation(mut self, propagation: Arc<PropagationMaker>) -> Self {
        self.propagation = propagation;
        self
    }

    /// The scenario.
    pub fn scenario(&self) -> &Scenario {
        &self.scenario
    }

    /// Duration of the drive in seconds; wandering takes no time.
    pub const fn duration_s(&self) -> f64 {
        self.motion.duration_s()
    }

    /// Whether what an SSB brings depends neither on when it is heard nor on which others are.
    pub(crate) fn is_independent_of_listening(&self) -> bool {
        let scenario = &self.scenario;
        scenario.fidelity == Fidelity::Snapshots
            && scenario.ssb_latency_ms == 0.0
            && self.vehicle.receiver.snr_noise_db == 0.0
    }

    /// Whether the same comes to the vehicle in another world, run by run. Both are taken to have
    /// their scenario's own propagation.
    pub(crate) fn sounds_like(&self, other: &Self) -> bool {
        let besides = |scenario: &Scenario| Scenario {
            name: String::new(),
            description: String::new(),
            site: self.site.clone(),
            vehicle: what_it_is(&scenario.vehicle),
            truth: TruthSettings {
                std_factor: scenario.truth.factor(),
                ..TruthSettings::default()
            },
            ..scenario.clone()
        };
        self.site == other.site
            && what_it_is(&self.vehicle) == what_it_is(&other.vehicle)
            && self.road == other.road
            && besides(&self.scenario) == besides(&other.scenario)
    }

    /// What is so in the run that `streams` belongs to: every value drawn from its standard
    /// deviation.
    pub fn draw(&self, streams: Streams) -> Truth {
        let factor = self.scenario.truth.factor();
        let (mut site, mut vehicle) = (self.site.clone(), self.vehicle.clone());
        for (index, head) in site.radio_heads.iter_mut().enumerate() {
            let mut rng = streams.generator(Purpose::Survey, index);
            let mut normal = || factor * rng.sample::<f64, _>(StandardNormal);
            let [x_m, y_m, _] = &mut head.position_m;
            *x_m += head.position_std_m * normal();
            *y_m += head.position_std_m * normal();
            let eirp_dbm = head.eirp_dbm + head.eirp_std_db * normal();
            // More than a site's file may say is drawn of none.
            let (least, most) = (
                RadioHeadSettings::LEAST_EIRP_DBM,
                RadioHeadSettings::MOST_EIRP_DBM,
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
        // The odometer's noise goes on from what its constants were drawn by.
        let mut noise = streams.generator(Purpose::Odometer, 0);
        let mut normal = || factor * noise.sample::<f64, _>(StandardNormal);
        vehicle.odometer.scale += vehicle.odometer.scale_std * normal();
        let bias = normal();
        if let Some(gyroscope) = &mut vehicle.gyroscope {
            gyroscope.bias_radps += gyroscope.bias_std_radps * bias;
        }
        let mut clock = streams.generator(Purpose::Clock, 0);
        let receiver = &mut vehicle.receiver;
        let lateness_std_s = factor * receiver.lateness_std_s.unwrap_or_default();
        receiver.lateness_s += lateness_std_s * clock.sample::<f64, _>(StandardNormal);

        let keeping = vehicle.lane_keeping.process();
        let path = Path::new(self.road.clone(), self.motion.clone(), keeping, streams);
        let start = path.at(0.0);
        let told = &self.scenario.vehicle.start;
        let mut rng = streams.generator(Purpose::Start, 0);
        let mut normal = || factor * rng.sample::<f64, _>(StandardNormal);
        let told_start = Pose {
            x_m: start.pose.x_m + told.position_std_m * normal(),
            y_m: start.pose.y_m + told.position_std_m * normal(),
            heading_rad: start.pose.heading_rad + told.heading_std_rad * normal(),
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
            told_start,
            site,
            vehicle,
        }
    }
}

/// A vehicle without what its estimator, localizer, wake-up policy and computer are set to.
fn what_it_is(vehicle: &Vehicle) -> Vehicle {
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

/// The scenario's own.
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
