//! The door for channels.

use num_complex::Complex64;
use onboard::radio_head::RadioHead;
use onboard::road::Road;
use onboard::settings::{Site, Vehicle};

use crate::random::Streams;
use crate::world::{Antennas, LineOfSight};

/// How the signal of one radio head comes to the antennas, in one run. To write one, copy
/// [`RicianPropagation`](super::RicianPropagation).
///
/// What it does must be a function of the place, and not of what was asked for before: the same
/// drive fades the same whether or not its SSBs are heard.
pub trait Propagation: Send {
    /// Mean power in dB above what the link budget has in free space: shadowing, and whatever path
    /// loss there is on top. Called once for each SSB, in order.
    fn next_gain_db(&mut self, sight: &LineOfSight) -> f64;

    /// Gains of the antennas, of unit mean power, at frequencies `step_hz` apart, the carrier in
    /// their middle (of an even number, just above it): antenna after antenna, frequency after
    /// frequency, into chunks of as many as there are antennas.
    fn response(
        &self,
        sight: &LineOfSight,
        antennas: &Antennas,
        step_hz: f64,
        into: &mut [Complex64],
    );
}

/// What lies between one radio head and the vehicle in one run.
#[derive(Debug, Clone, Copy)]
pub struct Link<'a> {
    /// The site, as it is.
    pub site: &'a Site,
    /// The vehicle, as it is.
    pub vehicle: &'a Vehicle,
    /// What is driven along.
    pub road: &'a Road,
    /// How long the drive takes, in seconds.
    pub duration_s: f64,
    /// Number of the radio head in the site.
    pub head: usize,
    /// The streams of the run.
    pub streams: Streams,
}

impl Link<'_> {
    /// The radio head, where it stands.
    pub fn radio_head(&self) -> Option<RadioHead> {
        self.site.radio_heads.get(self.head).map(RadioHead::from)
    }
}
