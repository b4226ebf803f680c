//! State vector: twelve states, the same with and without a map. A state that the settings disable
//! has zero variance and does not change.

use crate::gaussian::Gaussian;

/// Number of states.
pub const STATES: usize = 12;

/// State estimate: mean and covariance.
pub type Belief = Gaussian<STATES>;

/// Distance along the road (m) with a map, `x` (m) without.
pub const ALONG: usize = 0;
/// Lateral offset from the road, positive to the left (m), with a map; `y` (m) without.
pub const ACROSS: usize = 1;
/// Heading relative to the road with a map, in the map frame without (rad).
pub const HEADING: usize = 2;
/// Curvature of the path (1/m); only where the map does not contain it.
pub const CURVATURE: usize = 3;
/// Odometer scale error ε: the odometer measures `(1 + ε)` times the distance driven.
pub const SCALE: usize = 4;
/// Bias of the yaw rate (rad/s).
pub const YAW_RATE_BIAS: usize = 5;
/// Direction of the array axis relative to the vehicle's forward axis, counter-clockwise (rad).
pub const MOUNTING: usize = 6;
/// Constant residual of the phase calibration in the electrical angle (rad per element).
pub const PHASE: usize = 7;
/// Time offset of the angles in addition to the specified one (s).
pub const ANGLE_TIME_OFFSET: usize = 8;
/// Scale error κ of a yaw rate measured by wheels: it measures `(1 + κ)` times the heading change.
pub const YAW_RATE_SCALE: usize = 9;
/// Displacement of all radio heads relative to the site plan, in x and y (m).
pub const DATUM: [usize; 2] = [10, 11];
