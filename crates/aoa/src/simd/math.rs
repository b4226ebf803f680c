//! Branch-free elementary functions, which allow vectorised loops.

use std::f64::consts::{FRAC_PI_2, LN_2, LN_10, PI, SQRT_2};

/// Returns `a * b + c`. It is fused only if the processor has the instruction, because `mul_add` is
/// otherwise a library call.
#[inline(always)]
pub(crate) fn times_plus<const FUSED: bool>(a: f64, b: f64, c: f64) -> f64 {
    if FUSED { a.mul_add(b, c) } else { a * b + c }
}

/// Returns `a` if `condition` is true, else `b`, without a branch that would prevent vectorisation.
#[inline(always)]
pub(crate) fn select(condition: bool, a: f64, b: f64) -> f64 {
    let mask = u64::from(condition).wrapping_neg();
    f64::from_bits(a.to_bits() & mask | b.to_bits() & !mask)
}

/// Coefficients of `asin(s) / s` in powers of `s^2`: `c_n = c_(n-1) (2n - 1)^2 / (2n (2n + 1))`.
const ARCSINE: [f64; 22] = {
    let mut series = [1.0; 22];
    let mut n = 1;
    while n < series.len() {
        let m = 2.0 * n as f64;
        series[n] = series[n - 1] * (m - 1.0) * (m - 1.0) / (m * (m + 1.0));
        n += 1;
    }
    series
};

/// Returns the arc cosine of `x` in -1 to 1 with an error of 1e-15.
///
/// `asin` by its series where `|x| <= 1/2`, elsewhere `acos(x) = 2 asin(sqrt((1 - x) / 2))`.
#[inline(always)]
pub(crate) fn acos<const FUSED: bool>(x: f64) -> f64 {
    let size = x.abs();
    let inner = size <= 0.5;
    let half = 0.5 * (1.0 - size);
    let squared = if inner { x * x } else { half };
    let mut series = 0.0;
    for coefficient in ARCSINE.iter().rev() {
        series = times_plus::<FUSED>(series, squared, *coefficient);
    }
    let near_axis = 2.0 * half.sqrt() * series;
    let outer = if x < 0.0 { PI - near_axis } else { near_axis };
    if inner { FRAC_PI_2 - x * series } else { outer }
}

/// Returns the argument of the complex number `x + j y` in [-pi, pi] with an error of 1e-15; 0 for
/// zero.
///
/// An angle of at most 45 degrees is halved, which gives a tangent of at most `sqrt(2) - 1`, for
/// which the series of the arc tangent converges fast.
#[inline(always)]
pub(crate) fn arg<const FUSED: bool>(x: f64, y: f64) -> f64 {
    let (a, b) = (x.abs(), y.abs());
    let steep = b > a;
    let (large, small) = if steep { (b, a) } else { (a, b) };
    let hypotenuse = times_plus::<FUSED>(a, a, b * b).sqrt();
    let divisor = large + hypotenuse;
    let tangent = small / if divisor > 0.0 { divisor } else { 1.0 };
    let squared = -tangent * tangent;
    let mut series = 0.0;
    for n in (0..21).rev() {
        series = times_plus::<FUSED>(series, squared, 1.0 / f64::from(2 * n + 1));
    }
    let octant = 2.0 * tangent * series;
    let quadrant = if steep { FRAC_PI_2 - octant } else { octant };
    (if x < 0.0 { PI - quadrant } else { quadrant }).copysign(y)
}

/// Returns the decimal logarithm of a positive normal number with a relative error of 1e-14 plus
/// 1e-15.
///
/// With `x = 2^e m`, `m` between sqrt(1/2) and sqrt(2): `ln m = 2 artanh((m - 1) / (m + 1))`.
#[inline(always)]
pub(crate) fn log10<const FUSED: bool>(x: f64) -> f64 {
    const MANTISSA: u64 = (1 << 52) - 1;
    // Converts an integer below 2^52 to a float: the bits become the mantissa of 2^52, which is
    // then subtracted.
    const MAGIC: u64 = 1075 << 52;
    let bits = x.to_bits();
    let mantissa = f64::from_bits((bits & MANTISSA) | (1023 << 52));
    let exponent = f64::from_bits((bits >> 52) | MAGIC) - f64::from_bits(MAGIC) - 1023.0;
    let large = mantissa > SQRT_2;
    let mantissa = if large { 0.5 * mantissa } else { mantissa };
    let exponent = if large { exponent + 1.0 } else { exponent };
    let s = (mantissa - 1.0) / (mantissa + 1.0);
    let squared = s * s;
    let mut series = 0.0;
    for n in (0..11).rev() {
        series = times_plus::<FUSED>(series, squared, 1.0 / f64::from(2 * n + 1));
    }
    times_plus::<FUSED>(exponent, LN_2 / LN_10, 2.0 * s * series / LN_10)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn functions_equal_the_standard_library() {
        for i in -1000..=1000 {
            let x = f64::from(i) / 1000.0;
            assert!((acos::<false>(x) - x.acos()).abs() < 2e-15, "acos({x})");
            let y = 1.37 * 10.0_f64.powf(15.0 * x);
            assert!((log10::<false>(y) - y.log10()).abs() < 2e-14, "log10({y})");
        }
        for i in 0..4000 {
            let angle = f64::from(i) * 0.01 - 20.0;
            let (y, x) = angle.sin_cos();
            let difference = arg::<false>(3.0 * x, 3.0 * y) - y.atan2(x);
            assert!(difference.abs() < 2e-15, "arg at {angle}");
        }
        assert_eq!(arg::<false>(0.0, 0.0), 0.0);
        assert_eq!(acos::<false>(1.0), 0.0);
        assert_eq!(log10::<false>(1.0), 0.0);
    }
}
