//! Cosine and sine of phases up to a million radians.

use std::f64::consts::FRAC_2_PI;

use num_complex::Complex64;

/// Constant whose addition and subtraction round a number to an integer.
const ROUNDER: f64 = 6_755_399_441_055_744.0;
/// π/2 in two parts. The first part has few significant bits, so that its small multiples are
/// exact.
const HALF_PI: [f64; 2] = [1.570_796_326_734_125_6, 6.077_100_506_506_192e-11];
/// Maximum magnitude of the argument reduction (rad).
const MAX_RAD: f64 = 1e6;

/// Returns e^(jφ) with an error of 1e-10 cycles at a million radians and 1e-15 near zero. A fast
/// implementation matters because a simulated drive spends most of its time here. The argument is
/// reduced to an eighth of a cycle (Cody and Waite); fdlibm's polynomials follow.
pub fn phasor(angle_rad: f64) -> Complex64 {
    if angle_rad.abs() > MAX_RAD {
        return Complex64::cis(angle_rad);
    }
    let quarters = angle_rad * FRAC_2_PI + ROUNDER - ROUNDER;
    let x = (angle_rad - quarters * HALF_PI[0]) - quarters * HALF_PI[1];
    let z = x * x;
    let sine = x + x
        * z
        * (-1.666_666_666_666_663_2e-1
            + z * (8.333_333_333_322_49e-3
                + z * (-1.984_126_982_985_795e-4
                    + z * (2.755_731_370_707_006_8e-6
                        + z * (-2.505_076_025_340_686_3e-8 + z * 1.589_690_995_211_55e-10)))));
    let cosine = 1.0 - 0.5 * z
        + z * z
            * (4.166_666_666_666_66e-2
                + z * (-1.388_888_888_887_411e-3
                    + z * (2.480_158_728_947_673e-5
                        + z * (-2.755_731_435_139_066_3e-7
                            + z * (2.087_572_321_298_175e-9 - z * 1.135_964_755_778_819_5e-11)))));
    match quarters as i64 & 3 {
        0 => Complex64::new(cosine, sine),
        1 => Complex64::new(-sine, cosine),
        2 => Complex64::new(-cosine, -sine),
        _ => Complex64::new(sine, -cosine),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn phasor_equals_the_standard_library() {
        for number in -200_000..200_000 {
            let angle_rad = f64::from(number) * 0.137_35;
            let error = (phasor(angle_rad) - Complex64::cis(angle_rad)).norm();
            assert!(error < 1e-11, "{angle_rad}: {error}");
        }
        for angle_rad in [0.0, -0.0, 1e7, f64::INFINITY, f64::NAN] {
            let (mine, theirs) = (phasor(angle_rad), Complex64::cis(angle_rad));
            assert!(mine == theirs || theirs.is_nan(), "{angle_rad}");
        }
    }
}
