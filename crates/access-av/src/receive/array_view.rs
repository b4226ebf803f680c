//! The angle of one SSB, for arrays of any number of antennas that the crates know.

use aoa::{AngleEstimate, Array, Calibration, maximum_likelihood_pilots};
use nr_ssb::search::{DetectedSsb, SearchConfig};
use nr_ssb::track::Tracker;
use nr_ssb::{Complex32, Pci};
use num_complex::Complex64;

/// The receiving array.
#[derive(Debug, Clone, PartialEq)]
pub struct ArraySetup {
    /// Distance between neighbouring antennas in wavelengths.
    pub spacing_wavelengths: f64,
    /// Complex gain of each channel, by which it is divided; ideal channels without.
    pub calibration: Option<Vec<Complex64>>,
}

impl Default for ArraySetup {
    fn default() -> Self {
        Self {
            spacing_wavelengths: 0.5,
            calibration: None,
        }
    }
}

/// Angle, and the array's response as it was received, calibration taken out.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct View {
    pub estimate: AngleEstimate,
    /// One snapshot per OFDM symbol, noise power one.
    pub blocks: Vec<Vec<Complex64>>,
}

/// Angles of SSBs that a search has found.
pub(super) trait ArrayView {
    /// Looks at the SSB in `window`, whose first sample is number `window_start` at the base rate.
    fn view(
        &mut self,
        ssb: &DetectedSsb,
        window: &[&[Complex32]],
        window_start: f64,
    ) -> Option<View>;
}

/// The view of an array of as many antennas as the search has; `None` for a single antenna or more
/// than eight.
///
/// # Errors
/// [`aoa::Error`] for an impossible spacing or gain; [`aoa::Error::CalibrationGain`] of the first
/// missing channel where the calibration is too short.
pub(super) fn array_view(
    config: &SearchConfig,
    setup: &ArraySetup,
) -> Result<Option<Box<dyn ArrayView>>, aoa::Error> {
    Ok(match config.antennas {
        2 => Some(Box::new(Looker::<2>::new(config, setup)?)),
        3 => Some(Box::new(Looker::<3>::new(config, setup)?)),
        4 => Some(Box::new(Looker::<4>::new(config, setup)?)),
        5 => Some(Box::new(Looker::<5>::new(config, setup)?)),
        6 => Some(Box::new(Looker::<6>::new(config, setup)?)),
        7 => Some(Box::new(Looker::<7>::new(config, setup)?)),
        8 => Some(Box::new(Looker::<8>::new(config, setup)?)),
        _ => None,
    })
}

struct Looker<const A: usize> {
    config: SearchConfig,
    array: Array<A>,
    /// Plans are costly: one tracker per cell, kept.
    trackers: Vec<(Pci, Tracker<A>)>,
}

impl<const A: usize> Looker<A> {
    fn new(config: &SearchConfig, setup: &ArraySetup) -> Result<Self, aoa::Error> {
        let mut array = Array::new(setup.spacing_wavelengths)?;
        if let Some(gains) = &setup.calibration {
            let gains = <[Complex64; A]>::try_from(gains.as_slice())
                .map_err(|_| aoa::Error::CalibrationGain(gains.len().min(A)))?;
            array = array.with_calibration(Calibration::new(gains)?);
        }
        Ok(Self {
            config: config.clone(),
            array,
            trackers: Vec::new(),
        })
    }

    fn tracker(&mut self, ssb: &DetectedSsb) -> Option<&mut Tracker<A>> {
        let known = self.trackers.iter().position(|(pci, _)| *pci == ssb.pci);
        let place = known.unwrap_or(self.trackers.len());
        if known.is_none() {
            let tracker = Tracker::new(&self.config, ssb).ok()?;
            self.trackers.push((ssb.pci, tracker));
        }
        self.trackers.get_mut(place).map(|(_, tracker)| tracker)
    }
}

impl<const A: usize> ArrayView for Looker<A> {
    fn view(
        &mut self,
        ssb: &DetectedSsb,
        window: &[&[Complex32]],
        window_start: f64,
    ) -> Option<View> {
        let antennas: &[&[Complex32]; A] = window.try_into().ok()?;
        let decode_pbch = ssb.payload.is_some();
        let tracked = self
            .tracker(ssb)?
            .track(antennas, window_start, ssb.sample_start, decode_pbch)
            .ok()??;
        let noise = tracked.noise_variance.iter().sum::<f64>() / A as f64;
        let scale = noise.max(f64::MIN_POSITIVE).sqrt().recip();
        let blocks = tracked.blocks.map(|block| block.map(|gain| gain * scale));
        let estimate = maximum_likelihood_pilots(&blocks, Some(1.0), &self.array).ok()?;
        let calibration = self.array.calibration();
        let blocks = blocks
            .iter()
            .map(|block| calibration.apply(block).to_vec())
            .collect();
        Some(View { estimate, blocks })
    }
}
