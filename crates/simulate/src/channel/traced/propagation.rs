//! Propagation along ray-traced paths.

use std::f64::consts::TAU;
use std::sync::Arc;

use num_complex::Complex64;
use onboard::link_budget::LinkBudget;
use onboard::observation::MAX_ELEMENTS;

use super::paths::{Paths, TracedPath};
use crate::channel::blockage::Blockage;
use crate::channel::propagation::{Link, Propagation};
use crate::phasor::phasor;
use crate::scenario::ChannelSettings;
use crate::world::{Antennas, LineOfSight};

/// Received power without any path, in dB relative to free space.
const NOTHING_DB: f64 = -200.0;

/// Propagation from one radio head. The paths of the nearest traced position are extrapolated as
/// plane waves.
#[derive(Debug, Clone)]
pub struct TracedPropagation {
    paths: Arc<Paths>,
    head: usize,
    budget: LinkBudget,
    wavenumber_per_m: f64,
    blockage: Blockage,
}

impl TracedPropagation {
    /// Creates the propagation of a link; `None` if the file does not contain the radio head.
    pub fn new(paths: Arc<Paths>, settings: &ChannelSettings, link: &Link<'_>) -> Option<Self> {
        let head = paths.head(link.site.radio_heads.get(link.head)?)?;
        Some(Self {
            paths,
            head,
            budget: LinkBudget::new(link.site, link.vehicle),
            wavenumber_per_m: TAU / link.site.wavelength_m(),
            blockage: Blockage::new(settings.blockage, link),
        })
    }
}

/// Returns the total power of the paths.
fn power(paths: &[TracedPath]) -> f64 {
    let powers = paths.iter().map(|path| f64::from(path.gain.norm_sqr()));
    powers.sum()
}

impl Propagation for TracedPropagation {
    fn next_gain_db(&mut self, sight: &LineOfSight) -> f64 {
        let near = self.paths.near(self.head, sight.place);
        let gain_db = 10.0 * near.map_or(0.0, |(paths, _)| power(paths)).log10();
        (gain_db + self.budget.path_loss_db(sight.distance_m)).max(NOTHING_DB)
    }

    fn response(
        &self,
        sight: &LineOfSight,
        antennas: &Antennas,
        step_hz: f64,
        into: &mut [Complex64],
    ) {
        let elements = antennas.elements();
        into.fill(Complex64::ZERO);
        let near = self.paths.near(self.head, sight.place);
        let Some((paths, [east_m, north_m])) = near.filter(|(paths, _)| !paths.is_empty()) else {
            return;
        };
        let scale = power(paths).sqrt().recip();
        // The paths already include the attenuation of walls.
        let passing = self.blockage.moving(sight.time_s);
        let (sin, cos) = sight.axis_rad.sin_cos();
        let [x, y] = [east_m, north_m].map(|part_m| self.wavenumber_per_m * part_m);
        let first_hz = -((into.len() / elements / 2) as f64) * step_hz;
        for path in paths {
            let [towards_x, towards_y] = path.towards.map(f64::from);
            let gain = Complex64::new(path.gain.re.into(), path.gain.im.into());
            let amplitude = if path.direct { scale * passing } else { scale };
            let mut wave = amplitude * gain * phasor(x * towards_x + y * towards_y);
            let along = cos * towards_x + sin * towards_y;
            let left = cos * towards_y - sin * towards_x;
            let mut response = [Complex64::ZERO; MAX_ELEMENTS];
            if let Some(response) = response.get_mut(..elements) {
                antennas.add(Complex64::ONE, [along, left], response);
            }
            let excess_s = f64::from(path.excess_s);
            wave *= phasor(-TAU * first_hz * excess_s);
            let turn = phasor(-TAU * step_hz * excess_s);
            for gains in into.chunks_exact_mut(elements) {
                for (gain, response) in gains.iter_mut().zip(&response) {
                    *gain += wave * response;
                }
                wave *= turn;
            }
        }
    }
}
