//! The inner loops over samples: portable, and for the vector instructions that a processor may have.

#[cfg(target_arch = "x86_64")]
mod x86;

use num_complex::Complex;

use crate::Complex64;
use crate::covariance::{Matrix, zeros};

/// A real sample type: `f32` or `f64`.
pub trait Real: sealed::Kernel + Into<f64> + Send + Sync + 'static {}
impl Real for f32 {}
impl Real for f64 {}

pub(crate) mod sealed {
    use super::{Complex, Complex64, Matrix};

    /// What is compiled for each type.
    pub trait Kernel: Copy {
        /// `sum_t x_t x_t^H`.
        fn products<const N: usize>(channels: &[&[Complex<Self>]; N]) -> Matrix<N>;

        /// Sums along the diagonals of `sum_t x_t x_t^H`:
        /// `lag[k] = sum_t sum_n x_(n+k) conj(x_n)`.
        fn lag_sums<const N: usize>(channels: &[&[Complex<Self>]; N]) -> [Complex64; N];
    }
}

/// What the processor can do, beyond the baseline.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Instructions {
    /// The baseline of the architecture.
    Baseline,
    /// AVX2 and FMA.
    #[cfg(target_arch = "x86_64")]
    Avx2,
    /// AVX2, FMA and AVX-512 F.
    #[cfg(target_arch = "x86_64")]
    Avx512,
}

#[cfg(target_arch = "x86_64")]
impl Instructions {
    #[inline]
    pub(crate) fn available() -> Self {
        if !(std::is_x86_feature_detected!("avx2") && std::is_x86_feature_detected!("fma")) {
            Self::Baseline
        } else if std::is_x86_feature_detected!("avx512f") {
            Self::Avx512
        } else {
            Self::Avx2
        }
    }
}

#[cfg(not(target_arch = "x86_64"))]
impl Instructions {
    pub(crate) const fn available() -> Self {
        Self::Baseline
    }
}

/// Calls the variant of a function that fits the processor.
macro_rules! dispatch {
    ($baseline:expr, $avx2:expr, $avx512:expr) => {
        match $crate::kernel::Instructions::available() {
            $crate::kernel::Instructions::Baseline => $baseline,
            // SAFETY: the processor has the features that the function is compiled for.
            #[cfg(target_arch = "x86_64")]
            #[allow(unsafe_code)]
            $crate::kernel::Instructions::Avx2 => unsafe { $avx2 },
            // SAFETY: as above.
            #[cfg(target_arch = "x86_64")]
            #[allow(unsafe_code)]
            $crate::kernel::Instructions::Avx512 => unsafe { $avx512 },
        }
    };
}
pub(crate) use dispatch;

macro_rules! kernel {
    ($real:ident, $avx2:ident, $avx512:ident) => {
        impl sealed::Kernel for $real {
            #[inline]
            fn products<const N: usize>(channels: &[&[Complex<$real>]; N]) -> Matrix<N> {
                dispatch!(
                    products(channels),
                    x86::$avx2::products(channels),
                    x86::$avx512::products(channels)
                )
            }

            #[inline]
            fn lag_sums<const N: usize>(channels: &[&[Complex<$real>]; N]) -> [Complex64; N] {
                dispatch!(
                    lag_sums(channels),
                    x86::$avx2::lag_sums(channels),
                    x86::$avx512::lag_sums(channels)
                )
            }
        }
    };
}
kernel!(f64, avx2_f64, avx512_f64);
// Twenty samples of f32 fill five registers of AVX2, and two and a half of AVX-512.
kernel!(f32, avx2_f32, avx2_f32);

fn correlation<T: Real>(x: &[Complex<T>], y: &[Complex<T>]) -> Complex64 {
    let wide = |z: &Complex<T>| Complex64::new(z.re.into(), z.im.into());
    let (mut even, mut odd) = (Complex64::ZERO, Complex64::ZERO);
    for (x, y) in x.chunks(2).zip(y.chunks(2)) {
        even += wide(&x[0]) * wide(&y[0]).conj();
        if let ([_, x], [_, y]) = (x, y) {
            odd += wide(x) * wide(y).conj();
        }
    }
    even + odd
}

fn products<T: Real, const N: usize>(channels: &[&[Complex<T>]; N]) -> Matrix<N> {
    let mut matrix = zeros::<N>();
    for i in 0..N {
        for j in 0..=i {
            matrix[i][j] = correlation(channels[i], channels[j]);
            matrix[j][i] = matrix[i][j].conj();
        }
    }
    matrix
}

fn lag_sums<T: Real, const N: usize>(channels: &[&[Complex<T>]; N]) -> [Complex64; N] {
    let mut lags = [Complex64::ZERO; N];
    for i in 0..N {
        for j in 0..=i {
            lags[i - j] += correlation(channels[i], channels[j]);
        }
    }
    lags
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whatever this processor has is compared with the portable code, for all remainders.
    fn check<T: Real>(make: impl Fn(usize, usize) -> Complex<T>) {
        for length in 0..23 {
            let rows: [Vec<Complex<T>>; 4] =
                std::array::from_fn(|n| (0..length).map(|t| make(n, t)).collect());
            let channels = std::array::from_fn(|n| rows[n].as_slice());
            for (fast, plain) in T::lag_sums::<4>(&channels).iter().zip(lag_sums(&channels)) {
                assert!((fast - plain).norm() < 1e-4, "{fast} {plain}");
            }
            let (fast, plain) = (T::products::<4>(&channels), products(&channels));
            for (fast, plain) in fast.iter().flatten().zip(plain.iter().flatten()) {
                assert!((fast - plain).norm() < 1e-4, "{fast} {plain}");
            }
        }
    }

    #[test]
    fn kernels_agree() {
        let part = |n: usize, t: usize| ((n * 7 + t * 13) % 11) as f32 * 0.1 - 0.4;
        check::<f32>(|n, t| Complex::new(part(n, t), part(t, n)));
        check::<f64>(|n, t| Complex::new(part(n, t).into(), part(t, n).into()));
    }
}
