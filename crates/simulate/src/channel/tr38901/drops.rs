//! Independent drops, for comparisons with other implementations.

use rand::RngExt;
use rand_distr::StandardNormal;

use super::clusters::Clusters;
use super::environment::{Environment, LinkGeometry};
use super::large_scale::{COUNT, Parameters};
use crate::random::{Purpose, Streams};

/// One randomly drawn link.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drop {
    /// Whether the link has a line of sight.
    pub line_of_sight: bool,
    /// Path loss in dB, without shadowing.
    pub path_loss_db: f64,
    /// Shadowing in dB; positive is more power.
    pub shadowing_db: f64,
    /// Rician K in dB; NaN without a line of sight.
    pub k_db: f64,
    /// Delay spread drawn in step 4, in seconds.
    pub delay_spread_s: f64,
    /// Azimuth spread of arrival drawn in step 4, in degrees.
    pub azimuth_spread_deg: f64,
    /// Zenith spread of arrival drawn in step 4, in degrees.
    pub zenith_spread_deg: f64,
    /// Delay spread of the resulting paths in seconds.
    pub paths_delay_spread_s: f64,
    /// Circular azimuth spread of the resulting paths in degrees.
    pub paths_azimuth_spread_deg: f64,
}

/// Draws one link at each position.
pub fn draw_drops(environment: &Environment, links: &[LinkGeometry], seed: u64) -> Vec<Drop> {
    let parameters = [false, true].map(|clear| Parameters::of(environment, clear));
    let mut rng = Streams::new(seed, 0).generator(Purpose::Clusters, 0);
    let drop = |link: &LinkGeometry| {
        let line_of_sight = rng.random::<f64>() < environment.line_of_sight_probability(link);
        let parameters = &parameters[usize::from(line_of_sight)];
        let normals = [(); COUNT].map(|()| rng.sample(StandardNormal));
        let large_scale = parameters.large_scale(&normals);
        let zenith_rad = link.level_m.atan2(link.head_m - link.array_m);
        let clusters = Clusters::draw(parameters, &large_scale, 0.0, zenith_rad, &mut rng);
        let k = 10f64.powf(0.1 * large_scale.k_db);
        Drop {
            line_of_sight,
            path_loss_db: environment.path_loss_db(link, line_of_sight),
            shadowing_db: large_scale.shadowing_db,
            k_db: if line_of_sight {
                large_scale.k_db
            } else {
                f64::NAN
            },
            delay_spread_s: large_scale.delay_spread_s,
            azimuth_spread_deg: large_scale.azimuth_spread_deg,
            zenith_spread_deg: large_scale.zenith_spread_deg,
            paths_delay_spread_s: clusters.delay_spread_s(k),
            paths_azimuth_spread_deg: clusters.azimuth_spread_rad(k, 0.0).to_degrees(),
        }
    };
    links.iter().map(drop).collect()
}
