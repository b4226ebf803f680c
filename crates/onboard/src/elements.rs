//! Conversion of a configured number of antennas to a compile-time constant.

/// Evaluates `$body` with the constant `$N` equal to `$count`. A checked vehicle has a count
/// between 2 and [`MAX_ELEMENTS`](crate::observation::MAX_ELEMENTS); larger counts are treated as
/// the maximum.
macro_rules! for_elements {
    ($count:expr, $N:ident => $body:expr) => {
        for_elements!($count, $N => $body; 3 4 5 6 7 8 9 10 11 12 13 14 15)
    };
    ($count:expr, $N:ident => $body:expr; $($n:literal)*) => {
        match $count {
            0..=2 => {
                const $N: usize = 2;
                $body
            }
            $($n => {
                const $N: usize = $n;
                $body
            })*
            _ => {
                const $N: usize = $crate::observation::MAX_ELEMENTS;
                $body
            }
        }
    };
}
pub(crate) use for_elements;
