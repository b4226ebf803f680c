//! Seen from the vehicle: the electrical angle at which a radio head appears, and how it changes
//! with the state.

use super::state::{ACROSS, ALONG, HEADING, MOUNTING, PHASE, STATES};
use crate::geometry::{Point, Pose};

/// What the array turns an angle into.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ArrayModel {
    /// Number of antennas N.
    pub elements: u8,
    /// Distance between neighbours in wavelengths, `d/λ`.
    pub spacing_wavelengths: f64,
    /// Wavelength λ in metres.
    pub wavelength_m: f64,
}

impl ArrayModel {
    /// Variance (rad²) of the electrical angle that scatter of the given Rician K (power ratio)
    /// leaves in one look, however strong the signal: one snapshot at an SNR of K,
    /// `6 / (K N (N² − 1)) · (1 + 1/(N K))`, which is about `1/(10 K)` for four antennas.
    pub fn scatter_variance(&self, rician_k: f64) -> f64 {
        let n = f64::from(self.elements);
        6.0 / (rician_k * n * (n * n - 1.0)) * (1.0 + 1.0 / (n * rician_k))
    }
}

/// The road under the vehicle, as the Jacobian needs it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Footing {
    /// Direction in which the first state grows (rad); the second grows to its left.
    pub direction_rad: f64,
    /// Metres travelled in the plane per metre of the first state, `1 − κ d`.
    pub stretch: f64,
    /// Turn of the vehicle per metre of the first state with the others kept, κ.
    pub curvature_per_m: f64,
}

impl Footing {
    /// No road: the first two states are x and y.
    pub const PLANE: Self = Self {
        direction_rad: 0.0,
        stretch: 1.0,
        curvature_per_m: 0.0,
    };
}

/// Predicted electrical angle `ω = 2π (d/λ) cos(β − φ − μ) + ω₀` and its gradient, for bearing β
/// of the radio head, heading φ, mounting angle μ and phase offset ω₀.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sighting {
    /// Electrical angle (rad), not wrapped.
    pub phase_rad: f64,
    /// Its derivative by each state.
    pub row: [f64; STATES],
    /// Distance to the radio head (m).
    pub range_m: f64,
}

impl Sighting {
    /// The radio head at `head` seen from `pose`; `None` when it is closer than a metre, where an
    /// angle says nothing that a linear update could use.
    pub fn new(
        head: Point,
        pose: Pose,
        footing: &Footing,
        mounting_rad: f64,
        offset_rad: f64,
        array: &ArrayModel,
    ) -> Option<Self> {
        let range_m = pose.point().distance_m(head);
        if range_m < 1.0 {
            return None;
        }
        let bearing = pose.point().bearing_rad(head);
        let slope = std::f64::consts::TAU * array.spacing_wavelengths;
        let (sin, cos) = (bearing - pose.heading_rad - mounting_rad).sin_cos();
        // A step of length dl in direction δ turns the bearing by sin(β − δ) dl / R.
        let (across_sight, along_sight) = (bearing - footing.direction_rad).sin_cos();
        let turn_by_along = across_sight * footing.stretch / range_m - footing.curvature_per_m;
        let turn_by_across = -along_sight / range_m;
        let mut row = [0.0; STATES];
        row[ALONG] = -slope * sin * turn_by_along;
        row[ACROSS] = -slope * sin * turn_by_across;
        row[HEADING] = slope * sin;
        row[MOUNTING] = slope * sin;
        row[PHASE] = 1.0;
        Some(Self {
            phase_rad: slope * cos + offset_rad,
            row,
            range_m,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ARRAY: ArrayModel = ArrayModel {
        elements: 4,
        spacing_wavelengths: 0.5,
        wavelength_m: 0.0857,
    };

    /// State (s, d, ψ) on a circle of radius 1/κ through the origin, heading +x.
    fn on_circle(s: f64, d: f64, psi: f64, kappa: f64) -> (Pose, Footing) {
        let lane = Pose::default().along_arc(s, kappa);
        let pose = lane.offset_left(d);
        let footing = Footing {
            direction_rad: lane.heading_rad,
            stretch: 1.0 - kappa * d,
            curvature_per_m: kappa,
        };
        let heading_rad = lane.heading_rad + psi;
        (
            Pose {
                heading_rad,
                ..pose
            },
            footing,
        )
    }

    #[test]
    fn gradient_equals_finite_differences() {
        let head = Point::new(70.0, 40.0);
        let kappa = 0.01;
        let see = |x: [f64; 5]| {
            let (pose, footing) = on_circle(x[0], x[1], x[2], kappa);
            Sighting::new(head, pose, &footing, x[3], x[4], &ARRAY).unwrap()
        };
        let x = [30.0, 0.8, 0.05, 0.02, 0.1];
        let sighting = see(x);
        for (i, state) in [ALONG, ACROSS, HEADING, MOUNTING, PHASE]
            .into_iter()
            .enumerate()
        {
            let (mut up, mut down) = (x, x);
            up[i] += 1e-5;
            down[i] -= 1e-5;
            let slope = (see(up).phase_rad - see(down).phase_rad) / 2e-5;
            assert!(
                (slope - sighting.row[state]).abs() < 1e-8,
                "state {state}: {slope} {}",
                sighting.row[state]
            );
        }
    }

    #[test]
    fn a_head_ahead_is_at_pi_and_one_abeam_at_zero() {
        let footing = on_circle(0.0, 0.0, 0.0, 0.0).1;
        let ahead = Sighting::new(
            Point::new(50.0, 0.0),
            Pose::default(),
            &footing,
            0.0,
            0.0,
            &ARRAY,
        );
        assert!((ahead.unwrap().phase_rad - std::f64::consts::PI).abs() < 1e-12);
        let abeam = Sighting::new(
            Point::new(0.0, 9.0),
            Pose::default(),
            &footing,
            0.0,
            0.0,
            &ARRAY,
        );
        assert!(abeam.unwrap().phase_rad.abs() < 1e-12);
    }

    #[test]
    fn scatter_leaves_a_tenth_over_k() {
        assert!((ARRAY.scatter_variance(1000.0) * 10.0 * 1000.0 - 1.0).abs() < 3e-4);
    }
}
