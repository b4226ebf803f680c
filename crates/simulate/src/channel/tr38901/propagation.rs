//! Channel of TR 38.901 along a drive.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use num_complex::Complex64;
use onboard::link_budget::LinkBudget;
use onboard::radio_head::RadioHead;
use rand_chacha::ChaCha8Rng;

use super::clusters::Clusters;
use super::environment::{Environment, LinkGeometry};
use super::large_scale::{COUNT, LargeScale, Parameters};
use super::normal;
use super::track::Track;
use crate::channel::blockage::Blockage;
use crate::channel::propagation::{Link, Propagation};
use crate::phasor::phasor;
use crate::random::Purpose;
use crate::scenario::ChannelSettings;
use crate::world::{Antennas, LineOfSight};

/// Relative power below which a scatter component is not computed.
const NEGLIGIBLE: f64 = 1e-4;

/// Soft state above which the link has a line of sight.
const LINE_OF_SIGHT: f64 = 0.5;

/// Propagation from one radio head in one run.
///
/// Two channels, with and without a line of sight, are mixed by a soft line-of-sight state
/// (7.6.3.3). The state is a normal process of position, and its threshold follows from the
/// line-of-sight probability at the position.
#[derive(Debug, Clone)]
pub struct Tr38901Propagation {
    environment: Environment,
    budget: LinkBudget,
    head: RadioHead,
    array_m: f64,
    wavenumber_per_m: f64,
    oracle_nlos_rejection: bool,
    blockage: Blockage,
    state: Track,
    clear: Channel,
    hidden: Channel,
}

/// Channel with or without a line of sight.
#[derive(Debug, Clone)]
struct Channel {
    parameters: Parameters,
    tracks: [Track; COUNT],
    /// Clusters at intervals of `cluster_correlation_m` along the road.
    clusters: Vec<Clusters>,
}

/// Amplitudes of the components at one position. The sum of their squares is one.
struct Mix {
    gain_db: f64,
    direct: f64,
    clear: f64,
    hidden: f64,
}

impl Tr38901Propagation {
    /// Draws the propagation of a link.
    pub fn new(
        environment: Environment,
        settings: &ChannelSettings,
        link: &Link<'_>,
    ) -> Option<Self> {
        let mut head = link.radio_head()?;
        let [_, _, array_m] = link.vehicle.array.position_m;
        let [head_m, array_m] = environment.heights_m(head.height_m, array_m);
        head.height_m = head_m;
        let length_m = link.road.length_m();
        let mut large_scale = link.streams.generator(Purpose::LargeScale, link.head);
        let state = Track::new(
            environment.state_correlation_m(),
            length_m,
            &mut large_scale,
        );
        let mut clusters = link.streams.generator(Purpose::Clusters, link.head);
        let mut channel = |line_of_sight| {
            let parameters = Parameters::of(&environment, line_of_sight);
            let generators = [&mut large_scale, &mut clusters];
            Channel::new(parameters, &head, array_m, link, generators)
        };
        let [clear, hidden] = [channel(true), channel(false)];
        Some(Self {
            environment,
            budget: LinkBudget::new(link.site, link.vehicle),
            head,
            array_m,
            wavenumber_per_m: TAU / link.site.wavelength_m(),
            oracle_nlos_rejection: settings.oracle_nlos_rejection,
            blockage: Blockage::new(settings.blockage, link),
            state,
            clear,
            hidden,
        })
    }

