//! Detection of the processor's vector instructions.

/// Largest number of antennas with code for each set of vector instructions. The sums of larger
/// arrays do not fit in the registers, and their code is most of the build time.
pub(crate) const LARGEST_VECTORISED: usize = 8;

/// Vector instructions of the processor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Instructions {
    /// Baseline of the architecture.
    Baseline,
    /// NEON, which is part of every aarch64 processor.
    #[cfg(target_arch = "aarch64")]
    Neon,
    /// AVX2 and FMA.
    #[cfg(target_arch = "x86_64")]
    Avx2,
    /// AVX2, FMA and AVX-512 F.
    #[cfg(target_arch = "x86_64")]
    Avx512,
}

impl Instructions {
    #[inline]
    pub(crate) fn available() -> Self {
        if cfg!(feature = "portable") {
            return Self::Baseline;
        }
        #[cfg(target_arch = "aarch64")]
        return Self::Neon;
        #[cfg(target_arch = "x86_64")]
        if std::is_x86_feature_detected!("avx2") && std::is_x86_feature_detected!("fma") {
            return if std::is_x86_feature_detected!("avx512f") {
                Self::Avx512
            } else {
                Self::Avx2
            };
        }
        #[cfg(not(target_arch = "aarch64"))]
        Self::Baseline
    }
}

/// Calls the variant of a function for the processor.
macro_rules! dispatch {
    ($baseline:expr, $neon:expr, $avx2:expr, $avx512:expr) => {
        match $crate::simd::instructions::Instructions::available() {
            $crate::simd::instructions::Instructions::Baseline => $baseline,
            // SAFETY: the processor has the features that the function is compiled for.
            #[cfg(target_arch = "aarch64")]
            #[allow(unsafe_code, unused_unsafe)]
            $crate::simd::instructions::Instructions::Neon => unsafe { $neon },
            // SAFETY: the processor has the features that the function is compiled for.
            #[cfg(target_arch = "x86_64")]
            #[allow(unsafe_code)]
            $crate::simd::instructions::Instructions::Avx2 => unsafe { $avx2 },
            // SAFETY: the processor has the features that the function is compiled for.
            #[cfg(target_arch = "x86_64")]
            #[allow(unsafe_code)]
            $crate::simd::instructions::Instructions::Avx512 => unsafe { $avx512 },
        }
    };
}
pub(crate) use dispatch;
