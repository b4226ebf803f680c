//! Position of a radio head estimated from its own angles and the path estimated from the others.

use onboard::gaussian::{Innovation, with_outliers};
use onboard::geometry::{Point, Pose, wrap_angle};
use onboard::localize::MeasurementKind;
use onboard::manifold::Measurand;

use super::evidence::{HeadId, OUTLIERS, head_of};
use super::hypotheses::Drive;
use super::stated::with_phase;

/// Standard deviation of an angle due to errors of the path (rad).
const PATH_STD_RAD: f64 = 0.1;

/// Maximum distance of the search from the path and from the site file's position (m).
const REACH_M: f64 = 60.0;
/// Number of grid steps of the search in each direction.
const STEPS: usize = 60;

/// Number of grid positions that are refined.
const REFINED: usize = 12;
/// Step size that ends the refinement (m).
const FINEST_M: f64 = 0.05;

/// Maximum number of moves with one step size: one to each side of a cell along both axes.
const MAX_MOVES: usize = 4;

/// Log-likelihood difference below which positions are equally good; the one nearest to the site
/// file's position is selected.
const AS_GOOD: f64 = 3.0;

/// Minimum number of angles for an estimate.
const MIN_ANGLES: usize = 10;

/// An angle, the position of the vehicle's array, and the direction of azimuth 0 of the array that measured it.
struct Sighted {
    kind: MeasurementKind,
    from: Point,
    axis_rad: f64,
    phase_rad: f64,
    variance: f64,
}

/// Returns the estimated position of a radio head; `None` if the angles do not determine it. `path`
/// contains the estimated pose at each of the drive's angles.
pub fn triangulate(drive: &Drive<'_>, head: HeadId, path: &[Option<Pose>]) -> Option<Point> {
    let settings = (drive.site.radio_heads.iter()).find(|it| (it.pci, it.ssb_index) == head)?;
    let array = &drive.vehicle.array;
    let measurand = array.measurand();
    let [forward_m, left_m, up_m] = array.position_m;
    let [x_m, y_m, height_m] = settings.position_m;
    let own = drive.angles.iter().zip(path);
    let sighted: Vec<Sighted> = (own.filter(|(angle, _)| head_of(angle) == head))
        .filter_map(|(angle, pose)| {
            let (measured, pose) = (with_phase(angle, &measurand).measured, (*pose)?);
            let axis_rad = match measured.kind {
                MeasurementKind::Angle => pose.heading_rad + array.mounting_rad,
                MeasurementKind::AngleAtHead => settings.array?.mounting_rad,
            };
            Some(Sighted {
                kind: measured.kind,
                from: pose.point_at(forward_m, left_m),
                axis_rad,
                phase_rad: measured.phase_rad,
                variance: measured.phase_sigma_rad.powi(2) + PATH_STD_RAD.powi(2),
            })
        })
        .collect();
    if sighted.len() < MIN_ANGLES {
        return None;
    }
    let stated = Point::new(x_m, y_m);
    let likelihood = |place: Point| log_likelihood(&sighted, place, height_m - up_m, &measurand);
    let bounds = |of: fn(&Point) -> f64| {
        let of = sighted.iter().map(|it| of(&it.from));
        let (low, high) = of.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), it| {
            (low.min(it), high.max(it))
        });
        (low - REACH_M, high + REACH_M)
    };
    let (west, east) = bounds(|it| it.x_m);
    let (south, north) = bounds(|it| it.y_m);
    let mut places: Vec<(f64, Point)> = Vec::with_capacity((STEPS + 1) * (STEPS + 1) + 1);
    for i in 0..=STEPS {
        for j in 0..=STEPS {
            let share = |k: usize| k as f64 / STEPS as f64;
            let place = Point::new(
                west + share(i) * (east - west),
                south + share(j) * (north - south),
            );
            places.push((likelihood(place), place));
        }
    }
    places.push((likelihood(stated), stated));
    places.sort_by(|one, other| other.0.total_cmp(&one.0));
    let coarse_m = (east - west).max(north - south) / STEPS as f64;
    let refined: Vec<(f64, Point)> = (places.into_iter().take(REFINED))
        .map(|place| refine(place, coarse_m, likelihood))
        .collect();
    let best = refined
        .iter()
        .map(|it| it.0)
        .fold(f64::NEG_INFINITY, f64::max);
    let equally_likely = refined.iter().filter(|it| best - it.0 < AS_GOOD);
    let nearest = equally_likely
        .min_by(|(_, one), (_, other)| one.distance_m(stated).total_cmp(&other.distance_m(stated)));
    nearest.map(|(_, place)| *place)
}

fn log_likelihood(sighted: &[Sighted], place: Point, rise_m: f64, measurand: &Measurand) -> f64 {
    let of_angle = |it: &Sighted| {
        let ground_m = it.from.distance_m(place);
        let level = ground_m / ground_m.hypot(rise_m).max(f64::MIN_POSITIVE);
        let predicted = match it.kind {
            MeasurementKind::Angle => {
                measurand.value_rad(it.from.bearing_rad(place) - it.axis_rad, level)
            }
            MeasurementKind::AngleAtHead => place.bearing_rad(it.from) - it.axis_rad,
        };
        let innovation = Innovation {
            residual: wrap_angle(it.phase_rad - predicted),
            variance: it.variance,
            measurement_variance: it.variance,
        };
        with_outliers(innovation.density(), OUTLIERS).ln()
    };
    sighted.iter().map(of_angle).sum()
}

/// Refines a position by pattern search (Hooke and Jeeves, J. ACM 8(2), 1961). The number of moves
/// per step size is limited to the resolution of the previous grid, because the likelihood may
/// increase for kilometres along a diverged path.
fn refine(
    mut best: (f64, Point),
    mut step_m: f64,
    likelihood: impl Fn(Point) -> f64,
) -> (f64, Point) {
    while step_m > FINEST_M {
        for _ in 0..MAX_MOVES {
            let Point { x_m, y_m } = best.1;
            let around = [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)];
            let tried = around.map(|(dx, dy)| {
                let place = Point::new(x_m + step_m * dx, y_m + step_m * dy);
                (likelihood(place), place)
            });
            let better = tried
                .into_iter()
                .max_by(|one, other| one.0.total_cmp(&other.0));
            let Some(better) = better.filter(|it| it.0 > best.0) else {
                break;
            };
            best = better;
        }
        step_m *= 0.5;
    }
    best
}
