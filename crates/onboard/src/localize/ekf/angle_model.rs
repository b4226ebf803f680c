//! Measurement model: the electrical angle of a radio head, with its Jacobian and second-order
//! correction.

use super::state::{ACROSS, ALONG, CURVATURE, DATUM, HEADING, MOUNTING, PHASE, STATES};
use crate::gaussian::{Matrix, dot};
use crate::geometry::Pose;
use crate::manifold::Measurand;
use crate::observation::MeasurementKind;
use crate::radio_head::RadioHead;
use crate::road::Road;

/// Distance below which the direction of a radio head is undefined (m).
const NEAREST_M: f64 = 0.05;

/// Measurement model of the array.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ArrayModel {
    /// Angle that the array measures.
    pub measurand: Measurand,
    /// Wavelength λ in metres.
    pub wavelength_m: f64,
    /// Position of the array's centre relative to the odometer's reference point
    /// `[forward, left, up]`, in metres.
    pub position_m: [f64; 3],
    /// Standard deviation of the forward and left position, each in metres.
    pub position_std_m: f64,
}

impl ArrayModel {
    /// Returns the factor of the scatter variance that remains when angles at a distance of
    /// `travelled_m` are averaged, relative to independent angles.
    ///
    /// As a function of the distance travelled, scatter from all directions has a flat spectrum
    /// between −1 and 1 cycle per wavelength. The line of sight is a spectral line at
    /// `direction_cosine`, the cosine of the angle between line of sight and direction of travel.
    /// Sampling with the step Δ (`travelled_m`) folds the spectrum at multiples of 1/Δ. An average
    /// cannot remove the scatter that is folded onto the spectral line. Its fraction is `λ/(2Δ)`
    /// times the number of integers m with `|m λ/Δ − direction_cosine| < 1`. Steps up to half a
    /// wavelength give one independent angle per half wavelength. For large steps, the factor tends
    /// to 1.
    pub fn correlation(&self, travelled_m: f64, direction_cosine: f64) -> f64 {
        if !travelled_m.is_finite() {
            return 1.0;
        }
        // At standstill there is no new information, but the variance must remain finite.
        let spacing = (travelled_m.abs() / self.wavelength_m).max(5e-10);
        let (first, last) = (
            spacing * (direction_cosine - 1.0),
            spacing * (direction_cosine + 1.0),
        );
        // At least the copy m = 0, the line of sight itself, is within the band.
        let copies = (last.ceil() - first.floor() - 1.0).max(1.0);
        copies / (2.0 * spacing)
    }
}

/// Road at the vehicle's position, for the Jacobian.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoadFrame {
    /// Direction of the first state (rad); the second state is to its left.
    pub direction_rad: f64,
    /// Distance travelled in the plane per metre of the first state, `1 − κ d`.
    pub stretch: f64,
    /// Heading change per metre of the first state with the other states constant, κ.
    pub curvature_per_m: f64,
}

impl RoadFrame {
    /// Without a road: the first two states are x and y.
    pub const PLANE: Self = Self {
        direction_rad: 0.0,
        stretch: 1.0,
        curvature_per_m: 0.0,
    };
}

/// Returns the pose `ahead_m` after that of the state, and the road at that position.
pub fn locate(mean: &[f64; STATES], ahead_m: f64, map: Option<&Road>) -> (Pose, RoadFrame) {
    let Some(map) = map else {
        let pose = Pose {
            x_m: mean[ALONG],
            y_m: mean[ACROSS],
            heading_rad: mean[HEADING],
        };
        return (pose.along_arc(ahead_m, mean[CURVATURE]), RoadFrame::PLANE);
    };
    let along_m = mean[ALONG] + ahead_m;
    let road = map.pose(along_m);
    let curvature_per_m = map.curvature_per_m(along_m);
    let frame = RoadFrame {
        direction_rad: road.heading_rad,
        stretch: 1.0 - curvature_per_m * mean[ACROSS],
        curvature_per_m,
    };
    let across_m = mean[ACROSS] + ahead_m * mean[HEADING];
    let heading_rad = road.heading_rad + mean[HEADING];
    let pose = Pose {
        heading_rad,
        ..road.offset_left(across_m)
    };
    (pose, frame)
}

