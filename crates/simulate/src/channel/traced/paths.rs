//! Ray-traced paths between radio heads and the positions of a site.

use std::collections::HashMap;
use std::f64::consts::FRAC_PI_2;
use std::path::Path;

use num_complex::Complex32;
use onboard::geometry::Point;
use onboard::road::Road;
use onboard::settings::{RadioHeadSettings, SPEED_OF_LIGHT_MPS, Site};
use thiserror::Error;

use super::read::Arrays;

/// Maximum distance between a position and the nearest traced position, in metres.
const REACH_M: f64 = 1.0;
/// Maximum length of the road before the first and after the last traced position, in metres.
const ENDS_M: f64 = 10.0;
/// Tolerance of a path that is shorter than the straight line, in metres. Single precision and
/// rounded positions cause such paths.
const SLACK_M: f64 = 0.3;
/// Maximum length of a path in metres; a longer path indicates a wrong unit.
const LONGEST_M: f64 = 1e5;
/// Maximum excess length of the line of sight, in metres.
const DIRECT_M: f64 = 0.01;
/// Minimum cosine between the geometric direction of the line of sight and its direction of arrival
/// in the file.
const MIN_COSINE: f64 = 0.9;

/// Error of a file of paths.
#[derive(Debug, Error)]
#[error("{0}")]
pub struct PathsError(String);

impl PathsError {
    fn that<T>(what: impl Into<String>) -> Result<T, Self> {
        Err(Self(what.into()))
    }
}

/// One path at one position.
#[derive(Debug, Clone, Copy)]
pub struct TracedPath {
    /// Complex amplitude: its squared magnitude is the gain between isotropic antennas, and its
    /// phase is valid at the traced position.
    pub gain: Complex32,
    /// Delay relative to the straight line (s).
    pub excess_s: f32,
    /// Horizontal part of the unit vector to the source.
    pub towards: [f32; 2],
    /// Whether it is the line of sight.
    pub direct: bool,
}

/// Ray-traced paths of a site.
#[derive(Debug, Clone)]
pub struct Paths {
    carrier_mhz: f64,
    heads: Vec<Head>,
    places: Vec<[f64; 3]>,
    /// Indices of the traced positions in each square of the ground.
    squares: HashMap<[i64; 2], Vec<usize>>,
    /// Index of the first path of each radio head and traced position.
    begins: Vec<usize>,
    all: Vec<TracedPath>,
}

#[derive(Debug, Clone, Copy)]
struct Head {
    pci: f64,
    ssb_index: f64,
    position_m: [f64; 3],
}

