//! The inner loops over samples: portable, and for AVX2 with FMA where the processor has them.

#[cfg(target_arch = "x86_64")]
mod avx2;

use num_complex::Complex;

use crate::Complex64;

/// A real sample type: `f32` or `f64`.
pub trait Real: sealed::Kernel + Into<f64> + Send + Sync + 'static {}
impl Real for f32 {}
impl Real for f64 {}

pub(crate) mod sealed {
    use super::{Complex, Complex64};

    /// What is compiled for each type.
    pub trait Kernel: Copy {
        /// `sum_t x_t conj(y_t)`.
        fn correlation(x: &[Complex<Self>], y: &[Complex<Self>]) -> Complex64;

        /// Sums along the diagonals of `sum_t x_t x_t^H`:
        /// `lag[k] = sum_t sum_n x_(n+k) conj(x_n)`.
        fn lag_sums<const N: usize>(channels: &[&[Complex<Self>]; N]) -> [Complex64; N];
    }
}

/// Whether code for AVX2 and FMA may run here.
#[inline]
pub(crate) fn has_avx2_fma() -> bool {
    #[cfg(target_arch = "x86_64")]
    {
        std::is_x86_feature_detected!("avx2") && std::is_x86_feature_detected!("fma")
    }
    #[cfg(not(target_arch = "x86_64"))]
    {
        false
    }
}

macro_rules! kernel {
    ($real:ident) => {
        impl sealed::Kernel for $real {
            #[inline]
            fn correlation(x: &[Complex<$real>], y: &[Complex<$real>]) -> Complex64 {
                #[cfg(target_arch = "x86_64")]
                if has_avx2_fma() {
                    // SAFETY: the processor has the features the function is compiled for.
                    #[allow(unsafe_code)]
                    return unsafe { avx2::$real::correlation(x, y) };
                }
                correlation(x, y)
            }

            #[inline]
            fn lag_sums<const N: usize>(channels: &[&[Complex<$real>]; N]) -> [Complex64; N] {
                #[cfg(target_arch = "x86_64")]
                if has_avx2_fma() {
                    // SAFETY: the processor has the features the function is compiled for.
                    #[allow(unsafe_code)]
                    return unsafe { avx2::$real::lag_sums(channels) };
                }
                lag_sums(channels)
            }
        }
    };
}
kernel!(f32);
kernel!(f64);

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
            let fast = T::correlation(channels[0], channels[1]);
            assert!((fast - correlation(channels[0], channels[1])).norm() < 1e-4);
        }
    }

    #[test]
    fn kernels_agree() {
        let part = |n: usize, t: usize| ((n * 7 + t * 13) % 11) as f32 * 0.1 - 0.4;
        check::<f32>(|n, t| Complex::new(part(n, t), part(t, n)));
        check::<f64>(|n, t| Complex::new(part(n, t).into(), part(t, n).into()));
    }
}
