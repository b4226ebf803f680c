//! Conversion of interleaved samples of radios and files to complex numbers of full scale one.

use num_complex::Complex32;

/// Appends interleaved `i8` (I, Q, I, …); a final I without Q is ignored.
pub fn ci8(interleaved: &[i8], samples: &mut Vec<Complex32>) {
    let (pairs, _) = interleaved.as_chunks::<2>();
    let part = |value: i8| f32::from(value) / 128.0;
    samples.extend(
        pairs
            .iter()
            .map(|[i, q]| Complex32::new(part(*i), part(*q))),
    );
}

/// Appends interleaved `i16` (I, Q, I, …); a final I without Q is ignored.
pub fn ci16(interleaved: &[i16], samples: &mut Vec<Complex32>) {
    let (pairs, _) = interleaved.as_chunks::<2>();
    let part = |value: i16| f32::from(value) / 32768.0;
    samples.extend(
        pairs
            .iter()
            .map(|[i, q]| Complex32::new(part(*i), part(*q))),
    );
}

/// Appends interleaved `f32` (I, Q, I, …); a final I without Q is ignored.
pub fn cf32(interleaved: &[f32], samples: &mut Vec<Complex32>) {
    let (pairs, _) = interleaved.as_chunks::<2>();
    samples.extend(pairs.iter().map(|[i, q]| Complex32::new(*i, *q)));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn full_scale_is_one_and_a_partial_sample_is_omitted() {
        let mut samples = Vec::new();
        ci8(&[-128, 64, 1], &mut samples);
        ci16(&[16384, -32768, 1], &mut samples);
        cf32(&[0.25, -2.0, 9.0], &mut samples);
        let expected = [(-1.0, 0.5), (0.5, -1.0), (0.25, -2.0)];
        assert_eq!(samples, expected.map(|(i, q)| Complex32::new(i, q)));
    }
}
