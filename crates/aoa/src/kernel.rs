//! The inner loops over samples.

use num_complex::Complex;

use crate::Complex64;

/// A real sample type: `f32` or `f64`.
pub trait Real: Copy + Into<f64> + Send + Sync + 'static {}
impl Real for f32 {}
impl Real for f64 {}

/// `sum_t x_t conj(y_t)`.
pub(crate) fn correlation<T: Real>(x: &[Complex<T>], y: &[Complex<T>]) -> Complex64 {
    let wide = |z: &Complex<T>| Complex64::new(z.re.into(), z.im.into());
    x.iter().zip(y).map(|(x, y)| wide(x) * wide(y).conj()).sum()
}
