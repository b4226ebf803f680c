//! Steering vector of an ideal uniform linear array.

use num_complex::Complex64;

/// Returns `a_n = exp(j n omega)`, n = 0 .. N - 1.
pub(crate) fn steering_vector<const N: usize>(phase_rad: f64) -> [Complex64; N] {
    let step = Complex64::cis(phase_rad);
    let mut element = Complex64::ONE;
    std::array::from_fn(|_| {
        let current = element;
        element *= step;
        current
    })
}

/// Returns `sum over n of (n - (N - 1) / 2)^2`, the squared aperture in all Cramér–Rao bounds.
pub(crate) const fn aperture<const N: usize>() -> f64 {
    let n = N as f64;
    n * (n * n - 1.0) / 12.0
}
