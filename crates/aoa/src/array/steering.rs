//! What ideal antennas in a row receive.

use num_complex::Complex64;

/// `a_n = exp(j n omega)`, n = 0 .. N - 1.
pub(crate) fn steering_vector<const N: usize>(phase_rad: f64) -> [Complex64; N] {
    let step = Complex64::cis(phase_rad);
    let mut element = Complex64::ONE;
    std::array::from_fn(|_| {
        let current = element;
        element *= step;
        current
    })
}

/// `sum over n of (n - (N - 1) / 2)^2`, the squared aperture that every bound contains.
pub(crate) const fn aperture<const N: usize>() -> f64 {
    let n = N as f64;
    n * (n * n - 1.0) / 12.0
}
