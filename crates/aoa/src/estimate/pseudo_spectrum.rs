//! Spectra as a function of direction, for display.

use num_complex::Complex64;

use crate::array::linear::Array;
use crate::array::manifold::{Direction, Manifold, dot};
use crate::covariance::sample::Covariance;
use crate::error::Error;
use crate::linalg::dense::inverse;
use crate::linalg::eigen::hermitian_eigen;
use crate::linalg::matrix::{Matrix, zeros};
use crate::spectrum::polynomial::Spectrum;

/// Kind of spectrum, where `a` is the steering vector of a direction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PseudoSpectrum {
    /// Beamformer power, `a^H R a / N^2` (Bartlett).
    Bartlett,
    /// Power with minimum interference, `1 / (a^H R^-1 a)` (Capon 1969).
    Capon,
    /// MUSIC spectrum `N / (a^H En En^H a)`, at least 1 and infinite at exact sources (Schmidt
    /// 1986).
    Music {
        /// Number of sources, 1 to N - 1.
        sources: usize,
    },
}

impl PseudoSpectrum {
    /// Returns the spectrum at the given angles from the array's axis in rad.
    ///
    /// # Errors
    /// [`Error::Angle`]; [`Error::TooManySources`]; [`Error::Singular`] for Capon with fewer
    /// snapshots than antennas; an error for a covariance that is empty, zero or not finite.
    pub fn at<const N: usize>(
        self,
        covariance: &Covariance<N>,
        array: &Array<N>,
        angles_rad: &[f64],
    ) -> Result<Vec<f64>, Error> {
        let covariance = covariance.calibrated(array).validated()?;
        let quadratic = Spectrum::of_matrix(&self.quadratic_form(&covariance)?);
        let value = |angle_rad: &f64| {
            if !(0.0..=std::f64::consts::PI).contains(angle_rad) {
                return Err(Error::Angle(*angle_rad));
            }
            let form = quadratic.value(array.phase_from_angle(*angle_rad));
            Ok(self.value(form, N as f64))
        };
        angles_rad.iter().map(value).collect()
    }

    /// Returns the spectrum of an array of any shape in the given directions; `a` is the response,
    /// and `a^H a` replaces N.
    ///
    /// # Errors
    /// See [`PseudoSpectrum::at`], except for the angles.
    pub fn over_directions<M: Manifold<N> + ?Sized, const N: usize>(
        self,
        covariance: &Covariance<N>,
        manifold: &M,
        directions: &[Direction],
    ) -> Result<Vec<f64>, Error> {
        let form = self.quadratic_form(&covariance.validated()?)?;
        let value = |direction: &Direction| {
            let a = manifold.response(*direction);
            let row = |i: usize| -> Complex64 { form[i].iter().zip(&a).map(|(m, a)| m * a).sum() };
            let value = (0..N).map(|i| (a[i].conj() * row(i)).re).sum();
            self.value(value, dot(&a, &a).re)
        };
        Ok(directions.iter().map(value).collect())
    }

    /// Returns the spectrum from the value of the quadratic form and `a^H a`.
    fn value(self, form: f64, power: f64) -> f64 {
        match self {
            Self::Bartlett => form.max(0.0) / (power * power),
            Self::Capon => form.recip(),
            Self::Music { .. } => power / form.max(0.0),
        }
    }

    fn quadratic_form<const N: usize>(
        self,
        covariance: &Covariance<N>,
    ) -> Result<Matrix<N>, Error> {
        let matrix = covariance.matrix();
        Ok(match self {
            Self::Bartlett => matrix,
            Self::Capon if covariance.snapshots() < N => return Err(Error::Singular),
            Self::Capon => inverse(matrix, N).ok_or(Error::Singular)?,
            Self::Music { sources } => {
                if !(1..N).contains(&sources) {
                    return Err(Error::TooManySources {
                        requested: sources,
                        maximum: N - 1,
                    });
                }
                let vectors = hermitian_eigen(matrix, N).vectors;
                let mut projection = zeros::<N>();
                for vector in &vectors[sources..] {
                    for i in 0..N {
                        for j in 0..N {
                            projection[i][j] += vector[i] * vector[j].conj();
                        }
                    }
                }
                projection
            }
        })
    }
}
