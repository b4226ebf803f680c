//! Identification of cell and SSB: N_ID^(1) from the SSS and ī_SSB from the PBCH DM-RS, with the
//! channel estimated from the PSS.
//!
//! Antennas are combined with the channel's conjugate (maximum ratio); each statistic is
//! `|Σ w(k) d*(k)|² / Σ|w(k)|²`, in noise exponentially distributed with mean one.

use num_complex::{Complex32, Complex64};

use crate::dsp::channel_estimate::ChannelEstimator;
use crate::dsp::received_grid::MAX_ANTENNAS;
use crate::dsp::received_grid::ReceivedGrid;
use crate::numeric::hermitian::{cholesky, solve};
use crate::numeric::sums::inner_product;
use crate::standard::grid::{SUBCARRIERS, dmrs_indices, pss_indices};
use crate::standard::pci::Pci;
use crate::standard::sequence::dmrs::{DMRS_LEN, dmrs};
use crate::standard::sequence::pss::{SYNC_LEN, pss};
use crate::standard::sequence::sss::sss;

/// Most likely hypothesis with its statistic.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Best<T> {
    pub(crate) hypothesis: T,
    /// Statistic; for DM-RS the sum over the three symbols.
    pub(crate) statistic: f32,
    /// Phase of the match, a unit phasor.
    pub(crate) phase: Complex32,
}

/// Sequences of all 1008 SSS, stored because a search correlates with 336 of them per candidate.
pub(crate) struct SssTable(Vec<[f32; SYNC_LEN]>);

impl SssTable {
    pub(crate) fn new() -> Self {
        Self(Pci::all().map(sss).collect())
    }

    /// Returns the PCI with the largest SSS statistic, among those with this N_ID^(2).
    pub(crate) fn identify(
        &self,
        n_id_2: u8,
        grids: &[ReceivedGrid],
        estimate: &ChannelEstimator,
    ) -> Option<Best<Pci>> {
        let mut combined = [Complex32::ZERO; SYNC_LEN];
        for antenna in 0..grids.len() {
            let weight = noise_weight(estimate, antenna);
            let received = &grids[antenna][2][pss_indices()];
            let channel = &estimate.channel[antenna][pss_indices()];
            for ((slot, y), h) in combined.iter_mut().zip(received).zip(channel) {
                *slot += y * h.conj() * weight;
            }
        }
        let re = combined.map(|w| w.re);
        let im = combined.map(|w| w.im);
        let energy: f32 = combined.iter().map(Complex32::norm_sqr).sum();
        let (mut best, mut sum) = (None, Complex32::ZERO);
        for pci in Pci::all().skip(usize::from(n_id_2)).step_by(3) {
            let Some(sequence) = self.0.get(usize::from(pci.get())) else {
                continue;
            };
            let match_ = Complex32::new(inner_product(&re, sequence), inner_product(&im, sequence));
            if best.is_none() || match_.norm_sqr() > sum.norm_sqr() {
                best = Some(pci);
                sum = match_;
            }
        }
        best.map(|hypothesis| Best {
            hypothesis,
            statistic: sum.norm_sqr() / energy.max(f32::MIN_POSITIVE),
            phase: sum / sum.norm().max(f32::MIN_POSITIVE),
        })
    }
}

/// DM-RS elements of the symbols 1, 2 and 3.
const DMRS_OF_SYMBOL: [std::ops::Range<usize>; 3] = [0..60, 60..84, 84..144];

/// Returns the ī_SSB, 0 to 7, with the largest DM-RS statistic. The phase between symbols is not
/// used.
pub(crate) fn dmrs_hypothesis(
    pci: Pci,
    grids: &[ReceivedGrid],
    estimate: &ChannelEstimator,
) -> Best<u8> {
    let mut combined = [Complex32::ZERO; DMRS_LEN];
    for antenna in 0..grids.len() {
        let weight = noise_weight(estimate, antenna);
        for (slot, index) in combined.iter_mut().zip(dmrs_indices(pci)) {
            let (symbol, k) = (index / SUBCARRIERS, index % SUBCARRIERS);
            *slot += grids[antenna][symbol][k] * estimate.channel[antenna][k].conj() * weight;
        }
    }
    let energies = DMRS_OF_SYMBOL.map(|range| {
        combined[range]
            .iter()
            .map(Complex32::norm_sqr)
            .sum::<f32>()
            .max(f32::MIN_POSITIVE)
    });
    let mut best = Best {
        hypothesis: 0,
        statistic: -1.0,
        phase: Complex32::ONE,
    };
    for ibar_ssb in 0..8 {
        let sequence = dmrs(pci, ibar_ssb);
        let statistic = DMRS_OF_SYMBOL
            .iter()
            .zip(&energies)
            .map(|(range, energy)| {
                let pairs = combined[range.clone()].iter().zip(&sequence[range.clone()]);
                pairs
                    .map(|(w, r)| w * r.conj())
                    .sum::<Complex32>()
                    .norm_sqr()
                    / energy
            })
            .sum();
        if statistic > best.statistic {
            best = Best {
                hypothesis: ibar_ssb,
                statistic,
                phase: Complex32::ONE,
            };
        }
    }
    best
}

/// Returns the PSS statistic for noise with any correlation over the antennas: `127 cᴴ R⁻¹ c` with
/// `c` the despread antennas and `R` the sample covariance of their 127 elements. In noise it is
/// 127 times a variable with a beta distribution, whose tail is thinner than that of a sum of unit
/// exponentials, one per antenna. (The statistic of the search is a plain sum over the antennas,
/// which assumes that interference is independent between antennas.)
pub(crate) fn pss_statistic(n_id_2: u8, grids: &[ReceivedGrid]) -> f32 {
    let chips = pss(n_id_2);
    let rows = grids
        .iter()
        .take(MAX_ANTENNAS)
        .map(|grid| &grid[0][pss_indices()]);
    let mut covariance = [[Complex64::ZERO; MAX_ANTENNAS]; MAX_ANTENNAS];
    let mut despread = [Complex64::ZERO; MAX_ANTENNAS];
    for i in 0..MAX_ANTENNAS {
        covariance[i][i] = Complex64::ONE;
    }
    for (i, a) in rows.clone().enumerate() {
        let sum: Complex32 = a.iter().zip(&chips).map(|(y, chip)| y * chip).sum();
        despread[i] = widen(sum);
        for (j, b) in rows.clone().enumerate().take(i + 1) {
            covariance[i][j] = widen(a.iter().zip(b).map(|(x, y)| x * y.conj()).sum());
        }
        // Channels that are copies of each other must not make the matrix singular.
        covariance[i][i] = covariance[i][i] * (1.0 + 1e-5) + f64::from(f32::MIN_POSITIVE);
    }
    let Some(factor) = cholesky(&covariance) else {
        return 0.0;
    };
    let whitened = solve(&factor, &despread);
    despread
        .iter()
        .zip(&whitened)
        .map(|(c, w)| (c.conj() * w).re)
        .sum::<f64>() as f32
}

fn widen(value: Complex32) -> Complex64 {
    Complex64::new(f64::from(value.re), f64::from(value.im))
}

fn noise_weight(estimate: &ChannelEstimator, antenna: usize) -> f32 {
    (1.0 / estimate.noise_variance[antenna].max(1e-30)) as f32
}
