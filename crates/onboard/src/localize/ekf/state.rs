//! What the filter knows about: twelve states, the same with and without a map. A state that a
//! setting switches off has zero variance and never moves.

use crate::gaussian::Gaussian;

/// Number of states.
pub const STATES: usize = 12;

/// The filter's belief.
pub type Belief = Gaussian<STATES>;

/// Along the track (m) with a map, `x` (m) without.
pub const ALONG: usize = 0;
/// Across the track, left positive (m), with a map; `y` (m) without.
pub const ACROSS: usize = 1;
/// Heading against the track's direction with a map, in the map frame without (rad).
pub const HEADING: usize = 2;
/// Curvature of the path driven (1/m); only where no map knows it.
pub const CURVATURE: usize = 3;
/// Odometer scale error ε: the odometer reads `(1 + ε)` times the distance travelled.
pub const SCALE: usize = 4;
/// Bias of the yaw rate (rad/s).
pub const YAW_RATE_BIAS: usize = 5;
/// Array axis against the vehicle's forward axis, counter-clockwise (rad).
pub const MOUNTING: usize = 6;
/// Constant offset of the electrical angle left by the phase calibration (rad per element).
pub const PHASE: usize = 7;
/// How much later angles come than their setting says (s).
pub const LATENESS: usize = 8;
/// Scale error κ of the yaw rate that wheels tell: it reads `(1 + κ)` times the turn.
pub const YAW_RATE_SCALE: usize = 9;
/// How far all radio heads stand from where the site plan has them, in x and in y (m).
pub const DATUM: [usize; 2] = [10, 11];
