//! Sums over arrays with several interleaved partial sums (lanes), so that consecutive additions
//! are independent.

use num_complex::Complex32;

const LANES: usize = 8;

/// Returns Σ a b.
pub(crate) fn inner_product<const N: usize>(a: &[f32; N], b: &[f32; N]) -> f32 {
    let (a_chunks, a_rest) = a.as_chunks::<LANES>();
    let (b_chunks, b_rest) = b.as_chunks::<LANES>();
    let mut lanes = [0.0_f32; LANES];
    for (x, y) in a_chunks.iter().zip(b_chunks) {
        for i in 0..LANES {
            lanes[i] += x[i] * y[i];
        }
    }
    let mut sum: f32 = lanes.iter().sum();
    for (x, y) in a_rest.iter().zip(b_rest) {
        sum += x * y;
    }
    sum
}

/// Returns Σ a b without conjugation.
pub(crate) fn complex_product<const N: usize>(a: &[Complex32; N], b: &[Complex32; N]) -> Complex32 {
    let (mut re, mut im) = ([0.0_f32; LANES], [0.0_f32; LANES]);
    for i in 0..N {
        let lane = i % LANES;
        re[lane] += a[i].re * b[i].re - a[i].im * b[i].im;
        im[lane] += a[i].re * b[i].im + a[i].im * b[i].re;
    }
    Complex32::new(re.iter().sum(), im.iter().sum())
}

/// Returns Σ |a|².
pub(crate) fn energy<const N: usize>(a: &[Complex32; N]) -> f32 {
    let mut lanes = [0.0_f32; LANES];
    for i in 0..N {
        lanes[i % LANES] += a[i].re * a[i].re + a[i].im * a[i].im;
    }
    lanes.iter().sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vectorized_sums_equal_sequential_sums() {
        let a: [Complex32; 127] = std::array::from_fn(|i| Complex32::new(i as f32, 1.0));
        let b: [Complex32; 127] = std::array::from_fn(|i| Complex32::new(2.0, -(i as f32)));
        let expected: Complex32 = a.iter().zip(&b).map(|(a, b)| a * b).sum();
        assert!((complex_product(&a, &b) - expected).norm() < 1e-2);
        let expected: f32 = a.iter().map(Complex32::norm_sqr).sum();
        assert!((energy(&a) / expected - 1.0).abs() < 1e-6);
        let (x, y) = (a.map(|a| a.re), b.map(|b| b.im));
        let expected: f32 = x.iter().zip(&y).map(|(x, y)| x * y).sum();
        assert!((inner_product(&x, &y) / expected - 1.0).abs() < 1e-6);
    }
}
