//! Interface of the channel models.

use num_complex::Complex64;
use onboard::radio_head::RadioHead;
use onboard::road::Road;
use onboard::settings::{Site, Vehicle};

use crate::random::Streams;
use crate::world::{Antennas, LineOfSight};

/// Propagation from one radio head to the antennas in one run.
/// [`RicianPropagation`](super::RicianPropagation) is an example implementation.
///
/// The channel must be a function of the position and independent of earlier calls, so that a run
/// has the same fading for every choice of received SSBs.
pub trait Propagation: Send {
    /// Returns the mean power relative to the free-space link budget in dB: shadowing and
    /// additional path loss. Called once per SSB, in order.
    fn next_gain_db(&mut self, sight: &LineOfSight) -> f64;

    /// Computes the complex antenna gains with unit mean power at frequencies `step_hz` apart. The
    /// carrier is in the middle (just above the middle for an even number of frequencies). `into`
    /// contains one chunk per frequency, with one gain per antenna.
    fn response(
        &self,
        sight: &LineOfSight,
        antennas: &Antennas,
        step_hz: f64,
        into: &mut [Complex64],
    );
}

/// Link between one radio head and the vehicle in one run.
#[derive(Debug, Clone, Copy)]
pub struct Link<'a> {
    /// True site.
    pub site: &'a Site,
    /// True vehicle.
    pub vehicle: &'a Vehicle,
    /// Road that the vehicle drives along.
    pub road: &'a Road,
    /// Duration of the drive in seconds.
    pub duration_s: f64,
    /// Index of the radio head in the site.
    pub head: usize,
    /// Random streams of the run.
    pub streams: Streams,
}

impl Link<'_> {
    /// Returns the radio head at its true position.
    pub fn radio_head(&self) -> Option<RadioHead> {
        self.site.radio_heads.get(self.head).map(RadioHead::from)
    }
}
