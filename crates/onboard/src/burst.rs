//! SSBs of one burst, as inputs of the pipeline.

use crate::BoxError;
use crate::localize::AngleMeasurement;
use crate::observation::{BURST_S, SsbDetection, SsbObservation};
use crate::pipeline::{SsbInput, SsbSource};

/// SNR that is assumed for an angle without one, in dB. It suffices for every wake-up policy.
pub const UNSTATED_SNR_DB: f64 = 20.0;

/// Item that contains one SSB.
pub trait HasSsb {
    /// Returns the SSB.
    fn ssb(&self) -> &SsbDetection;
    /// Returns the observation from which the pipeline obtains an angle.
    fn observed(&self) -> SsbInput<'_>;
}

impl HasSsb for SsbObservation {
    fn ssb(&self) -> &SsbDetection {
        &self.ssb
    }

    fn observed(&self) -> SsbInput<'_> {
        SsbInput::Snapshots(self)
    }
}

/// Angle that was estimated elsewhere, with its SSB.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoggedAngle {
    /// Cell, SSB index, time and SNR.
    pub ssb: SsbDetection,
    /// The angle.
    pub measured: AngleMeasurement,
}

impl HasSsb for LoggedAngle {
    fn ssb(&self) -> &SsbDetection {
        &self.ssb
    }

    fn observed(&self) -> SsbInput<'_> {
        SsbInput::Angle(self.measured)
    }
}

/// Received burst.
pub struct Burst<'a, T>(pub &'a [T]);

impl<T: HasSsb> SsbSource for Burst<'_, T> {
    fn sense(&mut self, sensed: &mut Vec<SsbDetection>) -> Result<(), BoxError> {
        sensed.extend(self.0.iter().map(HasSsb::ssb));
        Ok(())
    }

    fn observe(&mut self, index: usize) -> Result<SsbInput<'_>, BoxError> {
        let ssb = self.0.get(index).ok_or("no such SSB in the burst")?;
        Ok(ssb.observed())
    }
}

/// Returns the number of leading SSBs that belong to one burst: within half a frame of the first.
pub fn first_burst<T: HasSsb>(ssbs: &[T]) -> usize {
    let Some(first_s) = ssbs.first().map(|first| first.ssb().time_s) else {
        return 0;
    };
    let of_burst = |it: &&T| (it.ssb().time_s - first_s).abs() < BURST_S;
    ssbs.iter().take_while(of_burst).count().max(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bursts_of_both_half_frames_are_distinguished() {
        let ssb = |time_s| {
            let mut observation = SsbObservation::new(4);
            observation.restart(SsbDetection {
                time_s,
                ..observation.ssb
            });
            observation
        };
        for number in 0..100 {
            let start_s = f64::from(number) * 0.005;
            let next_s = f64::from(number + 1) * 0.005;
            let ssbs = [start_s, start_s + 4.67e-3, next_s].map(ssb);
            assert_eq!(first_burst(&ssbs), 2, "{start_s}");
        }
        assert_eq!(first_burst::<SsbObservation>(&[]), 0);
    }
}
