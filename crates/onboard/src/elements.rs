//! From a number of antennas that a file states to one that the compiler knows.

/// Evaluates `$body` with the constant `$N` equal to `$count`, which a checked vehicle has between
/// 2 and [`MAX_ELEMENTS`](crate::observation::MAX_ELEMENTS); a larger one counts as that.
macro_rules! for_elements {
    ($count:expr, $N:ident => $body:expr) => {
        match $count {
            0..=2 => {
                const $N: usize = 2;
                $body
            }
            3 => {
                const $N: usize = 3;
                $body
            }
            4 => {
                const $N: usize = 4;
                $body
            }
            5 => {
                const $N: usize = 5;
                $body
            }
            6 => {
                const $N: usize = 6;
                $body
            }
            7 => {
                const $N: usize = 7;
                $body
            }
            _ => {
                const $N: usize = 8;
                $body
            }
        }
    };
}
pub(crate) use for_elements;
