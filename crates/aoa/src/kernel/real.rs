//! Sample types and their kernels.

use num_complex::Complex;

#[cfg(target_arch = "aarch64")]
use super::neon;
use super::portable;
#[cfg(target_arch = "x86_64")]
use super::x86;
use crate::linalg::matrix::{Matrix, zeros};
use crate::simd::instructions::{LARGEST_VECTORISED, dispatch};

/// Real sample type: `f32` or `f64`.
pub trait Real: sealed::Kernel + Into<f64> + Send + Sync + 'static {}
impl Real for f32 {}
impl Real for f64 {}

mod sealed {
    use num_complex::Complex;

    use crate::linalg::matrix::Matrix;

    /// Kernels of a sample type; sealed.
    pub trait Kernel: Copy {
        /// Returns `sum_t x_t x_t^H` of channels of equal length.
        fn products<const N: usize>(channels: &[&[Complex<Self>]; N]) -> Matrix<N>;
    }
}

macro_rules! kernel {
    ($real:ident, $neon:ident, $avx2:ident, $avx512:ident) => {
        impl sealed::Kernel for $real {
            #[inline]
            fn products<const N: usize>(channels: &[&[Complex<$real>]; N]) -> Matrix<N> {
                if const { N > LARGEST_VECTORISED } {
                    return pairwise(channels);
                }
                dispatch!(
                    portable::products(channels),
                    neon::$neon::products(channels),
                    x86::$avx2::products(channels),
                    x86::$avx512::products(channels)
                )
            }
        }
    };
}
kernel!(f64, neon_f64, avx2_f64, avx512_f64);
// Twenty samples of f32 fill five AVX2 registers, but 2.5 AVX-512 registers; therefore AVX2 is
// used.
kernel!(f32, neon_f32, avx2_f32, avx2_f32);

/// Returns the products of many channels, whose sums exceed the vector registers, pair by pair.
fn pairwise<T: sealed::Kernel, const N: usize>(channels: &[&[Complex<T>]; N]) -> Matrix<N> {
    let mut matrix = zeros::<N>();
    for i in 1..N {
        for j in 0..i {
            let pair = T::products(&[channels[j], channels[i]]);
            (matrix[j][j], matrix[j][i]) = (pair[0][0], pair[0][1]);
            (matrix[i][j], matrix[i][i]) = (pair[1][0], pair[1][1]);
        }
    }
    matrix
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Compares the kernel of this processor with the portable code for all remainders.
    fn check<T: Real, const N: usize>(make: impl Fn(usize) -> Complex<T>) {
        for length in 1..23 {
            let samples: Vec<Complex<T>> = (0..N * length).map(&make).collect();
            let channels = std::array::from_fn(|n| &samples[n * length..(n + 1) * length]);
            let (fast, plain) = (T::products::<N>(&channels), portable::products(&channels));
            for (fast, plain) in fast.iter().flatten().zip(plain.iter().flatten()) {
                assert!((fast - plain).norm() < 1e-4, "{fast} {plain}");
            }
        }
    }

    #[test]
    fn kernels_agree_with_the_portable_code() {
        let part = |i: usize| (i * 7 % 31) as f32 * 0.1 - 1.4;
        let single = |i| Complex::new(part(i), part(i * i + 3));
        let double = |i| Complex::new(part(i).into(), part(i * i + 3).into());
        check::<f32, 4>(single);
        check::<f64, 4>(double);
        check::<f32, { LARGEST_VECTORISED + 1 }>(single);
        check::<f64, { LARGEST_VECTORISED + 1 }>(double);
    }
}