impl Paths {
    /// Reads an npz file with the following arrays.
    ///
    /// - `carrier_mhz`
    /// - `head_pci`, `head_ssb_index`, `head_m` (n × 3, map frame)
    /// - `place_m` (n × 3, map frame)
    /// - per path: `path_head` and `path_place` (indices from 0), `gain` (complex), `delay_s`,
    ///   `azimuth_rad` and `elevation_rad` (angles of arrival, map frame)
    ///
    /// # Errors
    /// [`PathsError`] with the array and the error.
    pub fn read(file: &Path) -> Result<Self, PathsError> {
        let mut arrays = Arrays::open(file).map_err(PathsError)?;
        let mut numbers = |name: &str, width| arrays.numbers(name, width).map_err(PathsError);
        let carrier_mhz = numbers("carrier_mhz", 1)?
            .first()
            .copied()
            .unwrap_or(f64::NAN);
        let [pcis, indices] = [numbers("head_pci", 1)?, numbers("head_ssb_index", 1)?];
        let head_m = rows(&numbers("head_m", 3)?);
        let places = rows(&numbers("place_m", 3)?);
        let [of_head, of_place] = [numbers("path_head", 1)?, numbers("path_place", 1)?];
        let [delays_s, azimuths_rad, elevations_rad] = [
            numbers("delay_s", 1)?,
            numbers("azimuth_rad", 1)?,
            numbers("elevation_rad", 1)?,
        ];
        let gains = arrays.complex("gain").map_err(PathsError)?;
        finite("head_m", head_m.iter().flatten())?;
        finite("place_m", places.iter().flatten())?;
        if pcis.len() != head_m.len() || indices.len() != head_m.len() {
            return PathsError::that(
                "`head_pci`, `head_ssb_index` and `head_m` must have equal lengths",
            );
        }
        for (pci, [_, _, z_m]) in pcis.iter().zip(&head_m) {
            if *z_m < 0.0 {
                return PathsError::that(format!(
                    "`head_m`: radio head pci={pci} at z = {z_m} m is below the road"
                ));
            }
        }
        let count = gains.len();
        for (name, values) in [
            ("path_head", &of_head),
            ("path_place", &of_place),
            ("delay_s", &delays_s),
            ("azimuth_rad", &azimuths_rad),
            ("elevation_rad", &elevations_rad),
        ] {
            if values.len() != count {
                let found = values.len();
                return PathsError::that(format!("`{name}` has {found} values, `gain` {count}"));
            }
            finite(name, values)?;
        }
        if let Some(row) = gains.iter().position(|gain| !gain.norm_sqr().is_finite()) {
            return PathsError::that(format!("`gain` is not a number in row {row}"));
        }
        if let Some(row) = gains.iter().position(|gain| gain.norm_sqr() > 1.0) {
            return PathsError::that(format!(
                "`gain` is {} in row {row}; it is an amplitude between isotropic antennas, not above 1",
                gains[row]
            ));
        }
        let within = |values: &[f64], count: usize| {
            (values.iter()).position(|it| it.fract() != 0.0 || !(0.0..count as f64).contains(it))
        };
        for (name, values, of, count) in [
            ("path_head", &of_head, "head_m", head_m.len()),
            ("path_place", &of_place, "place_m", places.len()),
        ] {
            if let Some(row) = within(values, count) {
                return PathsError::that(format!(
                    "`{name}` is {} in row {row}; `{of}` has the rows 0 to {}",
                    values[row],
                    count.saturating_sub(1)
                ));
            }
        }
        if let Some(row) = elevations_rad
            .iter()
            .position(|it| it.abs() > FRAC_PI_2 + 1e-6)
        {
            return PathsError::that(format!(
                "`elevation_rad` is {} in row {row}; it counts from the horizon, −π/2 to π/2",
                elevations_rad[row]
            ));
        }

        let mut order: Vec<usize> = (0..count).collect();
        let link = |row: usize| of_head[row] as usize * places.len() + of_place[row] as usize;
        order.sort_by_key(|&row| link(row));
        let mut begins = vec![0; head_m.len() * places.len() + 1];
        let mut all = Vec::with_capacity(count);
        for row in order {
            let [head, place] = [
                head_m[of_head[row] as usize],
                places[of_place[row] as usize],
            ];
            let straight_m = between_m(head, place);
            let length_m = delays_s[row] * SPEED_OF_LIGHT_MPS;
            if length_m < straight_m - SLACK_M {
                return PathsError::that(format!(
                    "`delay_s` in row {row}: the path of {length_m:.2} m is shorter than the distance of \
                     {straight_m:.2} m between `head_m` and `place_m`: they are not in one frame"
                ));
            }
            if length_m > LONGEST_M {
                return PathsError::that(format!(
                    "`delay_s` is {} in row {row}, a path of {:.0} km; it must be in seconds",
                    delays_s[row],
                    1e-3 * length_m
                ));
            }
            let (up, level) = elevations_rad[row].sin_cos();
            let (sin, cos) = azimuths_rad[row].sin_cos();
            let direct = length_m - straight_m < DIRECT_M;
            let along_m = (head[0] - place[0]) * level * cos
                + (head[1] - place[1]) * level * sin
                + (head[2] - place[2]) * up;
            let is_sight = (length_m - straight_m).abs() < DIRECT_M && straight_m > REACH_M;
            if is_sight && along_m < MIN_COSINE * straight_m {
                return PathsError::that(format!(
                    "`azimuth_rad`, `elevation_rad` in row {row}: the line of sight does not come \
                     from the radio head; write directions of arrival in the map frame"
                ));
            }
            begins[link(row) + 1] += 1;
            all.push(TracedPath {
                gain: gains[row],
                excess_s: ((length_m - straight_m) / SPEED_OF_LIGHT_MPS) as f32,
                towards: [(level * cos) as f32, (level * sin) as f32],
                direct,
            });
        }
        for link in 1..begins.len() {
            begins[link] += begins[link - 1];
        }
        let mut squares: HashMap<_, Vec<usize>> = HashMap::new();
        for (number, [x_m, y_m, _]) in places.iter().enumerate() {
            squares
                .entry(square(Point::new(*x_m, *y_m)))
                .or_default()
                .push(number);
        }
        let heads = pcis.into_iter().zip(indices).zip(head_m);
        let head = |((pci, ssb_index), position_m)| Head {
            pci,
            ssb_index,
            position_m,
        };
        Ok(Self {
            carrier_mhz,
            heads: heads.map(head).collect(),
            places,
            squares,
            begins,
            all,
        })
    }

