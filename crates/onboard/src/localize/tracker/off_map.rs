//! Where the map does not tell how the road goes on.

use crate::road::Gap;

/// Where the vehicle is off the map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum OffMap {
    /// Certainly beyond one of its ends, this far (m).
    Beyond {
        /// Distance from the end.
        by_m: f64,
    },
    /// Not certainly outside of this gap.
    Gap(Gap),
}
