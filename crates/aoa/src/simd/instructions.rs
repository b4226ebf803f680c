//! Which vector instructions the processor has.

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

/// Whether the baseline multiplies and adds in one instruction.
pub(crate) const BASELINE_FUSED: bool = cfg!(target_arch = "aarch64");

/// Calls the variant of a function that fits the processor.
macro_rules! dispatch {
    ($baseline:expr, $avx2:expr, $avx512:expr) => {
        match $crate::simd::instructions::Instructions::available() {
            $crate::simd::instructions::Instructions::Baseline => $baseline,
            // SAFETY: the processor has the features that the function is compiled for.
            #[cfg(target_arch = "x86_64")]
            #[allow(unsafe_code)]
            $crate::simd::instructions::Instructions::Avx2 => unsafe { $avx2 },
            // SAFETY: as above.
            #[cfg(target_arch = "x86_64")]
            #[allow(unsafe_code)]
            $crate::simd::instructions::Instructions::Avx512 => unsafe { $avx512 },
        }
    };
}
pub(crate) use dispatch;
