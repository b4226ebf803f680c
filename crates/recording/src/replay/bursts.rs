//! SSBs that belong together, as the pipeline hears them.

use onboard::observation::{SensedSsb, SsbObservation};
use onboard::{BoxError, Observed, SsbSource};

use crate::angle_log::LoggedAngle;

/// All SSBs of a burst lie within half a frame (TS 38.213, 4.1).
const BURST_S: f64 = 0.005;

/// Something that came with one SSB.
pub trait OfSsb {
    /// The SSB.
    fn ssb(&self) -> &SensedSsb;
    /// What the pipeline is to make an angle of.
    fn observed(&self) -> Observed<'_>;
}

impl OfSsb for LoggedAngle {
    fn ssb(&self) -> &SensedSsb {
        &self.ssb
    }

    fn observed(&self) -> Observed<'_> {
        Observed::Angle(self.measured)
    }
}

impl OfSsb for SsbObservation {
    fn ssb(&self) -> &SensedSsb {
        &self.ssb
    }

    fn observed(&self) -> Observed<'_> {
        Observed::Snapshots(self)
    }
}

/// A burst that was recorded.
pub struct Burst<'a, T>(pub &'a [T]);

impl<T: OfSsb> SsbSource for Burst<'_, T> {
    fn sense(&mut self, sensed: &mut Vec<SensedSsb>) -> Result<(), BoxError> {
        sensed.extend(self.0.iter().map(OfSsb::ssb));
        Ok(())
    }

    fn observe(&mut self, index: usize) -> Result<Observed<'_>, BoxError> {
        let ssb = self.0.get(index).ok_or("no such SSB in the burst")?;
        Ok(ssb.observed())
    }
}

/// Number of the first SSBs that are of one burst: within half a frame of the first.
pub fn first_burst<T: OfSsb>(ssbs: &[T]) -> usize {
    let Some(first_s) = ssbs.first().map(|first| first.ssb().time_s) else {
        return 0;
    };
    let of_burst = |it: &&T| (it.ssb().time_s - first_s).abs() < BURST_S;
    ssbs.iter().take_while(of_burst).count().max(1)
}
