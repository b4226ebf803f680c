//! What can be wrong with the input of an estimator.

/// Why no estimate could be formed. Every variant is a fault of the input; an estimate that was
/// formed but should not be trusted carries [`Verdict::Unresolved`](crate::Verdict) instead.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum Error {
    /// A sample, a weight or a matrix entry is NaN or infinite (or its power overflows).
    #[error("samples must be finite: found NaN, infinity, or a power beyond the range of f64")]
    NotFinite,
    /// All samples are zero: there is no direction in silence.
    #[error("samples must not all be zero")]
    Zero,
    /// No snapshots at all.
    #[error("at least one snapshot is needed")]
    NoSnapshots,
    /// More sources than the method can resolve with this array.
    #[error("{requested} sources asked for, allowed are 1 to {maximum} with this array and method")]
    TooManySources {
        /// The number of sources asked for.
        requested: usize,
        /// The largest number allowed: one less than the antennas, or 1 for maximum likelihood.
        maximum: usize,
    },
    /// An element of an array is too far away, or its place is not finite.
    #[error("element {0} must be within 100 wavelengths of the origin on every axis")]
    ElementPlace(usize),
    /// Two elements are in one place.
    #[error("elements {0} and {1} are in the same place")]
    CoincidentElements(usize, usize),
    /// All elements are on one line: only the angle from it shows.
    #[error(
        "all elements are on one line, which shows only the angle from it: describe it as a linear array"
    )]
    ElementsInARow,
    /// A table of responses that makes no manifold.
    #[error("table of responses: {0}")]
    ManifoldTable(&'static str),
    /// A range of elevations that is none.
    #[error("elevations must ascend from -pi/2 or more to pi/2 or less, not {lowest} to {highest}")]
    Elevations {
        /// Where the range begins.
        lowest: f64,
        /// Where it ends.
        highest: f64,
    },
    /// The element spacing is outside what an array can have.
    #[error("spacing must be 0.01 to 100 wavelengths, not {0}")]
    Spacing(f64),
    /// An angle from the array's axis is outside 0 to pi, or not finite.
    #[error("an angle from the array's axis lies between 0 and pi rad, not {0}")]
    Angle(f64),
    /// A calibration gain is zero, NaN or infinite.
    #[error("calibration gain of channel {0} must be finite and not zero")]
    CalibrationGain(usize),
    /// A weight or a noise variance is negative, NaN or infinite.
    #[error("{name} must be finite and positive, not {value}")]
    NotPositive {
        /// What is wrong.
        name: &'static str,
        /// Its value.
        value: f64,
    },
    /// Fewer than two channels have a finite noise variance.
    #[error("a direction needs two living channels, not {living}")]
    DeadChannels {
        /// Channels with a finite noise variance.
        living: usize,
    },
    /// The matrix given as covariance is not Hermitian with a non-negative diagonal.
    #[error("a covariance matrix must be Hermitian with a non-negative diagonal")]
    NotHermitian,
    /// The matrix given as covariance has a negative eigenvalue: no samples have such a covariance.
    #[error("a covariance matrix must have no negative eigenvalue")]
    Indefinite,
    /// A batch's item has more samples than a memory can hold.
    #[error("{snapshots} snapshots of {antennas} antennas are more than can be addressed")]
    TooManySnapshots {
        /// Snapshots of an item.
        snapshots: usize,
        /// Antennas of the array.
        antennas: usize,
    },
    /// So few snapshots that what is asked for cannot be told from noise.
    #[error("{snapshots} snapshots are too few: at least {needed} are needed")]
    TooFewSnapshots {
        /// Snapshots given.
        snapshots: usize,
        /// The least number.
        needed: usize,
    },
    /// A subarray larger than the array, or of a single antenna.
    #[error("a subarray has 2 to {antennas} antennas, not {subarray}")]
    Subarray {
        /// Antennas asked for.
        subarray: usize,
        /// Antennas of the array.
        antennas: usize,
    },
    /// The sources are so close or so coherent that the equations have no unique solution.
    #[error("the sources cannot be told apart: the equations are singular")]
    Singular,
}
