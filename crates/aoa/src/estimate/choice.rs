//! Which method is to be used.

use crate::error::Error;

/// How to find the directions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Method {
    /// The maximum of `a^H R a`: optimal for one source, and the cheapest.
    MaximumLikelihood,
    /// Peaks of the MUSIC spectrum on a grid `grid_deg` apart at broadside.
    Music {
        /// Grid step in degrees, 0.001 to 10.
        grid_deg: f64,
        /// Whether to continue from the grid to the peak itself.
        refine: bool,
    },
    /// The roots of the MUSIC polynomial.
    RootMusic,
    /// ESPRIT, least squares.
    EspritLs,
    /// ESPRIT, total least squares.
    EspritTls,
}

impl Method {
    /// How many sources the method can tell apart with `N` antennas.
    pub const fn maximum_sources<const N: usize>(self) -> usize {
        match self {
            Self::MaximumLikelihood => 1,
            _ => N - 1,
        }
    }
}

/// The grid step in rad.
pub(super) fn checked_grid(grid_deg: f64) -> Result<f64, Error> {
    let sensible = (0.001..=10.0).contains(&grid_deg);
    if sensible {
        Ok(grid_deg.to_radians())
    } else {
        Err(Error::Grid(grid_deg))
    }
}