/// Predicted electrical angle `ω = 2π (d/λ) cos ε cos α + ω₀`, or azimuth α, with its derivatives.
/// `α = β − φ − μ` for the bearing β and elevation ε of the radio head relative to the array,
/// heading φ, mounting angle μ and phase offset ω₀.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AngleModel {
    /// Electrical angle without wrapping, or azimuth (rad).
    pub phase_rad: f64,
    /// Derivative by each state.
    pub row: [f64; STATES],
    /// Distance of the radio head from the array (m).
    pub range_m: f64,
    /// Cosine of the angle between the line of sight and the direction of travel.
    pub direction_cosine: f64,
    /// Variance (rad²) of the angle due to the surveyed positions of radio head and array. It is
    /// constant while the radio head is received from the same side.
    pub survey_variance: f64,
    /// `A` of the Cramér–Rao bound `1/(2ρA)`; see [`Measurand::aperture`].
    pub aperture: f64,
    /// Derivative of α by each state.
    turn: [f64; STATES],
    /// Derivative of the position by each state, towards the radio head and to the left of that
    /// direction.
    position_rows: [[f64; STATES]; 2],
    /// Horizontal distance of the radio head (m).
    ground_m: f64,
    /// First and second derivative by α, both negated; for a uniform linear array `2π (d/λ) cos ε`
    /// times sine and cosine of α.
    slopes: [f64; 2],
}

/// Second-order correction of a predicted angle for the state covariance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SecondOrder {
    /// Bias of the expected angle (rad).
    pub shift_rad: f64,
    /// Additional variance (rad²).
    pub variance: f64,
}

/// Line of sight between the array on the vehicle and a radio head.
pub(super) struct LineOfSight {
    /// Bearing of the radio head from the array, in the map frame (rad).
    pub bearing_rad: f64,
    /// Horizontal distance (m).
    ground_m: f64,
    /// Distance in space (m).
    pub range_m: f64,
    /// Cosine of the angle between the horizontal line of sight and the vehicle's forward axis.
    along: f64,
    /// Derivatives of the array's position with respect to each state: towards the radio head, and
    /// to the left of that direction.
    pub position_rows: [[f64; STATES]; 2],
    /// Derivatives of the bearing with respect to each state.
    pub bearing_row: [f64; STATES],
}

impl LineOfSight {
    /// Creates the line of sight from the array of a vehicle at `pose`; `None` if the radio head is
    /// directly above the array or inside it, where its bearing is undefined.
    pub fn new(
        head: &RadioHead,
        pose: Pose,
        frame: &RoadFrame,
        mean: &[f64; STATES],
        array: &ArrayModel,
    ) -> Option<Self> {
        let [forward_m, left_m, up_m] = array.position_m;
        let array_point = pose.point_at(forward_m, left_m);
        let place = head.position.moved(DATUM.map(|state| mean[state]));
        let ground_m = array_point.distance_m(place);
        let range_m = ground_m.hypot(head.height_m - up_m);
        if range_m < NEAREST_M || ground_m < NEAREST_M {
            return None;
        }
        let bearing_rad = array_point.bearing_rad(place);
        let (left, ahead) = (bearing_rad - frame.direction_rad).sin_cos();
        // The array is not at the odometer's reference point, so that a heading change moves it.
        let (sine, cosine) = (bearing_rad - pose.heading_rad).sin_cos();
        let mut position_rows = [[0.0; STATES]; 2];
        position_rows[0][ALONG] = ahead * frame.stretch;
        position_rows[0][ACROSS] = left;
        position_rows[0][HEADING] = sine * forward_m - cosine * left_m;
        position_rows[1][ALONG] = -left * frame.stretch;
        position_rows[1][ACROSS] = ahead;
        position_rows[1][HEADING] = cosine * forward_m + sine * left_m;
        for entry in &mut position_rows {
            // In a bend, the heading changes with the distance along the road.
            entry[ALONG] += frame.curvature_per_m * entry[HEADING];
        }
        // A displacement to the left of the line of sight decreases the bearing.
        let mut bearing_row = position_rows[1].map(|entry| -entry / ground_m);
        // Derivatives by a displacement of the radio head to the east and north.
        let (north, east) = bearing_rad.sin_cos();
        (bearing_row[DATUM[0]], bearing_row[DATUM[1]]) = (-north / ground_m, east / ground_m);
        Some(Self {
            bearing_rad,
            ground_m,
            range_m,
            along: cosine,
            position_rows,
            bearing_row,
        })
    }

    /// Returns the cosine of the elevation.
    pub fn cos_elevation(&self) -> f64 {
        self.ground_m / self.range_m
    }
}