    fn mix(&self, sight: &LineOfSight) -> Mix {
        let link = LinkGeometry {
            level_m: sight.place.distance_m(self.head.position),
            head_m: self.head.height_m,
            array_m: self.array_m,
        };
        let along_m = sight.along_m;
        let threshold = normal::quantile(self.environment.line_of_sight_probability(&link));
        // Equation (7.6-17), with λ in metres.
        let sharpness = (20.0 * self.wavenumber_per_m / TAU).sqrt();
        let soft = 0.5 + (sharpness * (self.state.at(along_m) + threshold)).atan() / PI;
        let [clear, hidden] =
            [(&self.clear, true), (&self.hidden, false)].map(|(channel, clear)| {
                let large_scale = channel.large_scale(along_m);
                let loss_db = self.environment.path_loss_db(&link, clear);
                let gain = 10f64.powf(0.1 * (large_scale.shadowing_db - loss_db));
                (gain, 10f64.powf(0.1 * large_scale.k_db))
            });
        let k = clear.1;
        let clear = soft * soft * clear.0;
        let hidden = (1.0 - soft * soft) * hidden.0;
        let total = clear + hidden;
        let is_silent = self.oracle_nlos_rejection && soft < LINE_OF_SIGHT;
        let gain = if is_silent { 0.0 } else { total };
        Mix {
            gain_db: 10.0 * gain.log10() + self.budget.path_loss_db(sight.distance_m),
            direct: (clear / total * k / (k + 1.0)).sqrt(),
            clear: (clear / total / (k + 1.0)).sqrt(),
            hidden: (hidden / total).sqrt(),
        }
    }
}

impl Propagation for Tr38901Propagation {
    fn next_gain_db(&mut self, sight: &LineOfSight) -> f64 {
        self.mix(sight).gain_db
    }

    fn response(
        &self,
        sight: &LineOfSight,
        antennas: &Antennas,
        step_hz: f64,
        into: &mut [Complex64],
    ) {
        let elements = antennas.elements();
        let mix = self.mix(sight);
        let turn = phasor(-self.wavenumber_per_m * sight.distance_m);
        let direct = turn * mix.direct * self.blockage.amplitude(sight);
        into.fill(Complex64::ZERO);
        for gains in into.chunks_exact_mut(elements) {
            antennas.add(direct, sight.towards, gains);
        }
        for (channel, amplitude) in [(&self.clear, mix.clear), (&self.hidden, mix.hidden)] {
            for (clusters, weight) in channel.clusters_at(sight.along_m) {
                let weight = weight * amplitude;
                if weight * weight > NEGLIGIBLE {
                    let weight = Complex64::from(weight);
                    let k = self.wavenumber_per_m;
                    clusters.add(weight, sight, antennas, k, step_hz, into);
                }
            }
        }
    }
}

impl Channel {
    fn new(
        parameters: Parameters,
        head: &RadioHead,
        array_m: f64,
        link: &Link<'_>,
        [large_scale, small_scale]: [&mut ChaCha8Rng; 2],
    ) -> Self {
        let length_m = link.road.length_m();
        let tracks = parameters
            .correlation_m
            .map(|correlation_m| Track::new(correlation_m, length_m, large_scale));
        let mut channel = Self {
            parameters,
            tracks,
            clusters: Vec::new(),
        };
        let every_m = channel.parameters.cluster_correlation_m;
        for number in 0..=(length_m / every_m).ceil() as usize {
            let along_m = (every_m * number as f64).min(length_m);
            let place = link.road.pose(along_m).point();
            let level_m = place.distance_m(head.position);
            let clusters = Clusters::draw(
                &channel.parameters,
                &channel.large_scale(along_m),
                place.bearing_rad(head.position),
                level_m.atan2(head.height_m - array_m),
                small_scale,
            );
            channel.clusters.push(clusters);
        }
        channel
    }

    fn large_scale(&self, along_m: f64) -> LargeScale {
        let normals = std::array::from_fn(|index| self.tracks[index].at(along_m));
        self.parameters.large_scale(&normals)
    }

    /// Returns the previous and next clusters and their amplitudes. The sum of the squared
    /// amplitudes is one.
    fn clusters_at(&self, along_m: f64) -> impl Iterator<Item = (&Clusters, f64)> {
        let place = (along_m / self.parameters.cluster_correlation_m).max(0.0);
        let index = (place as usize).min(self.clusters.len().saturating_sub(2));
        let (sin, cos) = (FRAC_PI_2 * (place - index as f64).min(1.0)).sin_cos();
        let two = self.clusters.get(index..).unwrap_or_default();
        two.iter().zip([cos, sin])
    }
}
