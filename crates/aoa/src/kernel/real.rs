//! Sample types and their kernels.

use num_complex::Complex;

#[cfg(target_arch = "aarch64")]
use super::neon;
use super::portable;
#[cfg(target_arch = "x86_64")]
use super::x86;
use crate::linalg::matrix::Matrix;
use crate::simd::instructions::dispatch;

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

#[cfg(test)]
mod tests {
    use super::*;

    /// Compares the kernel of this processor with the portable code for all remainders.
    fn check<T: Real>(make: impl Fn(usize) -> Complex<T>) {
        for length in 1..23 {
            let samples: Vec<Complex<T>> = (0..4 * length).map(&make).collect();
            let channels = std::array::from_fn(|n| &samples[n * length..(n + 1) * length]);
            let (fast, plain) = (T::products::<4>(&channels), portable::products(&channels));
            for (fast, plain) in fast.iter().flatten().zip(plain.iter().flatten()) {
                assert!((fast - plain).norm() < 1e-4, "{fast} {plain}");
            }
        }
    }

    #[test]
    fn kernels_agree_with_the_portable_code() {
        let part = |i: usize| (i * 7 % 31) as f32 * 0.1 - 1.4;
        check::<f32>(|i| Complex::new(part(i), part(i * i + 3)));
        check::<f64>(|i| Complex::new(part(i).into(), part(i * i + 3).into()));
    }
}
