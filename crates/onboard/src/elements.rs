//! Conversion of a configured number of antennas to a compile-time constant.

/// Evaluates `$body` with the constant `$N` equal to `$count`. A checked vehicle has a count
/// between 2 and [`MAX_ELEMENTS`](crate::observation::MAX_ELEMENTS); larger counts are treated as
/// the maximum.
///
/// The unit tests use four antennas and are built without the other counts, which are half of their build time.
macro_rules! for_elements {
    ($count:expr, $N:ident => $body:expr) => {
        for_elements!($count, $N => $body; 3 5 6 7 8 9 10 11 12 13 14 15)
    };
    ($count:expr, $N:ident => $body:expr; $($n:literal)*) => {
        match $count {
            4 => {
                const $N: usize = 4;
                $body
            }
            #[cfg(not(test))]
            0..=2 => {
                const $N: usize = 2;
                $body
            }
            $(#[cfg(not(test))]
            $n => {
                const $N: usize = $n;
                $body
            })*
            #[cfg(not(test))]
            _ => {
                const $N: usize = $crate::observation::MAX_ELEMENTS;
                $body
            }
            #[cfg(test)]
            other => panic!("the unit tests are built without code for {other} antennas"),
        }
    };
}
pub(crate) use for_elements;