impl AngleModel {
    /// Creates the model of an angle of the given kind to a radio head, for a vehicle at `pose`
    /// with the state `mean`. Returns `None` if the radio head is directly above the array or
    /// inside it, and for an angle measured at a radio head without an array. [`bend`](Self::bend)
    /// corrects the prediction for the curvature at short distances.
    pub fn of_kind(
        kind: MeasurementKind,
        head: &RadioHead,
        pose: Pose,
        frame: &RoadFrame,
        mean: &[f64; STATES],
        array: &ArrayModel,
    ) -> Option<Self> {
        match kind {
            MeasurementKind::Angle => Self::new(head, pose, frame, mean, array),
            MeasurementKind::AngleAtHead => Self::at_head(head, pose, frame, mean, array),
        }
    }

    /// Creates the model for a radio head and a `pose`, with the mounting angle and phase of the
    /// state `mean`; `None` if the radio head is practically above or in the array, where its
    /// direction is undefined. [`bend`](Self::bend) returns the correction for small distances.
    pub fn new(
        head: &RadioHead,
        pose: Pose,
        frame: &RoadFrame,
        mean: &[f64; STATES],
        array: &ArrayModel,
    ) -> Option<Self> {
        let sight = LineOfSight::new(head, pose, frame, mean, array)?;
        let cos_elevation = sight.cos_elevation();
        let azimuth = sight.bearing_rad - pose.heading_rad - mean[MOUNTING];
        let value = array.measurand.value_rad(azimuth, cos_elevation);
        // Derivatives by the azimuth (first and second), by cos ε and by the phase.
        let (slopes, by_cos_elevation, by_phase) = match array.measurand {
            Measurand::ElectricalAngle {
                spacing_wavelengths,
                ..
            } => {
                let slope = std::f64::consts::TAU * spacing_wavelengths;
                let (sin, cos) = azimuth.sin_cos();
                (
                    [slope * cos_elevation * sin, slope * cos_elevation * cos],
                    slope * cos,
                    1.0,
                )
            }
            Measurand::Azimuth { .. } => ([-1.0, 0.0], 0.0, 0.0),
        };
        let mut turn = sight.bearing_row;
        turn[ALONG] -= frame.curvature_per_m;
        turn[HEADING] -= 1.0;
        turn[MOUNTING] = -1.0;
        let mut row = turn.map(|turn| -slopes[0] * turn);
        // A displacement towards the radio head increases its elevation: d cos ε = −sin² ε dρ/R.
        let elevation_rate =
            by_cos_elevation * (1.0 - cos_elevation * cos_elevation) / sight.range_m;
        for (value, entry) in row.iter_mut().zip(sight.position_rows[0]) {
            *value -= elevation_rate * entry;
        }
        row[PHASE] = by_phase;
        // A displacement of the radio head has the effect of the opposite displacement of the
        // vehicle.
        let (north, east) = sight.bearing_rad.sin_cos();
        row[DATUM[0]] += elevation_rate * east;
        row[DATUM[1]] += elevation_rate * north;
        let survey_variance = head.position_std_m.powi(2) + array.position_std_m.powi(2);
        Some(Self {
            phase_rad: value + by_phase * mean[PHASE],
            row,
            range_m: sight.range_m,
            direction_cosine: sight.along * cos_elevation,
            survey_variance: (slopes[0] / sight.ground_m).powi(2) * survey_variance,
            aperture: array.measurand.aperture(azimuth, cos_elevation),
            turn,
            position_rows: sight.position_rows,
            ground_m: sight.ground_m,
            slopes,
        })
    }

    /// Creates the model of an azimuth measured by the array of a radio head: the bearing from the
    /// radio head to the vehicle minus the azimuth of that array's axis. It does not depend on the
    /// heading, except through the offset of the vehicle's antenna from the odometer's reference
    /// point. The standard deviation of the measurement already contains the scatter of the
    /// channel, so that the aperture is infinite.
    fn at_head(
        head: &RadioHead,
        pose: Pose,
        frame: &RoadFrame,
        mean: &[f64; STATES],
        array: &ArrayModel,
    ) -> Option<Self> {
        let own = head.array?;
        let sight = LineOfSight::new(head, pose, frame, mean, array)?;
        let position_variance = head.position_std_m.powi(2) + array.position_std_m.powi(2);
        Some(Self {
            phase_rad: sight.bearing_rad + std::f64::consts::PI - own.mounting_rad,
            row: sight.bearing_row,
            range_m: sight.range_m,
            direction_cosine: sight.along * sight.cos_elevation(),
            survey_variance: position_variance / sight.ground_m.powi(2)
                + own.mounting_std_rad.powi(2),
            aperture: f64::INFINITY,
            turn: sight.bearing_row,
            position_rows: sight.position_rows,
            ground_m: sight.ground_m,
            slopes: [-1.0, 0.0],
        })
    }

