//! Errors of the estimators' inputs.

/// Invalid input of an estimator. An estimate with a low reliability is not an error; it has the
/// verdict [`Verdict::Unresolved`](crate::Verdict).
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum Error {
    /// A sample, weight or matrix entry is NaN or infinite, or its power overflows.
    #[error("samples must be finite: found NaN, infinity, or a power beyond the range of f64")]
    NotFinite,
    /// All samples are zero, so that no direction exists.
    #[error("samples must not all be zero")]
    Zero,
    /// There are no snapshots.
    #[error("at least one snapshot is needed")]
    NoSnapshots,
    /// The method cannot resolve this number of sources with the array.
    #[error("{requested} sources requested; allowed are 1 to {maximum} with this array and method")]
    TooManySources {
        /// Requested number of sources.
        requested: usize,
        /// Maximum number of sources.
        maximum: usize,
    },
    /// An element is too far from the origin, or its position is not finite.
    #[error("element {0} must be within 100 wavelengths of the origin on every axis")]
    ElementPlace(usize),
    /// Two elements have equal positions.
    #[error("elements {0} and {1} have the same position")]
    CoincidentElements(usize, usize),
    /// All elements are collinear, so that only the angle from their line is measurable.
    #[error(
        "all elements are on one line, so that only the angle from this line can be estimated: \
         describe a linear array"
    )]
    ElementsInARow,
    /// The table of responses does not define a manifold.
    #[error("table of responses: {0}")]
    ManifoldTable(&'static str),
    /// The range of elevations is invalid.
    #[error("elevations must ascend from -pi/2 or more to pi/2 or less, not {lowest} to {highest}")]
    Elevations {
        /// Lowest elevation in rad.
        lowest: f64,
        /// Highest elevation in rad.
        highest: f64,
    },
    /// The element spacing is outside the valid range.
    #[error("spacing must be 0.01 to 100 wavelengths, not {0}")]
    Spacing(f64),
    /// The angle from the array's axis is outside 0 to pi, or not finite.
    #[error("an angle from the array's axis lies between 0 and pi rad, not {0}")]
    Angle(f64),
    /// A calibration gain is zero, NaN or infinite.
    #[error("calibration gain of channel {0} must be finite and not zero")]
    CalibrationGain(usize),
    /// A weight or a noise variance is not positive, or is NaN or infinite.
    #[error("{name} must be finite and positive, not {value}")]
    NotPositive {
        /// Name of the quantity.
        name: &'static str,
        /// Value of the quantity.
        value: f64,
    },
    /// Fewer than two channels have a finite noise variance.
    #[error(
        "a direction requires at least two channels with a finite noise variance, not {living}"
    )]
    DeadChannels {
        /// Number of channels with a finite noise variance.
        living: usize,
    },
    /// The given covariance matrix is not Hermitian or has a negative diagonal entry.
    #[error("a covariance matrix must be Hermitian with a non-negative diagonal")]
    NotHermitian,
    /// The given covariance matrix has a negative eigenvalue.
    #[error("a covariance matrix must have no negative eigenvalue")]
    Indefinite,
    /// An item of a batch has more samples than the address space can hold.
    #[error("{snapshots} snapshots of {antennas} antennas exceed the address range")]
    TooManySnapshots {
        /// Number of snapshots of an item.
        snapshots: usize,
        /// Number of antennas of the array.
        antennas: usize,
    },
    /// The number of snapshots is too small for the estimate.
    #[error("{snapshots} snapshots are too few: at least {needed} are needed")]
    TooFewSnapshots {
        /// Given number of snapshots.
        snapshots: usize,
        /// Minimum number of snapshots.
        needed: usize,
    },
    /// The subarray is larger than the array or has a single antenna.
    #[error("a subarray has 2 to {antennas} antennas, not {subarray}")]
    Subarray {
        /// Requested number of antennas.
        subarray: usize,
        /// Number of antennas of the array.
        antennas: usize,
    },
    /// The sources are too close or too coherent for a unique solution.
    #[error("the sources cannot be separated: the equations are singular")]
    Singular,
}
