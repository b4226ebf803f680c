//! Loops over samples for any vector registers.
//!
//! The samples of one antenna are loaded into a pair of registers. The products of two antennas'
//! pairs are added to two sums: the real parts of `x conj(y)` to `direct`, the imaginary parts to
//! `crossed`. The layout in the lanes depends on the processor.

macro_rules! kernels {
    (
        $module:ident, $arch:ident, $features:literal, $real:ident, $complexes:literal,
        $vector:ident, $zero:expr,
        load: $load:expr, direct: $direct:expr, crossed: $crossed:expr, total: $total:expr $(,)?
    ) => {
        pub(in crate::kernel) mod $module {
            use std::arch::$arch::*;

            use num_complex::{Complex, Complex64};

            #[allow(unused_imports, reason = "not every processor needs help")]
            use super::*;
            use crate::kernel::portable;
            use crate::kernel::portable::shortest;
            use crate::linalg::matrix::{Matrix, zeros};

            /// Samples that are loaded at once.
            type Chunk = [Complex<$real>; $complexes];
            type Pair = ($vector, $vector);

            #[target_feature(enable = $features)]
            #[inline]
            fn zero() -> $vector {
                $zero
            }

            #[target_feature(enable = $features)]
            #[inline]
            fn load<const N: usize>(channels: &[&[Chunk]; N], at: usize) -> [Pair; N] {
                let mut pairs = [(zero(), zero()); N];
                for n in 0..N {
                    pairs[n] = $load(&channels[n][at]);
                }
                pairs
            }

            /// Returns `sum` plus the real parts of `x conj(y)`.
            #[target_feature(enable = $features)]
            #[inline]
            fn direct(sum: $vector, x: Pair, y: Pair) -> $vector {
                $direct(sum, x, y)
            }

            /// Returns `sum` plus the imaginary parts of `x conj(y)`.
            #[target_feature(enable = $features)]
            #[inline]
            fn crossed(sum: $vector, x: Pair, y: Pair) -> $vector {
                $crossed(sum, x, y)
            }

            /// Reduces the lanes of the sums to a complex number.
            #[target_feature(enable = $features)]
            #[inline]
            fn total(direct: $vector, crossed: $vector) -> Complex64 {
                $total(direct, crossed)
            }

            /// Returns the complete chunks of the channels and their number of samples.
            #[target_feature(enable = $features)]
            #[inline]
            fn chunks<'a, const N: usize>(
                channels: &[&'a [Complex<$real>]; N],
            ) -> ([&'a [Chunk]; N], usize) {
                let count = shortest(channels) / $complexes;
                let mut whole: [&[Chunk]; N] = [&[]; N];
                for n in 0..N {
                    whole[n] = &channels[n].as_chunks().0[..count];
                }
                (whole, count * $complexes)
            }

            #[target_feature(enable = $features)]
            pub(in crate::kernel) fn products<const N: usize>(
                channels: &[&[Complex<$real>]; N],
            ) -> Matrix<N> {
                let (whole, length) = chunks(channels);
                let (mut re, mut im) = ([[zero(); N]; N], [[zero(); N]; N]);
                for at in 0..length / $complexes {
                    let x = load(&whole, at);
                    // Loop bounds known at compile time keep the sums in registers.
                    for i in 0..N {
                        for j in 0..N {
                            if j <= i {
                                re[i][j] = direct(re[i][j], x[i], x[j]);
                            }
                            if j < i {
                                im[i][j] = crossed(im[i][j], x[i], x[j]);
                            }
                        }
                    }
                }
                let mut matrix = zeros::<N>();
                for i in 0..N {
                    for j in 0..N {
                        if j <= i {
                            matrix[i][j] = total(re[i][j], im[i][j]);
                        }
                    }
                }
                if length < shortest(channels) {
                    portable::add_products(channels, length, &mut matrix);
                }
                for i in 0..N {
                    for j in 0..i {
                        matrix[j][i] = matrix[i][j].conj();
                    }
                }
                matrix
            }
        }
    };
}
pub(super) use kernels;
