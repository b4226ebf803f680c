//! Received power of one SSB: SS-RSRP (TS 38.215 §5.1.1) and the power of the first path (RSRPP of
//! TS 38.215 §5.1.35).

use std::f64::consts::LN_10;

use crate::numeric::decibel::decibel;

/// Power per resource element, mean over the antennas. 0 dBFS is the power of a tone of amplitude
/// one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Power {
    /// Power of all paths, in dBFS.
    pub ss_rsrp_dbfs: f64,
    /// Standard deviation of the power of all paths due to noise, in dB.
    pub ss_rsrp_sigma_db: f64,
    /// Power of the first path, in dBFS.
    pub first_path_dbfs: f64,
    /// Standard deviation of the power of the first path, in dB: noise and multipath.
    pub first_path_sigma_db: f64,
}

impl Power {
    /// Computes the power from the mean power of a resource element in full scale, the sum over the
    /// antennas of its signal-to-noise ratio, the number of known elements, and mean and standard
    /// deviation of the share of the first path.
    pub(crate) fn new(power: f64, snr: f64, known: f64, share: f64, share_sigma: f64) -> Self {
        // A power |h|² with the noise variance 1/(N SNR) of h/|h| has the variance 2|h|⁴/(N SNR).
        let relative = (2.0 / (known * snr).max(1.0)).sqrt();
        let db = 10.0 / LN_10;
        let share_relative = share_sigma / share.max(f64::MIN_POSITIVE);
        Self {
            ss_rsrp_dbfs: decibel(power),
            ss_rsrp_sigma_db: db * relative,
            first_path_dbfs: decibel(power * share),
            first_path_sigma_db: db * relative.hypot(share_relative),
        }
    }
}