    /// Returns the effect of the second derivative `D` of ω for a state covariance P: the mean of ω
    /// differs by `½ tr(D P)` from its value at the mean state, and its variance is larger by `½
    /// tr(D P D P)` (Jazwinski, Stochastic Processes and Filtering Theory, 9.3). With g the
    /// derivative of α, r and t the derivatives of the position along and across the line of sight
    /// and R its length, `D = −2π (d/λ) (cos α · g gᵀ − sin α / R² · (r tᵀ + t rᵀ))` for a uniform
    /// linear array, and `−(r tᵀ + t rᵀ) / R²` for an azimuth. These are the terms of the plane;
    /// the elevation contributes its cosine only.
    pub fn bend(&self, covariance: &Matrix<STATES>) -> SecondOrder {
        const BENT: [usize; 4] = [ALONG, ACROSS, HEADING, MOUNTING];
        let bent = |row: &[f64; STATES]| BENT.map(|state| row[state]);
        let (turn, [ahead, left]) = (bent(&self.turn), self.position_rows.each_ref().map(bent));
        let with = |row: [f64; 4]| BENT.map(|state| dot(&bent(&covariance[state]), &row));
        let (with_turn, with_ahead, with_left) = (with(turn), with(ahead), with(left));
        let (gg, gr, gt) = (
            dot(&turn, &with_turn),
            dot(&ahead, &with_turn),
            dot(&left, &with_turn),
        );
        let (rr, rt, tt) = (
            dot(&ahead, &with_ahead),
            dot(&left, &with_ahead),
            dot(&left, &with_left),
        );
        let (a, b) = (
            -self.slopes[1],
            self.slopes[0] / (self.ground_m * self.ground_m),
        );
        SecondOrder {
            shift_rad: 0.5 * a * gg + b * rt,
            variance: 0.5 * a * a * gg * gg + 2.0 * a * b * gr * gt + b * b * (rt * rt + rr * tt),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Point, wrap_angle};
    use crate::manifold::scatter_bound;
    use crate::range::{HeadClock, RangeOffset};
    use crate::settings::HeadArraySettings;

    fn head(x_m: f64, y_m: f64, height_m: f64) -> RadioHead {
        RadioHead {
            pci: 1,
            ssb_index: 0,
            position: Point::new(x_m, y_m),
            height_m,
            position_std_m: 0.0,
            eirp_dbm: 0.0,
            array: None,
            clock: HeadClock::default(),
            range_offset: RangeOffset::default(),
        }
    }

    fn mean(mounting: f64, phase: f64) -> [f64; STATES] {
        let mut mean = [0.0; STATES];
        mean[MOUNTING] = mounting;
        mean[PHASE] = phase;
        mean
    }

    const ARRAY: ArrayModel = ArrayModel {
        measurand: Measurand::ElectricalAngle {
            elements: 4,
            spacing_wavelengths: 0.5,
        },
        wavelength_m: 0.0857,
        position_m: [0.0; 3],
        position_std_m: 0.0,
    };

    /// Returns pose and road frame for the state (s, d, ψ) on a circle of radius 1/κ through the
    /// origin, with heading +x.
    fn on_circle(s: f64, d: f64, psi: f64, kappa: f64) -> (Pose, RoadFrame) {
        let lane = Pose::default().along_arc(s, kappa);
        let pose = lane.offset_left(d);
        let frame = RoadFrame {
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
            frame,
        )
    }

    #[test]
    fn gradient_equals_finite_differences() {
        let kappa = 0.01;
        for (height_m, position_m) in [(0.0, [0.0; 3]), (9.0, [0.8, -0.3, 1.2])] {
            let array = ArrayModel {
                position_m,
                ..ARRAY
            };
            let see = |x: [f64; 7]| {
                let (pose, frame) = on_circle(x[0], x[1], x[2], kappa);
                let head = head(70.0, 40.0, height_m);
                let mut mean = mean(x[3], x[4]);
                (mean[DATUM[0]], mean[DATUM[1]]) = (x[5], x[6]);
                AngleModel::new(&head, pose, &frame, &mean, &array).unwrap()
            };
            let x = [30.0, 0.8, 0.05, 0.02, 0.1, 1.5, -0.7];
            let angle_model = see(x);
            let [east, north] = DATUM;
            let states = [ALONG, ACROSS, HEADING, MOUNTING, PHASE, east, north];
            for (i, state) in states.into_iter().enumerate() {
                let (mut up, mut down) = (x, x);
                up[i] += 1e-5;
                down[i] -= 1e-5;
                let slope = (see(up).phase_rad - see(down).phase_rad) / 2e-5;
                assert!(
                    (slope - angle_model.row[state]).abs() < 1e-8,
                    "state {state}: {slope} {}",
                    angle_model.row[state]
                );
            }
        }
    }

    #[test]
    fn the_azimuth_at_a_head_and_its_gradient_are_those_of_the_bearing_from_there() {
        let kappa = 0.01;
        let array = ArrayModel {
            position_m: [0.8, -0.3, 1.2],
            ..ARRAY
        };
        let own = HeadArraySettings {
            mounting_rad: 0.7,
            mounting_std_rad: 0.02,
        };
        let head = RadioHead {
            array: Some(own),
            position_std_m: 0.1,
            ..head(70.0, 40.0, 9.0)
        };
        let see = |x: [f64; 5]| {
            let (pose, frame) = on_circle(x[0], x[1], x[2], kappa);
            let mut mean = mean(0.3, 0.2);
            (mean[DATUM[0]], mean[DATUM[1]]) = (x[3], x[4]);
            let kind = MeasurementKind::AngleAtHead;
            let model = AngleModel::of_kind(kind, &head, pose, &frame, &mean, &array).unwrap();
            let place = head.position.moved([x[3], x[4]]);
            let bearing = place.bearing_rad(pose.point_at(0.8, -0.3));
            assert!(wrap_angle(model.phase_rad - (bearing - 0.7)).abs() < 1e-12);
            model
        };
        let x = [30.0, 0.8, 0.05, 1.5, -0.7];
        let model = see(x);
        let mut expected = [0.0; STATES];
        let states = [ALONG, ACROSS, HEADING, DATUM[0], DATUM[1]];
        for (i, state) in states.into_iter().enumerate() {
            let (mut up, mut down) = (x, x);
            up[i] += 1e-5;
            down[i] -= 1e-5;
            expected[state] = (see(up).phase_rad - see(down).phase_rad) / 2e-5;
        }
        // Mounting angle and phase of the vehicle's array have no effect.
        for (state, (expected, row)) in expected.iter().zip(model.row).enumerate() {
            assert!(
                (expected - row).abs() < 1e-8,
                "state {state}: {expected} {row}"
            );
        }
        let expected = 0.1_f64.powi(2) / model.ground_m.powi(2) + 0.02_f64.powi(2);
        assert!((model.survey_variance - expected).abs() < 1e-12);
        let without = RadioHead {
            array: None,
            ..head
        };
        let (pose, frame) = on_circle(30.0, 0.8, 0.05, kappa);
        let kind = MeasurementKind::AngleAtHead;
        assert!(
            AngleModel::of_kind(kind, &without, pose, &frame, &mean(0.0, 0.0), &array).is_none()
        );
    }

    #[test]
    fn the_second_derivative_equals_finite_differences() {
        let states = [ALONG, ACROSS, HEADING, MOUNTING];
        let see = |x: [f64; 4]| {
            let (pose, frame) = on_circle(x[0], x[1], x[2], 0.0);
            AngleModel::new(
                &head(40.0, 30.0, 0.0),
                pose,
                &frame,
                &mean(x[3], 0.0),
                &ARRAY,
            )
            .unwrap()
        };
        // Full covariance without special structure.
        let factor = [
            [2.0, 0.0, 0.0, 0.0],
            [0.7, 1.5, 0.0, 0.0],
            [0.02, -0.03, 0.04, 0.0],
            [0.01, 0.02, 0.01, 0.02],
        ];
        let mut covariance = [[0.0; STATES]; STATES];
        for (i, &row) in states.iter().enumerate() {
            for (j, &column) in states.iter().enumerate() {
                covariance[row][column] = (0..4).map(|k| factor[i][k] * factor[j][k]).sum();
            }
        }
        let x = [3.0, 0.8, 0.05, 0.02];
        let mut second = [[0.0; 4]; 4];
        for (i, row) in second.iter_mut().enumerate() {
            for (j, value) in row.iter_mut().enumerate() {
                let at = |a: f64, b: f64| {
                    let mut x = x;
                    x[i] += a;
                    x[j] += b;
                    see(x).phase_rad
                };
                let h = 1e-3;
                *value = (at(h, h) - at(h, -h) - at(-h, h) + at(-h, -h)) / (4.0 * h * h);
            }
        }
        let mut product = [[0.0; 4]; 4];
        for (i, row) in product.iter_mut().enumerate() {
            for (j, value) in row.iter_mut().enumerate() {
                *value = (0..4)
                    .map(|k| second[i][k] * covariance[states[k]][states[j]])
                    .sum();
            }
        }
        let trace: f64 = (0..4).map(|i| product[i][i]).sum();
        let square: f64 = (0..4)
            .map(|i| (0..4).map(|j| product[i][j] * product[j][i]).sum::<f64>())
            .sum();
        let bend = see(x).bend(&covariance);
        assert!(
            (bend.shift_rad - 0.5 * trace).abs() < 1e-6,
            "{bend:?} {trace}"
        );
        assert!(
            (bend.variance - 0.5 * square).abs() < 1e-6,
            "{bend:?} {square}"
        );
    }

    #[test]
    fn phases_of_radio_heads_ahead_and_abeam_are_correct() {
        let frame = on_circle(0.0, 0.0, 0.0, 0.0).1;
        let see = |head: RadioHead| {
            AngleModel::new(&head, Pose::default(), &frame, &mean(0.0, 0.0), &ARRAY).unwrap()
        };
        let ahead = see(head(50.0, 0.0, 0.0)).phase_rad;
        assert!((ahead - std::f64::consts::PI).abs() < 1e-12);
        assert!(see(head(0.0, 9.0, 0.0)).phase_rad.abs() < 1e-12);
        // Elevation of 45°.
        let above = see(head(50.0, 0.0, 50.0)).phase_rad;
        assert!((above - std::f64::consts::PI / 2f64.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn scatter_variance_equals_its_approximation() {
        let (row, aperture) = (ARRAY.measurand, ARRAY.measurand.mean_aperture());
        assert!((row.scatter_variance(1000.0, aperture) * 10.0 * 1000.0 - 1.0).abs() < 4e-4);
        // Mean of two million estimates at K = 10 in an independent simulation: 1.0346(11).
        let at_10 = row.scatter_variance(10.0, aperture) / scatter_bound(10.0, aperture);
        assert!((at_10 - 1.0346).abs() < 3.0 * 0.0011, "{at_10}");
    }

    #[test]
    fn the_probability_of_a_wrong_lobe_equals_the_simulated_frequency() {
        // Fraction of errors above a quarter turn among 40,000 estimates of an independent
        // simulation.
        for (k_db, share) in [(0.0, 0.1199), (3.0, 0.0270), (5.0, 0.0040)] {
            let k = 10f64.powf(0.1 * k_db);
            let ratio = ARRAY.measurand.wrong_lobe_probability(k) / share;
            assert!((0.5..2.0).contains(&ratio), "{k_db} dB: {ratio}");
        }
        assert!(ARRAY.measurand.wrong_lobe_probability(10.0) < 1e-6);
    }

    #[test]
    fn correlation_is_the_sum_over_the_autocorrelation_of_the_scatter() {
        // Autocorrelation sin(x)/x over the distance, times the Doppler phase of the line of sight;
        // Cesàro sum.
        let summed = |wavelengths: f64, direction_cosine: f64| {
            let count = 4000;
            let terms = (1..count).map(|n| {
                let x = std::f64::consts::TAU * wavelengths * f64::from(n);
                let weight = 1.0 - f64::from(n) / f64::from(count);
                2.0 * weight * x.sin() / x * (x * direction_cosine).cos()
            });
            1.0 + terms.sum::<f64>()
        };
        for wavelengths in [0.1, 0.3, 0.6, 0.75, 0.97, 1.4, 3.3, 12.2] {
            for direction_cosine in [-0.9, -0.3, 0.0, 0.45, 0.8] {
                let (found, expected) = (
                    ARRAY.correlation(wavelengths * ARRAY.wavelength_m, direction_cosine),
                    summed(wavelengths, direction_cosine),
                );
                assert!(
                    (found - expected).abs() < 0.02 * expected,
                    "{wavelengths} {direction_cosine}: {found} {expected}"
                );
            }
        }
        assert_eq!(ARRAY.correlation(f64::INFINITY, 0.3), 1.0);
        assert!(ARRAY.correlation(0.0, 1.0).is_finite());
    }
}
