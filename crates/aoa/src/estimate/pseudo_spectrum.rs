//! Spectra over the direction, to look at.

use num_complex::Complex64;

use crate::array::linear::Array;
use crate::covariance::sample::Covariance;
use crate::error::Error;
use crate::linalg::dense::inverse;
use crate::linalg::eigen::hermitian_eigen;
use crate::spectrum::polynomial::Spectrum;

/// Which spectrum, `a` being the steering vector of a direction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PseudoSpectrum {
    /// Power of the beam, `a^H R a / N^2` (Bartlett).
    Bartlett,
    /// Power that nothing from elsewhere adds to, `1 / (a^H R^-1 a)` (Capon 1969).
    Capon,
    /// `N / (a^H En En^H a)`, at least 1 and infinite at exact sources (Schmidt 1986).
    Music {
        /// Number of sources, 1 to N - 1.
        sources: usize,
    },
}

impl PseudoSpectrum {
    /// The spectrum at these angles from the array's axis.
    ///
    /// # Errors
    /// [`Error::Angle`]; [`Error::TooManySources`]; [`Error::Singular`] for Capon with fewer snapshots
    /// than antennas; those of a covariance that is empty, zero or not finite.
    pub fn at<const N: usize>(
        self,
        covariance: &Covariance<N>,
        array: &Array<N>,
        angles_rad: &[f64],
    ) -> Result<Vec<f64>, Error> {
        let covariance = covariance.calibrated(array).validated()?;
        let quadratic = self.quadratic_form(&covariance)?;
        let n = N as f64;
        let value = |angle_rad: &f64| {
            if !(0.0..=std::f64::consts::PI).contains(angle_rad) {
                return Err(Error::Angle(*angle_rad));
            }
            let form = quadratic.value(array.phase_from_angle(*angle_rad));
            Ok(match self {
                Self::Bartlett => form.max(0.0) / (n * n),
                Self::Capon => form.recip(),
                Self::Music { .. } => n / form.max(0.0),
            })
        };
        angles_rad.iter().map(value).collect()
    }

    fn quadratic_form<const N: usize>(
        self,
        covariance: &Covariance<N>,
    ) -> Result<Spectrum<N>, Error> {
        let matrix = covariance.matrix();
        Ok(match self {
            Self::Bartlett => Spectrum::of_matrix(&matrix),
            Self::Capon if covariance.snapshots() < N => return Err(Error::Singular),
            Self::Capon => Spectrum::of_matrix(&inverse(matrix, N).ok_or(Error::Singular)?),
            Self::Music { sources } => {
                if !(1..N).contains(&sources) {
                    return Err(Error::TooManySources {
                        requested: sources,
                        maximum: N - 1,
                    });
                }
                let vectors: [[Complex64; N]; N] = hermitian_eigen(matrix, N).vectors;
                Spectrum::of_subspace(&vectors[sources..])
            }
        })
    }
}
