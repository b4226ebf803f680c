//! Angle of arrival with antenna arrays.
//!
//! Estimates the direction of a source from complex samples ("snapshots") of an antenna array: by
//! maximum likelihood, MUSIC, Root-MUSIC or ESPRIT. Every estimate has a standard deviation, an SNR
//! and a verdict. The number of antennas is a const generic, and no memory is allocated.
//!
//! # One source
//!
//! ```
//! use aoa::{Array, Complex64, Covariance, Method, estimate};
//!
//! let array = Array::<4>::half_wavelength();
//! // Twenty snapshots of a source at 60 degrees from the array's axis, and a little disturbance.
//! let steering = array.steering_vector(array.phase_from_angle(60_f64.to_radians()));
//! let snapshots: Vec<[Complex64; 4]> = (0..20)
//!     .map(|t| {
//!         let waveform = Complex64::cis(0.7 * f64::from(t * t));
//!         std::array::from_fn(|n| {
//!             let disturbance = Complex64::cis(f64::from(t * (3 * n as i32 + 2))) * 0.1;
//!             steering[n] * waveform + disturbance
//!         })
//!     })
//!     .collect();
//!
//! let covariance = Covariance::from_snapshots(&snapshots)?;
//! let found = estimate(Method::MaximumLikelihood, &covariance, &array)?;
//! assert!((found.angle_rad.to_degrees() - 60.0).abs() < 1.0);
//! assert!(found.is_resolved());
//! # Ok::<(), aoa::Error>(())
//! ```
//!
//! # Conventions
//!
//! The angle is measured from the array's axis, 0 to pi. The estimated quantity is the electrical
//! angle `omega = 2 pi (d / lambda) cos(theta)`, the phase difference between adjacent antennas.
//! Its noise is Gaussian with a standard deviation that does not depend on the direction. A filter
//! should use [`phase_rad`](AngleEstimate::phase_rad) and
//! [`phase_sigma_rad`](AngleEstimate::phase_sigma_rad); `angle_rad` and `sigma_rad` are for
//! display. The SNR is per antenna and snapshot. The mean of the snapshots is signal and is never
//! removed.
//!
//! # Which method
//!
//! | | sources | attains the Cramér–Rao bound |
//! |---|---|---|
//! | [`Method::MaximumLikelihood`] | N - 1, coherent ones too | yes; the fastest for one source, the slowest for several |
//! | [`Method::Music`] | N - 1 | yes |
//! | [`Method::RootMusic`] | N - 1 | yes; separates close sources best |
//! | [`Method::EspritLs`], [`Method::EspritTls`] | N - 1 | 5 % above it with four antennas |
//!
//! Several sources: [`estimate_several`], and [`source_count`] for their number. Coherent sources
//! (reflections) require [`estimate_several_smoothed`] with all methods except maximum likelihood.
//! Known pilots: [`maximum_likelihood_pilots`], and [`maximum_likelihood_pilots_unequal`] for
//! channels with different noise variances or dead channels. Many estimates in one call: [`Batch`].
//! Spectrum over all directions: [`PseudoSpectrum`]. Gain and phase errors of the channels:
//! [`Calibration`]. Circular, planar and other arrays, in azimuth and elevation:
//! [`DirectionFinder`].
//!
//! # Reliability of an estimate
//!
//! [`GoodnessOfFit`] tests whether plane waves and white noise explain the samples, with a
//! false-alarm probability of 1 %. Reflections, deviations of the antennas and additional sources
//! are reported by [`AngleEstimate::doubt`] next to the [`Verdict`]. The standard deviation then
//! includes their effect, as far as the residual reveals it. One error is not detectable in a
//! single estimate: a reflection from almost the direction of the source (within about a twentieth
//! of the beam width at 20 dB) is received as one plane wave from an intermediate direction.
//!
//! Users of angle, noise and SNR only can omit the test: [`Batch::estimate_untested`],
//! [`estimate_untested`], [`maximum_likelihood_pilots_untested`].

// Loops over vector registers must be inlined into the function that is compiled for the processor.
#![allow(clippy::inline_always)]

// Dependencies of the modules, each on the previous ones only: linalg, simd, array; spectrum;
// kernel; covariance; result; method; estimate.
mod array;
pub mod bound;
mod covariance;
mod error;
mod estimate;
mod kernel;
mod linalg;
mod list;
mod method;
mod result;
mod simd;
mod spectrum;

pub use array::arbitrary::ArbitraryArray;
pub use array::calibration::Calibration;
pub use array::linear::Array;
pub use array::manifold::{Direction, Manifold};
pub use array::measured::MeasuredManifold;
pub use covariance::sample::Covariance;
pub use error::Error;
pub use estimate::batch::{Batch, BatchError};
pub use estimate::choice::Method;
pub use estimate::direction_finder::DirectionFinder;
pub use estimate::one::{estimate, estimate_untested};
pub use estimate::pilots::{maximum_likelihood_pilots, maximum_likelihood_pilots_untested};
pub use estimate::pseudo_spectrum::PseudoSpectrum;
pub use estimate::several::{estimate_several, estimate_several_smoothed};
pub use estimate::smoothing::Smoothing;
pub use estimate::source_count::{Criterion, source_count};
pub use estimate::unequal::maximum_likelihood_pilots_unequal;
pub use kernel::real::Real;
pub use linalg::matrix::Matrix;
pub use list::List;
pub use num_complex::Complex64;
pub use result::angle::{AngleEstimate, AngleEstimates, UntestedEstimate};
pub use result::azimuth_elevation::DirectionEstimate;
pub use result::goodness_of_fit::GoodnessOfFit;
pub use result::verdict::{Reason, Verdict};

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct ReadMe;
