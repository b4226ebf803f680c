//! Generation of SSB bursts.

use nr_ssb::{BchPayload, Beam, Burst, Case, Lmax, Mib, Numerology, Ofdm, Pci};
use num_complex::Complex32;
use numpy::PyArray1;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// Generate one burst set of a cell: a half frame of 5 ms with the SSB centred at 0 Hz.
///
/// Parameters
/// ----------
/// pci : int
///     Physical cell identity, 0 to 1007.
/// ssb_indices : sequence of int
///     Indices of the transmitted SSBs.
/// gains : sequence of complex, optional
///     Amplitude of each SSB [default: 1].
/// case : str
///     Time pattern of the SSBs (TS 38.213, 4.1): `A` (15 kHz), `B` or `C` (30 kHz), `D` (120 kHz),
///     `E` (240 kHz).
/// lmax : int
///     Number of SSB indices of the cell, 4 or 8; 64 for the cases `D` and `E`.
/// sfn : int
///     System frame number, 0 to 1023.
/// half_frame : bool
///     Whether the burst is in the second half of the frame.
/// mib_bits : str, optional
///     24 bits of the master information block; the frame number is replaced by `sfn`.
/// ssb_freq_hz : float, optional
///     Absolute centre frequency of the SSB for the phase of each symbol (TS 38.211, 5.4) [default:
///     no such phase].
/// sample_rate_hz : float
///     Sample rate: 256, 512, 1024, ... times the subcarrier spacing.
///
/// Returns
/// -------
/// ndarray
///     complex64 samples of 5 ms. A resource element of amplitude one has the power 1 / FFT size
///     squared.
///
/// Raises
/// ------
/// ValueError
///     A value outside its range; the message contains the allowed values.
#[pyfunction]
#[pyo3(signature = (pci, *, ssb_indices = vec![0], gains = None, case = "C", lmax = 8, sfn = 0, half_frame = false, mib_bits = None, ssb_freq_hz = None, sample_rate_hz = 7.68e6))]
#[allow(clippy::too_many_arguments, clippy::needless_pass_by_value)] // Python's keywords
pub fn build_burst<'py>(
    py: Python<'py>,
    pci: u16,
    ssb_indices: Vec<u8>,
    gains: Option<Vec<Complex32>>,
    case: &str,
    lmax: u8,
    sfn: u16,
    half_frame: bool,
    mib_bits: Option<&str>,
    ssb_freq_hz: Option<f64>,
    sample_rate_hz: f64,
) -> PyResult<Bound<'py, PyArray1<Complex32>>> {
    let wrong = |error: nr_ssb::Error| PyValueError::new_err(error.to_string());
    let named = Case::ALL.into_iter().find(|it| it.name() == case);
    let case = named.ok_or_else(|| {
        PyValueError::new_err(format!("case is {case:?}; allowed: A, B, C, D, E"))
    })?;
    let sized = Lmax::ALL.into_iter().find(|it| it.count() == lmax);
    let lmax =
        sized.ok_or_else(|| PyValueError::new_err(format!("lmax is {lmax}; allowed: 4, 8, 64")))?;
    let gains = gains.unwrap_or_else(|| vec![Complex32::ONE; ssb_indices.len()]);
    if gains.len() != ssb_indices.len() {
        return Err(PyValueError::new_err(format!(
            "{} gains for {} SSBs; each needs one",
            gains.len(),
            ssb_indices.len()
        )));
    }
    let mib = mib_bits.map_or_else(|| Ok(Mib::default()), master_information_block)?;
    let beam = |(ssb_index, gain)| Beam { ssb_index, gain };
    let burst = Burst {
        pci: Pci::new(pci).map_err(wrong)?,
        case,
        lmax,
        payload: BchPayload::new(mib, sfn, half_frame, 0).map_err(wrong)?,
        beams: ssb_indices.into_iter().zip(gains).map(beam).collect(),
        ssb_freq_hz,
    };
    let numerology = Numerology::from_sample_rate(case.spacing(), sample_rate_hz).map_err(wrong)?;
    let samples = py
        .detach(|| burst.iq(&mut Ofdm::new(numerology)))
        .map_err(wrong)?;
    Ok(PyArray1::from_vec(py, samples))
}

fn master_information_block(bits: &str) -> PyResult<Mib> {
    let number = u32::from_str_radix(bits, 2)
        .ok()
        .filter(|_| bits.len() == 24);
    let number = number.ok_or_else(|| {
        PyValueError::new_err(format!(
            "mib_bits is {bits:?}; it must be 24 characters 0 or 1"
        ))
    })?;
    Mib::from_bits(number).map_err(|error| PyValueError::new_err(error.to_string()))
}
