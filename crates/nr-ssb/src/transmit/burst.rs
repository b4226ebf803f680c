//! SSB burst sets: transmission of a cell in one half frame.

use num_complex::Complex32;

use super::ofdm::{Ofdm, symbol_phase};
use crate::error::Error;
use crate::standard::grid::{SsbGrid, dmrs_indices, pbch_indices, pss_indices, sss_indices};
use crate::standard::message::payload::BchPayload;
use crate::standard::numerology::{Case, Lmax, Numerology};
use crate::standard::pbch;
use crate::standard::pci::Pci;
use crate::standard::sequence::dmrs::{dmrs, ibar_ssb};
use crate::standard::sequence::pss::pss;
use crate::standard::sequence::sss::sss;

/// Returns the grid of one SSB (TS 38.211 §7.4.3), with unit power per resource element for all
/// signals.
///
/// ```
/// use nr_ssb::{BchPayload, Lmax, Mib, Pci, burst::ssb_grid};
/// let payload = BchPayload::new(Mib::default(), 17, false, 2)?;
/// let grid = ssb_grid(Pci::new(42)?, Lmax::L8, &payload)?;
/// let power: f32 = grid.elements().iter().map(|x| x.norm_sqr()).sum();
/// assert!((power - 830.0).abs() < 1e-2);
/// # Ok::<(), nr_ssb::Error>(())
/// ```
///
/// # Errors
/// [`Error::SsbIndex`] for an index beyond `lmax`, [`Error::MibField`] for a field beyond its bits.
pub fn ssb_grid(pci: Pci, lmax: Lmax, payload: &BchPayload) -> Result<SsbGrid, Error> {
    lmax.check_index(payload.ssb_index)?;
    payload.check()?;
    let real = |x| Complex32::new(x, 0.0);
    let ibar = ibar_ssb(lmax, payload.ssb_index, payload.half_frame);
    let mut grid = SsbGrid::zeros();
    grid.put(pss_indices(), pss(pci.n_id_2()).map(real));
    grid.put(sss_indices(), sss(pci).map(real));
    grid.put(*dmrs_indices(pci), dmrs(pci, ibar));
    grid.put(*pbch_indices(pci), pbch::encode(payload, pci, lmax));
    Ok(grid)
}

/// Transmitted SSB of a burst set.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Beam {
    /// SSB index, 0 to Lmax − 1.
    pub ssb_index: u8,
    /// Complex amplitude of all its resource elements.
    pub gain: Complex32,
}

impl Beam {
    /// Creates the SSB of index `ssb_index` with unit amplitude.
    pub const fn new(ssb_index: u8) -> Self {
        Self {
            ssb_index,
            gain: Complex32::ONE,
        }
    }
}

/// Burst set: all SSBs of a cell in one half frame of 5 ms.
///
/// ```
/// use nr_ssb::{BchPayload, Beam, Burst, Case, Lmax, Mib, Numerology, Ofdm, Pci};
/// let burst = Burst {
///     pci: Pci::new(42)?,
///     case: Case::C,
///     lmax: Lmax::L8,
///     payload: BchPayload::new(Mib::default(), 256, false, 0)?,
///     beams: vec![Beam::new(0), Beam::new(5)],
///     ssb_freq_hz: Some(3_700.8e6),
/// };
/// let mut ofdm = Ofdm::new(Numerology::from_sample_rate(Case::C.spacing(), 15.36e6)?);
/// let samples = burst.iq(&mut ofdm)?;
/// assert_eq!(samples.len(), 76_800);
/// # Ok::<(), nr_ssb::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Burst {
    /// Physical cell identity.
    pub pci: Pci,
    /// Pattern of the SSBs in the half frame.
    pub case: Case,
    /// Burst set size: [`Lmax::L4`] or [`Lmax::L8`] for the cases A to C, [`Lmax::L64`] for D and
    /// E.
    pub lmax: Lmax,
    /// MIB, SFN and half frame; each beam sets its own SSB index.
    pub payload: BchPayload,
    /// Transmitted SSBs.
    pub beams: Vec<Beam>,
    /// Absolute frequency of the SSB's centre in hertz, for the phase of each symbol (TS 38.211
    /// §5.4, [`symbol_phase`]); `None` omits the phase.
    pub ssb_freq_hz: Option<f64>,
}

impl Burst {
    /// Returns the first OFDM symbol (relative to the start of the half frame) and the grid of
    /// every beam, without gains and phases.
    ///
    /// # Errors
    /// [`Error::BurstSet`] for an `lmax` that the case does not have, else those of [`ssb_grid`].
    pub fn grids(&self) -> Result<Vec<(usize, SsbGrid)>, Error> {
        self.beams
            .iter()
            .map(|beam| self.placed(beam.ssb_index))
            .collect()
    }

    /// Returns the half frame as IQ samples, with the SSB centred at 0 Hz.
    ///
    /// # Errors
    /// Those of [`add_to`](Self::add_to).
    pub fn iq(&self, ofdm: &mut Ofdm) -> Result<Vec<Complex32>, Error> {
        let mut samples = vec![Complex32::ZERO; ofdm.numerology().half_frame_len()];
        self.add_to(ofdm, &mut samples)?;
        Ok(samples)
    }

    /// Adds the burst to `half_frame`, 5 ms of samples, which several cells may share.
    ///
    /// # Errors
    /// [`Error::Spacing`] if `ofdm` has another subcarrier spacing than the burst's case,
    /// [`Error::Length`] if `half_frame` is not [`Numerology::half_frame_len`] long, else those of
    /// [`grids`](Self::grids).
    pub fn add_to(&self, ofdm: &mut Ofdm, half_frame: &mut [Complex32]) -> Result<(), Error> {
        let numerology = ofdm.numerology();
        self.check_layout(numerology, half_frame.len())?;
        for beam in &self.beams {
            let (first, grid) = self.placed(beam.ssb_index)?;
            for (l, subcarriers) in grid.symbols().enumerate() {
                let symbol = first + l;
                let phase = self.ssb_freq_hz.map_or(Complex32::ONE, |freq_hz| {
                    symbol_phase(numerology, symbol, freq_hz)
                });
                let place = half_frame.get_mut(numerology.symbol_start(symbol)..);
                let cp_len = numerology.ssb_cp_len();
                ofdm.add(
                    subcarriers,
                    beam.gain * phase,
                    cp_len,
                    place.unwrap_or_default(),
                );
            }
        }
        Ok(())
    }

    fn placed(&self, ssb_index: u8) -> Result<(usize, SsbGrid), Error> {
        if (self.lmax == Lmax::L64) != (self.case.lmax() == Lmax::L64) {
            return Err(Error::BurstSet {
                case: self.case.name(),
                count: self.lmax.count(),
            });
        }
        let payload = BchPayload {
            ssb_index,
            ..self.payload
        };
        let grid = ssb_grid(self.pci, self.lmax, &payload)?;
        Ok((self.case.start_symbol(ssb_index)?, grid))
    }

    fn check_layout(&self, numerology: Numerology, samples: usize) -> Result<(), Error> {
        let spacing = self.case.spacing();
        if numerology.spacing() != spacing {
            return Err(Error::Spacing {
                modulator_khz: numerology.spacing().khz(),
                case: self.case.name(),
                case_khz: spacing.khz(),
            });
        }
        let expected = numerology.half_frame_len();
        if samples != expected {
            return Err(Error::Length {
                what: "half frame",
                got: samples,
                expected,
            });
        }
        Ok(())
    }
}
