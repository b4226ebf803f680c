//! The door for channels.

use num_complex::Complex64;

use crate::world::LineOfSight;

/// How the signal of one radio head comes to the antennas, in one run. To write one, copy
/// [`RicianPropagation`](super::RicianPropagation).
///
/// What it does must be a function of the place, and not of what was asked for before: the same
/// drive fades the same whether or not its SSBs are heard.
pub trait Propagation: Send {
    /// Shadowing in dB at `along_m` driven, on top of the link budget. Called once for each SSB, in
    /// order.
    fn next_shadowing_db(&mut self, along_m: f64) -> f64;

    /// Gains of the antennas, of unit mean power, at frequencies `step_hz` apart, the carrier in
    /// their middle (of an even number, just above it): antenna after antenna, frequency after
    /// frequency, into chunks of `elements`.
    fn response(
        &self,
        sight: &LineOfSight,
        along_m: f64,
        step_hz: f64,
        elements: usize,
        into: &mut [Complex64],
    );
}
