//! Conversion of a configured number of antennas to a compile-time constant.

/// Evaluates `$body` with the constant `$N` equal to `$count`. A checked vehicle has a count
/// between 2 and [`MAX_ELEMENTS`](crate::observation::MAX_ELEMENTS); larger counts are treated as
/// the maximum.
#[cfg(not(test))]
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

/// The unit tests use four antennas. Code for every number of antennas is half of their build time.
#[cfg(test)]
macro_rules! for_elements {
    ($count:expr, $N:ident => $body:expr) => {
        match $count {
            4 => {
                const $N: usize = 4;
                $body
            }
            other => panic!("the unit tests are built without code for {other} antennas"),
        }
    };
}
pub(crate) use for_elements;