    /// Checks that the paths belong to the site, carrier and road.
    ///
    /// # Errors
    /// [`PathsError`].
    pub fn check(&self, site: &Site, road: &Road) -> Result<(), PathsError> {
        let carrier_mhz = site.carrier_mhz;
        // Phases are valid at one frequency. The SSB's centre frequency differs from the carrier's
        // by less than 1 %.
        let same = (self.carrier_mhz / carrier_mhz - 1.0).abs() <= 0.01;
        if !same {
            return PathsError::that(format!(
                "its paths are of {} MHz, the site's carrier is {carrier_mhz} MHz",
                self.carrier_mhz
            ));
        }
        for settings in &site.radio_heads {
            let (pci, ssb_index) = (settings.pci, settings.ssb_index);
            let Some(number) = self.head(settings) else {
                return PathsError::that(format!(
                    "it contains no paths of the site's radio head pci={pci} ssb_index={ssb_index}"
                ));
            };
            let [x_m, y_m, _] = self.heads[number].position_m;
            let apart_m = Point::new(x_m, y_m)
                .distance_m(Point::new(settings.position_m[0], settings.position_m[1]));
            if apart_m > 1.0 + 5.0 * settings.position_std_m {
                return PathsError::that(format!(
                    "its radio head pci={pci} is {apart_m:.1} m from its position in the site: \
                     use one frame and one plan"
                ));
            }
            let places = self.places.len();
            let ends = (number * places, (number + 1) * places);
            if self.begins[ends.0] == self.begins[ends.1] {
                return PathsError::that(format!("no path from its radio head pci={pci}"));
            }
        }
        let metres = road.length_m().floor() as usize;
        let mut metres = (0..=metres).map(|it| it as f64);
        // Positions before the first and after the last traced position have no signal.
        let inside = ENDS_M..=road.length_m() - ENDS_M;
        let untraced = |along_m: &f64| self.place_near(road.pose(*along_m).point()).is_none();
        if let Some(along_m) = metres.find(|it| inside.contains(it) && untraced(it)) {
            return PathsError::that(format!(
                "no position within {REACH_M} m of the road at {along_m} m"
            ));
        }
        Ok(())
    }

    /// Returns the index of a radio head of the site in the file.
    pub fn head(&self, head: &RadioHeadSettings) -> Option<usize> {
        let (pci, ssb_index) = (f64::from(head.pci), f64::from(head.ssb_index));
        (self.heads.iter()).position(|it| it.pci == pci && it.ssb_index == ssb_index)
    }

    /// Returns the paths from radio head `head` of the file at the nearest traced position, and the
    /// offset of `place` from that position in x and y (m). Returns `None` if the distance exceeds
    /// [`REACH_M`].
    pub fn near(&self, head: usize, place: Point) -> Option<(&[TracedPath], [f64; 2])> {
        let number = self.place_near(place)?;
        let [x_m, y_m, _] = self.places[number];
        let link = head * self.places.len() + number;
        let paths = self.all.get(self.begins[link]..self.begins[link + 1])?;
        Some((paths, [place.x_m - x_m, place.y_m - y_m]))
    }

    /// Returns the Rician K factor of a radio head of the file at `place`: the power of the line of
    /// sight divided by the power of the other paths. Returns `None` if no traced position is near,
    /// and 0 without a line of sight.
    pub fn rician_k(&self, head: usize, place: Point) -> Option<f64> {
        let (paths, _) = self.near(head, place)?;
        let power = |direct| {
            let such = paths.iter().filter(|path| path.direct == direct);
            such.map(|path| f64::from(path.gain.norm_sqr()))
                .sum::<f64>()
        };
        // With a single path, the power of the others is zero apart from rounding.
        Some(power(true) / power(false).max(f64::MIN_POSITIVE))
    }

    fn place_near(&self, place: Point) -> Option<usize> {
        let [column, row] = square(place);
        let around = (-1..=1).flat_map(|i| (-1..=1).map(move |j| [column + i, row + j]));
        let near = around
            .filter_map(|square| self.squares.get(&square))
            .flatten();
        let apart_m = |number: &usize| {
            let [x_m, y_m, _] = self.places[*number];
            place.distance_m(Point::new(x_m, y_m))
        };
        let nearest = near
            .map(|number| (apart_m(number), *number))
            .min_by(|a, b| a.0.total_cmp(&b.0))?;
        (nearest.0 <= REACH_M).then_some(nearest.1)
    }
}

/// Returns the square of side [`REACH_M`] that contains `place`.
fn square(place: Point) -> [i64; 2] {
    [place.x_m, place.y_m].map(|part_m| (part_m / REACH_M).floor() as i64)
}

fn between_m(a: [f64; 3], b: [f64; 3]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1]).hypot(a[2] - b[2])
}

fn rows(values: &[f64]) -> Vec<[f64; 3]> {
    let rows = values.chunks_exact(3);
    rows.filter_map(|row| row.try_into().ok()).collect()
}

fn finite<'a>(name: &str, values: impl IntoIterator<Item = &'a f64>) -> Result<(), PathsError> {
    match values.into_iter().position(|value| !value.is_finite()) {
        Some(row) => PathsError::that(format!("`{name}` is not a number in row {row}")),
        None => Ok(()),
    }
}
